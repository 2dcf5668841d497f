"""Sonar latency: the delay line between true values and what vehicles observe.

With travel time, a vehicle is detected where it was R / c before reception, R being its distance at reception; between
control steps its position is interpolated linearly, and before the reset it is constant. Which vehicle is detected in
which sub-sector follows from the positions at reception. Travel time doesn't change echoes of obstacles.

A compensated reading is moved to the present pose by the vehicle's own turn, which is known exactly, and by its own
motion as its navigation estimates it, drift included. It stays in its sub-sector. An echo's range changes by as much
as the distance of its position.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields, Fields
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.disturbances.navigation import NavigationErrors
from uuv_marl.sim.disturbances.schedule import Reading, SonarTiming, control_step_of, due, latest, sonar_timing
from uuv_marl.sim.perception import saturate
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.types import Float32, Float64, Int32, Int64

Move = tuple[float, float, float, float]
"""Cosine and sine of a vehicle's turn, then its motion ahead and abeam at its present heading [m]."""

NO_DETECTION, FALSE_DETECTION, OBSTACLE = -1, -2, -3
"""Values of ``target_index`` for no detection, a false vehicle and an obstacle."""


@described
class Readings(NamedTuple):
    """The delay line: reading number m of an array lies in slot m modulo the number of slots.

    A place is a sub-sector, for a vehicle, or after all of them an active one, for an obstacle.
    """

    began: Annotated[Int64, "world", "Control step of the arrays' first reading."]
    past: Annotated[Float64, "world past vehicle 2", "Positions at the latest control steps, by their number [m]."]
    pose: Annotated[
        Float64,
        "world slot vehicle array 4",
        "Own estimated position at reception [m], cosine and sine of the heading.",
    ]
    target_index: Annotated[
        Int32, "world slot vehicle place", "Index of the vehicle detected, or a negative constant of this module.",
        Bounds(OBSTACLE, "vehicle"),
    ]  # fmt: skip
    reach: Annotated[Float32, "world slot vehicle place", "Range of the detection [m]."]
    position: Annotated[Float32, "world slot vehicle place 2", "Its position in the body frame at reception [m]."]


@described
class Detections(NamedTuple):
    """All detections of one array of all vehicles in a reading, one after the other."""

    listener: Annotated[Int64, "world detection", "Index of the vehicle that detects."]
    place: Annotated[Int64, "world detection", "Place in its reading, as in ``Readings``."]
    target_index: Annotated[Int64, "world detection", "As in ``Readings``."]
    reach: Annotated[Float64, "world detection", "Range [m], negative if missed."]
    x: Annotated[Float64, "world detection", "Distance ahead [m]."]
    y: Annotated[Float64, "world detection", "Distance to starboard [m]."]
    first: Annotated[Float64, "world detection", "Buffer for random numbers."]
    second: Annotated[Float64, "world detection", "Buffer for random numbers."]
    third: Annotated[Float64, "world detection", "Buffer for random numbers."]


def line_sizes(scenario: Scenario) -> dict[str, int]:
    """Lengths of the axes: all readings not yet available and the latest; past positions within sonar range."""
    numbers, arrays = sonar_timing(scenario), scenario.sonar.arrays
    far = max(array.range_m for array in arrays) * numbers.control_steps_per_metre
    return {
        "array": len(arrays),
        "place": scenario.sonar.num_sectors + scenario.sonar.num_active_sectors,
        "detection": max(array.sub_sectors * (1 + (array.kind == "active")) for array in arrays)
        * scenario.swarm.num_vehicles,
        "slot": 2 + math.floor(numbers.delay / float(numbers.every.min())),
        "past": math.floor(far) + 2 if far > 0.0 else 0,
    }


@compiled_inner
def any_due(w: int, tick: int, timing: SonarTiming, readings: Readings) -> bool:
    """Whether an array of world w takes a reading at this control step that a decision will use."""
    is_due, since = False, tick - readings.began[w]
    for a in range(0 if timing.ideal else timing.every.shape[0]):
        is_due = is_due or due(since, timing.every[a], timing.delay, timing.control_steps) >= 0
    return is_due


# --- From true values into the delay line ---


@compiled_inner
def begin_line(w: int, state: State, readings: Readings) -> None:
    """Start the arrays of world w with an empty delay line, as if all vehicles had been at rest before."""
    readings.began[w] = state.tick[w]
    readings.past[w], readings.pose[w], readings.reach[w], readings.position[w] = 0.0, 0.0, 0.0, 0.0
    readings.target_index[w] = NO_DETECTION
    remember(w, state, readings)


@compiled_inner
def remember(w: int, state: State, readings: Readings) -> None:
    """Store the positions of world w's vehicles, for later detections of them."""
    if readings.past.shape[1] > 0:
        row = state.tick[w] % readings.past.shape[1]
        for j in range(state.eta.shape[1]):
            readings.past[w, row, j, 0], readings.past[w, row, j, 1] = state.eta[w, j, 0], state.eta[w, j, 1]


@compiled_inner
def was_at(w: int, j: int, tick: int, ago: float, readings: Readings) -> tuple[float, float]:
    """Position of vehicle j, north and east [m], ``ago`` control steps before a tick; constant before the first."""
    past, whole = readings.past, min(int(ago), tick - readings.began[w])
    share = min(ago - whole, 1.0) if tick - whole > readings.began[w] else 0.0
    later = (tick - whole) % past.shape[1]
    earlier = later - 1 if later > 0 else past.shape[1] - 1
    x, y = past[w, later, j, 0], past[w, later, j, 1]
    return x + share * (past[w, earlier, j, 0] - x), y + share * (past[w, earlier, j, 1] - y)


@compiled_inner
def collect(
    at: Reading, world: World, see: Fields, timing: SonarTiming, errors: NavigationErrors, readings: Readings,
    detections: Detections,
) -> int:  # fmt: skip
    """Collect all that one array of every living vehicle detects now in ``detections``; return how many.

    Poses at reception are written into ``readings``.
    """
    w, a, num = at.w, at.a, 0
    eta, heading, detected_index = world.state.eta, world.senses.heading, world.senses.detected_index
    sectors = see.detected.shape[2]
    for i in range(eta.shape[1]):
        if not world.state.alive[w, i]:
            continue
        x, y, c, s = eta[w, i, 0], eta[w, i, 1], heading[w, i, 0], heading[w, i, 1]
        readings.pose[w, at.slot, i, a, 0] = x + errors.position_error[w, i, 0]
        readings.pose[w, at.slot, i, a, 1] = y + errors.position_error[w, i, 1]
        readings.pose[w, at.slot, i, a, 2], readings.pose[w, at.slot, i, a, 3] = c, s
        for k in range(timing.first[a], timing.first[a + 1]):
            j = detected_index[w, i, k]
            if j < 0:
                continue
            ahead, abeam = np.float64(see.neighbour[w, i, k, 0]), np.float64(see.neighbour[w, i, k, 1])
            if timing.control_steps_per_metre > 0.0:
                ago = math.sqrt(ahead * ahead + abeam * abeam) * timing.control_steps_per_metre
                north, east = was_at(w, j, at.tick, ago, readings)
                ahead, abeam = c * (north - x) + s * (east - y), c * (east - y) - s * (north - x)
            detections.listener[w, num], detections.place[w, num], detections.target_index[w, num] = i, k, j
            detections.x[w, num], detections.y[w, num] = ahead, abeam
            detections.reach[w, num] = math.sqrt(ahead * ahead + abeam * abeam)
            num += 1
        for e in range(timing.active[a], timing.active[a + 1]):
            if see.echo[w, i, e] > 0.0:
                detections.listener[w, num], detections.place[w, num] = i, sectors + e
                detections.target_index[w, num] = OBSTACLE
                detections.x[w, num] = see.echo_position[w, i, e, 0]
                detections.y[w, num] = see.echo_position[w, i, e, 1]
                detections.reach[w, num] = see.echo_range[w, i, e]
                num += 1
    return num


@compiled_inner
def store(at: Reading, num: int, timing: SonarTiming, detections: Detections, readings: Readings) -> None:
    """Store those of the first ``num`` detections that are not missed in the delay line; clear all other places."""
    for i in range(readings.target_index.shape[2]):
        clear_array(at, i, timing, readings)
    w, slot = at.w, at.slot
    for q in range(num):
        if detections.reach[w, q] >= 0.0:
            i, k = detections.listener[w, q], detections.place[w, q]
            readings.target_index[w, slot, i, k] = detections.target_index[w, q]
            readings.reach[w, slot, i, k] = detections.reach[w, q]
            readings.position[w, slot, i, k, 0] = detections.x[w, q]
            readings.position[w, slot, i, k, 1] = detections.y[w, q]


@compiled_inner
def clear_array(at: Reading, i: int, timing: SonarTiming, readings: Readings) -> None:
    """Remove all detections of an array of vehicle i from a reading."""
    sectors = readings.target_index.shape[3] - timing.active[-1]
    for k in range(timing.first[at.a], timing.first[at.a + 1]):
        readings.target_index[at.w, at.slot, i, k] = NO_DETECTION
    for e in range(timing.active[at.a], timing.active[at.a + 1]):
        readings.target_index[at.w, at.slot, i, sectors + e] = NO_DETECTION


# --- From the delay line into percepts ---


@compiled_inner
def write_readings(
    w: int, world: World, timing: SonarTiming, errors: NavigationErrors, readings: Readings, see: Fields,
    more: DisturbanceFields,
) -> None:  # fmt: skip
    """Write the latest available readings into the percepts of world w and into ``detected_index``."""
    tick, since = world.state.tick[w], world.state.tick[w] - readings.began[w]
    for a in range(timing.every.shape[0]):
        number = latest(since - timing.delay, timing.every[a])
        taken = readings.began[w] + control_step_of(max(number, 0), timing.every[a])  # the first one before any
        at = Reading(w, a, number, taken, number % readings.target_index.shape[1])
        carries = timing.compensated and number >= 0 and taken != tick
        for i in range(world.state.alive.shape[1]):
            if not world.state.alive[w, i]:
                continue
            for k in range(timing.first[a], timing.first[a + 1] if more.age.shape[2] > 0 else 0):
                more.age[w, i, k] = (tick - taken) * timing.control_step_s
            move = own_move(at, i, world, errors, readings) if carries else (1.0, 0.0, 0.0, 0.0)
            write_vehicle_readings(at, i, move, timing, readings, world.senses.detected_index, see)
            write_echo_readings(at, i, move, timing, readings, see)


@compiled_inner
def write_vehicle_readings(
    at: Reading, i: int, move: Move, timing: SonarTiming, readings: Readings, detected_index: Int32, see: Fields
) -> None:
    """Write the vehicles that vehicle i detected in a reading into its percept; for the link also their identities.

    A reading whose number is below 0 holds no detection.
    """
    w, slot, linked = at.w, at.slot, see.link_identity.shape[2] > 0
    for k in range(timing.first[at.a], timing.first[at.a + 1]):
        j, x, y = NO_DETECTION, 0.0, 0.0
        if at.number >= 0:
            j = readings.target_index[w, slot, i, k]
        if j != NO_DETECTION:
            x, y = np.float64(readings.position[w, slot, i, k, 0]), np.float64(readings.position[w, slot, i, k, 1])
            x, y = carried(x, y, move)
        detected_index[w, i, k] = max(j, NO_DETECTION)
        see.detected[w, i, k] = 0.0 if j == NO_DETECTION else 1.0
        see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1] = saturate(x, MAX_RANGE_M), saturate(y, MAX_RANGE_M)
        if linked:  # write_velocities writes the velocity
            see.link_identity[w, i, k] = max(j, NO_DETECTION) + 1
            see.link_velocity[w, i, k, 0] = see.link_velocity[w, i, k, 1] = 0.0


@compiled_inner
def write_echo_readings(at: Reading, i: int, move: Move, timing: SonarTiming, readings: Readings, see: Fields) -> None:
    """Write the echoes of a reading of vehicle i into its percept; a reading numbered below 0 holds none."""
    w, slot = at.w, at.slot
    for e in range(timing.active[at.a], timing.active[at.a + 1]):
        k, reach, x, y = see.detected.shape[2] + e, -1.0, 0.0, 0.0
        if at.number >= 0 and readings.target_index[w, slot, i, k] != NO_DETECTION:
            x, y = np.float64(readings.position[w, slot, i, k, 0]), np.float64(readings.position[w, slot, i, k, 1])
            far = math.sqrt(x * x + y * y)
            x, y = carried(x, y, move)
            reach = max(np.float64(readings.reach[w, slot, i, k]) + math.sqrt(x * x + y * y) - far, 0.0)
        see.echo[w, i, e] = 1.0 if reach >= 0.0 else 0.0
        see.echo_range[w, i, e] = min(max(reach, 0.0), MAX_RANGE_M)
        see.echo_position[w, i, e, 0] = saturate(x, MAX_RANGE_M)
        see.echo_position[w, i, e, 1] = saturate(y, MAX_RANGE_M)


@compiled_inner
def own_move(at: Reading, i: int, world: World, errors: NavigationErrors, readings: Readings) -> Move:
    """Turn and motion of vehicle i since a reading, as its navigation estimates them."""
    eta, heading, pose = world.state.eta, world.senses.heading, readings.pose
    x, y = pose[at.w, at.slot, i, at.a, 0], pose[at.w, at.slot, i, at.a, 1]
    c_then, s_then = pose[at.w, at.slot, i, at.a, 2], pose[at.w, at.slot, i, at.a, 3]
    c, s = heading[at.w, i, 0], heading[at.w, i, 1]
    dx = eta[at.w, i, 0] + errors.position_error[at.w, i, 0] - x
    dy = eta[at.w, i, 1] + errors.position_error[at.w, i, 1] - y
    return c_then * c + s_then * s, s * c_then - c * s_then, c * dx + s * dy, c * dy - s * dx


@compiled
def carried(x: float, y: float, move: Move) -> tuple[float, float]:
    """Coordinates of a fixed point in the body frame after a move of the vehicle, from those before it [m]."""
    c, s, ahead, abeam = move
    return c * x + s * y - ahead, c * y - s * x - abeam
