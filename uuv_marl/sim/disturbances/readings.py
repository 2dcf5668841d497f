"""How late the sonar is: the delay line from what is true to what vehicles know.

With travel time, a vehicle is heard where it was R / c before reception, R being its distance at reception; between
control holds it is put on the line between them, and before the reset where it stood. Who is heard, and in which
sub-sector, is decided by where vehicles are at reception. Obstacles stand still, so that their echoes tell no age.

A compensated reading is carried to the present pose: by the vehicle's own turn, which it knows, and by its own way as
its navigation has it, drift included. It stays in the sub-sector that heard it. An echo's range changes as the distance
of its position does.
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
"""Cosine and sine of a vehicle's turn, then how far it went, ahead and abeam as it is headed now [m]; (1, 0, 0, 0) for
none."""

NO_DETECTION, FALSE_DETECTION, OBSTACLE = -1, -2, -3
"""What is heard where it is no vehicle: nothing, a vehicle that isn't there, an obstacle."""


@described
class Readings(NamedTuple):
    """The delay line: reading number m of an array lies in slot m modulo the number of slots.

    A place of what can be heard is a sub-sector, for a vehicle, or beyond all of them an active one, for an obstacle.
    """

    began: Annotated[Int64, "world", "Control hold at which the arrays read first."]
    past: Annotated[Float64, "world past vehicle 2", "Positions at the latest control holds, by their number [m]."]
    pose: Annotated[
        Float64, "world slot vehicle array 4", "Own position as known at reception [m], cosine and sine of the heading."
    ]
    detected_index: Annotated[
        Int32, "world slot vehicle place", "Index of the vehicle heard, or ``NOBODY``, ``PHANTOM``, ``OBSTACLE``.",
        Bounds(OBSTACLE, "vehicle"),
    ]  # fmt: skip
    reach: Annotated[Float32, "world slot vehicle place", "Range at which it is heard [m]."]
    position: Annotated[Float32, "world slot vehicle place 2", "Its position in the body frame at reception [m]."]


@described
class Detections(NamedTuple):
    """All that an array of all vehicles hears in a reading, one after the other: room to work in."""

    code: Annotated[Int64, "world hit", "Index of the listener, shifted left by ``SHIFT``, plus the place."]
    detected_index: Annotated[Int64, "world hit", "As in ``Readings``."]
    reach: Annotated[Float64, "world hit", "Range [m], negative for what is missed."]
    x: Annotated[Float64, "world hit", "How far ahead its position is [m]."]
    y: Annotated[Float64, "world hit", "How far to starboard [m]."]
    first: Annotated[Float64, "world hit", "Room for draws."]
    second: Annotated[Float64, "world hit", "Room for draws."]
    third: Annotated[Float64, "world hit", "Room for draws."]


SHIFT, PLACE = 32, (1 << 32) - 1
"""Where a hit's code holds the listener, and the bits of the place."""


def line_sizes(scenario: Scenario) -> dict[str, int]:
    """Lengths of the axes: all readings on their way and the one that stands; the past within earshot."""
    numbers, arrays = sonar_timing(scenario), scenario.sonar.arrays
    far = max(array.range_m for array in arrays) * numbers.control_steps_per_metre
    return {
        "array": len(arrays),
        "place": scenario.sonar.num_sectors + scenario.sonar.num_active_sectors,
        "hit": scenario.swarm.num_vehicles
        * max(array.sub_sectors * (1 + (array.kind == "active")) for array in arrays),
        "slot": 2 + math.floor(numbers.delay / float(numbers.every.min())),
        "past": math.floor(far) + 2 if far > 0.0 else 0,
    }


@compiled_inner
def any_due(w: int, tick: int, sonar_timing: SonarTiming, readings: Readings) -> bool:
    """Whether an array of world w takes a reading at this control hold."""
    is_due = False
    for a in range(0 if sonar_timing.ideal else sonar_timing.every.shape[0]):
        is_due = (
            is_due
            or due(tick - readings.began[w], sonar_timing.every[a], sonar_timing.delay, sonar_timing.control_steps) >= 0
        )
    return is_due


# --- From what is true into the line ---


@compiled_inner
def begin_line(w: int, state: State, readings: Readings) -> None:
    """The arrays of world w begin now, the line empty; whoever is there has stood there before."""
    readings.began[w] = state.tick[w]
    readings.past[w], readings.pose[w], readings.reach[w], readings.position[w] = 0.0, 0.0, 0.0, 0.0
    readings.detected_index[w] = NO_DETECTION
    remember(w, state, readings)


@compiled_inner
def remember(w: int, state: State, readings: Readings) -> None:
    """Where the vehicles of world w are now, for those who hear them later."""
    if readings.past.shape[1] > 0:
        row = state.tick[w] % readings.past.shape[1]
        for j in range(state.eta.shape[1]):
            readings.past[w, row, j, 0], readings.past[w, row, j, 1] = state.eta[w, j, 0], state.eta[w, j, 1]


@compiled_inner
def was_at(w: int, j: int, tick: int, ago: float, readings: Readings) -> tuple[float, float]:
    """North and east [m] of vehicle j some control holds before a tick; before the beginning it stood still."""
    past, whole = readings.past, min(int(ago), tick - readings.began[w])
    share = min(ago - whole, 1.0) if tick - whole > readings.began[w] else 0.0
    later = (tick - whole) % past.shape[1]
    earlier = later - 1 if later > 0 else past.shape[1] - 1
    x, y = past[w, later, j, 0], past[w, later, j, 1]
    return x + share * (past[w, earlier, j, 0] - x), y + share * (past[w, earlier, j, 1] - y)


@compiled_inner
def collect(
    at: Reading,
    world: World,
    see: Fields,
    sonar_timing: SonarTiming,
    navigation_errors: NavigationErrors,
    readings: Readings,
    detections: Detections,
) -> int:
    """All that an array of every living vehicle hears now, into ``hits``; how many they are.

    Poses at reception are written into ``readings``.
    """
    w, a, num = at.w, at.a, 0
    eta, heading, detected_index, sectors = (
        world.state.eta,
        world.senses.heading,
        world.senses.detected_index,
        see.detected.shape[2],
    )
    for i in range(eta.shape[1]):
        if not world.state.alive[w, i]:
            continue
        x, y, c, s = eta[w, i, 0], eta[w, i, 1], heading[w, i, 0], heading[w, i, 1]
        readings.pose[w, at.slot, i, a, 0] = x + navigation_errors.position_error[w, i, 0]
        readings.pose[w, at.slot, i, a, 1] = y + navigation_errors.position_error[w, i, 1]
        readings.pose[w, at.slot, i, a, 2], readings.pose[w, at.slot, i, a, 3] = c, s
        for k in range(sonar_timing.first[a], sonar_timing.first[a + 1]):
            j = detected_index[w, i, k]
            if j < 0:
                continue
            ahead, abeam = np.float64(see.neighbour[w, i, k, 0]), np.float64(see.neighbour[w, i, k, 1])
            if sonar_timing.control_steps_per_metre > 0.0:
                ago = math.sqrt(ahead * ahead + abeam * abeam) * sonar_timing.control_steps_per_metre
                north, east = was_at(w, j, at.tick, ago, readings)
                ahead, abeam = c * (north - x) + s * (east - y), c * (east - y) - s * (north - x)
            detections.code[w, num], detections.detected_index[w, num] = (i << SHIFT) + k, j
            detections.x[w, num], detections.y[w, num] = ahead, abeam
            detections.reach[w, num] = math.sqrt(ahead * ahead + abeam * abeam)
            num += 1
        for e in range(sonar_timing.active[a], sonar_timing.active[a + 1]):
            if see.echo[w, i, e] > 0.0:
                detections.code[w, num], detections.detected_index[w, num] = (i << SHIFT) + sectors + e, OBSTACLE
                detections.x[w, num], detections.y[w, num] = (
                    see.echo_position[w, i, e, 0],
                    see.echo_position[w, i, e, 1],
                )
                detections.reach[w, num] = see.echo_range[w, i, e]
                num += 1
    return num


@compiled_inner
def store(at: Reading, num: int, sonar_timing: SonarTiming, detections: Detections, readings: Readings) -> None:
    """Put the first ``num`` hits that are not missed into the line; in all other places nothing is heard."""
    for i in range(readings.detected_index.shape[2]):
        clear_array(at, i, sonar_timing, readings)
    w, slot = at.w, at.slot
    for q in range(num):
        if detections.reach[w, q] >= 0.0:
            i, k = detections.code[w, q] >> SHIFT, detections.code[w, q] & PLACE
            readings.detected_index[w, slot, i, k], readings.reach[w, slot, i, k] = (
                detections.detected_index[w, q],
                detections.reach[w, q],
            )
            readings.position[w, slot, i, k, 0], readings.position[w, slot, i, k, 1] = (
                detections.x[w, q],
                detections.y[w, q],
            )


@compiled_inner
def clear_array(at: Reading, i: int, sonar_timing: SonarTiming, readings: Readings) -> None:
    """An array of vehicle i has heard nothing."""
    sectors = readings.detected_index.shape[3] - sonar_timing.active[-1]
    for k in range(sonar_timing.first[at.a], sonar_timing.first[at.a + 1]):
        readings.detected_index[at.w, at.slot, i, k] = NO_DETECTION
    for e in range(sonar_timing.active[at.a], sonar_timing.active[at.a + 1]):
        readings.detected_index[at.w, at.slot, i, sectors + e] = NO_DETECTION


# --- From the line into percepts ---


@compiled_inner
def write_readings(
    w: int,
    world: World,
    sonar_timing: SonarTiming,
    navigation_errors: NavigationErrors,
    readings: Readings,
    see: Fields,
    more: DisturbanceFields,
) -> None:
    """Write into the percepts of world w, and into ``heard``, what the readings that stand now say."""
    tick, since = world.state.tick[w], world.state.tick[w] - readings.began[w]
    for a in range(sonar_timing.every.shape[0]):
        number = latest(since - sonar_timing.delay, sonar_timing.every[a])
        taken = readings.began[w] + control_step_of(
            max(number, 0), sonar_timing.every[a]
        )  # before the first: since they began
        at = Reading(w, a, number, taken, number % readings.detected_index.shape[1])
        carries = sonar_timing.compensated and number >= 0 and taken != tick
        for i in range(world.state.alive.shape[1]):
            if not world.state.alive[w, i]:
                continue
            for k in range(sonar_timing.first[a], sonar_timing.first[a + 1] if more.age.shape[2] > 0 else 0):
                more.age[w, i, k] = (tick - taken) * sonar_timing.control_step_s
            move = own_move(at, i, world, navigation_errors, readings) if carries else (1.0, 0.0, 0.0, 0.0)
            write_vehicle_readings(at, i, move, sonar_timing, readings, world.senses.detected_index, see)
            write_echo_readings(at, i, move, sonar_timing, readings, see)


@compiled_inner
def write_vehicle_readings(
    at: Reading, i: int, move: Move, sonar_timing: SonarTiming, readings: Readings, detected_index: Int32, see: Fields
) -> None:
    """The vehicles that vehicle i heard in a reading, into its percept; by the link also who they are.

    A number of the reading below 0 is silence.
    """
    w, slot, linked = at.w, at.slot, see.link_identity.shape[2] > 0
    for k in range(sonar_timing.first[at.a], sonar_timing.first[at.a + 1]):
        j, x, y = NO_DETECTION, 0.0, 0.0
        if at.number >= 0:
            j = readings.detected_index[w, slot, i, k]
        if j != NO_DETECTION:
            x, y = np.float64(readings.position[w, slot, i, k, 0]), np.float64(readings.position[w, slot, i, k, 1])
            x, y = carried(x, y, move)
        detected_index[w, i, k] = max(j, NO_DETECTION)
        see.detected[w, i, k] = 0.0 if j == NO_DETECTION else 1.0
        see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1] = saturate(x, MAX_RANGE_M), saturate(y, MAX_RANGE_M)
        if linked:  # a velocity is written where the current is known
            see.link_identity[w, i, k] = max(j, NO_DETECTION) + 1
            see.link_velocity[w, i, k, 0] = see.link_velocity[w, i, k, 1] = 0.0


@compiled_inner
def write_echo_readings(
    at: Reading, i: int, move: Move, sonar_timing: SonarTiming, readings: Readings, see: Fields
) -> None:
    """The echoes that vehicle i heard in a reading, into its percept. A number of the reading below 0 is silence."""
    w, slot = at.w, at.slot
    for e in range(sonar_timing.active[at.a], sonar_timing.active[at.a + 1]):
        k, reach, x, y = see.detected.shape[2] + e, -1.0, 0.0, 0.0
        if at.number >= 0 and readings.detected_index[w, slot, i, k] != NO_DETECTION:
            x, y = np.float64(readings.position[w, slot, i, k, 0]), np.float64(readings.position[w, slot, i, k, 1])
            far = math.sqrt(x * x + y * y)
            x, y = carried(x, y, move)
            reach = max(np.float64(readings.reach[w, slot, i, k]) + math.sqrt(x * x + y * y) - far, 0.0)
        see.echo[w, i, e] = 1.0 if reach >= 0.0 else 0.0
        see.echo_range[w, i, e] = min(max(reach, 0.0), MAX_RANGE_M)
        see.echo_position[w, i, e, 0] = saturate(x, MAX_RANGE_M)
        see.echo_position[w, i, e, 1] = saturate(y, MAX_RANGE_M)


@compiled_inner
def own_move(at: Reading, i: int, world: World, navigation_errors: NavigationErrors, readings: Readings) -> Move:
    """How vehicle i turned and went since a reading, as it knows it."""
    eta, heading, pose = world.state.eta, world.senses.heading, readings.pose
    x, y = pose[at.w, at.slot, i, at.a, 0], pose[at.w, at.slot, i, at.a, 1]
    c_then, s_then = pose[at.w, at.slot, i, at.a, 2], pose[at.w, at.slot, i, at.a, 3]
    c, s = heading[at.w, i, 0], heading[at.w, i, 1]
    dx, dy = (
        eta[at.w, i, 0] + navigation_errors.position_error[at.w, i, 0] - x,
        eta[at.w, i, 1] + navigation_errors.position_error[at.w, i, 1] - y,
    )
    return c_then * c + s_then * s, s * c_then - c * s_then, c * dx + s * dy, c * dy - s * dx


@compiled
def carried(x: float, y: float, move: Move) -> tuple[float, float]:
    """A point that stands still, in the body frame after its owner's move, from the body frame before."""
    c, s, ahead, abeam = move
    return c * x + s * y - ahead, c * y - s * x - abeam
