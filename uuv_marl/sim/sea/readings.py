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

from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.perception import saturate
from uuv_marl.sim.sea.navigation import Track
from uuv_marl.sim.sea.schedule import Listening, Reading, due, hold_of, latest, listening
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.sim.views import Fields, SeaFields
from uuv_marl.types import Float32, Float64, Int32, Int64

Move = tuple[float, float, float, float]
"""Cosine and sine of a vehicle's turn, then how far it went, ahead and abeam as it is headed now [m]; (1, 0, 0, 0) for
none."""

NOBODY, PHANTOM, OBSTACLE = -1, -2, -3
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
    whom: Annotated[
        Int32, "world slot vehicle place", "Index of the vehicle heard, or ``NOBODY``, ``PHANTOM``, ``OBSTACLE``.",
        Bounds(OBSTACLE, "vehicle"),
    ]  # fmt: skip
    reach: Annotated[Float32, "world slot vehicle place", "Range at which it is heard [m]."]
    where: Annotated[Float32, "world slot vehicle place 2", "Its position in the body frame at reception [m]."]


@described
class Hits(NamedTuple):
    """All that an array of all vehicles hears in a reading, one after the other: room to work in."""

    code: Annotated[Int64, "world hit", "Index of the listener, shifted left by ``SHIFT``, plus the place."]
    whom: Annotated[Int64, "world hit", "As in ``Readings``."]
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
    numbers, arrays = listening(scenario), scenario.sonar.arrays
    far = max(array.range_m for array in arrays) * numbers.holds_per_metre
    return {
        "array": len(arrays),
        "place": scenario.sonar.num_sectors + scenario.sonar.num_active_sectors,
        "hit": scenario.swarm.num_vehicles
        * max(array.sub_sectors * (1 + (array.kind == "active")) for array in arrays),
        "slot": 2 + math.floor(numbers.delay / float(numbers.every.min())),
        "past": math.floor(far) + 2 if far > 0.0 else 0,
    }


@compiled_inner
def any_due(w: int, tick: int, listening: Listening, readings: Readings) -> bool:
    """Whether an array of world w takes a reading at this control hold."""
    found = False
    for a in range(0 if listening.ideal else listening.every.shape[0]):
        found = found or due(tick - readings.began[w], listening.every[a], listening.delay, listening.holds) >= 0
    return found


# --- From what is true into the line ---


@compiled_inner
def begin_line(w: int, state: State, readings: Readings) -> None:
    """The arrays of world w begin now, the line empty; whoever is there has stood there before."""
    readings.began[w] = state.tick[w]
    readings.past[w], readings.pose[w], readings.reach[w], readings.where[w] = 0.0, 0.0, 0.0, 0.0
    readings.whom[w] = NOBODY
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
    at: Reading, world: World, see: Fields, listening: Listening, track: Track, readings: Readings, hits: Hits
) -> int:
    """All that an array of every living vehicle hears now, into ``hits``; how many they are.

    Poses at reception are written into ``readings``.
    """
    w, a, num = at.w, at.a, 0
    eta, heading, heard, sectors = world.state.eta, world.senses.heading, world.senses.heard, see.heard.shape[2]
    for i in range(eta.shape[1]):
        if not world.state.alive[w, i]:
            continue
        x, y, c, s = eta[w, i, 0], eta[w, i, 1], heading[w, i, 0], heading[w, i, 1]
        readings.pose[w, at.slot, i, a, 0] = x + track.strayed[w, i, 0]
        readings.pose[w, at.slot, i, a, 1] = y + track.strayed[w, i, 1]
        readings.pose[w, at.slot, i, a, 2], readings.pose[w, at.slot, i, a, 3] = c, s
        for k in range(listening.first[a], listening.first[a + 1]):
            j = heard[w, i, k]
            if j < 0:
                continue
            ahead, abeam = np.float64(see.neighbour[w, i, k, 0]), np.float64(see.neighbour[w, i, k, 1])
            if listening.holds_per_metre > 0.0:
                ago = math.sqrt(ahead * ahead + abeam * abeam) * listening.holds_per_metre
                north, east = was_at(w, j, at.tick, ago, readings)
                ahead, abeam = c * (north - x) + s * (east - y), c * (east - y) - s * (north - x)
            hits.code[w, num], hits.whom[w, num] = (i << SHIFT) + k, j
            hits.x[w, num], hits.y[w, num] = ahead, abeam
            hits.reach[w, num] = math.sqrt(ahead * ahead + abeam * abeam)
            num += 1
        for e in range(listening.active[a], listening.active[a + 1]):
            if see.echo[w, i, e] > 0.0:
                hits.code[w, num], hits.whom[w, num] = (i << SHIFT) + sectors + e, OBSTACLE
                hits.x[w, num], hits.y[w, num] = see.echo_position[w, i, e, 0], see.echo_position[w, i, e, 1]
                hits.reach[w, num] = see.echo_range[w, i, e]
                num += 1
    return num


@compiled_inner
def store(at: Reading, num: int, listening: Listening, hits: Hits, readings: Readings) -> None:
    """Put the first ``num`` hits that are not missed into the line; in all other places nothing is heard."""
    for i in range(readings.whom.shape[2]):
        hush(at, i, listening, readings)
    w, slot = at.w, at.slot
    for q in range(num):
        if hits.reach[w, q] >= 0.0:
            i, k = hits.code[w, q] >> SHIFT, hits.code[w, q] & PLACE
            readings.whom[w, slot, i, k], readings.reach[w, slot, i, k] = hits.whom[w, q], hits.reach[w, q]
            readings.where[w, slot, i, k, 0], readings.where[w, slot, i, k, 1] = hits.x[w, q], hits.y[w, q]


@compiled_inner
def hush(at: Reading, i: int, listening: Listening, readings: Readings) -> None:
    """An array of vehicle i has heard nothing."""
    sectors = readings.whom.shape[3] - listening.active[-1]
    for k in range(listening.first[at.a], listening.first[at.a + 1]):
        readings.whom[at.w, at.slot, i, k] = NOBODY
    for e in range(listening.active[at.a], listening.active[at.a + 1]):
        readings.whom[at.w, at.slot, i, sectors + e] = NOBODY


# --- From the line into percepts ---


@compiled_inner
def recall(
    w: int, world: World, listening: Listening, track: Track, readings: Readings, see: Fields, more: SeaFields
) -> None:
    """Write into the percepts of world w, and into ``heard``, what the readings that stand now say."""
    tick, since = world.state.tick[w], world.state.tick[w] - readings.began[w]
    for a in range(listening.every.shape[0]):
        number = latest(since - listening.delay, listening.every[a])
        taken = readings.began[w] + hold_of(max(number, 0), listening.every[a])  # before the first: since they began
        at = Reading(w, a, number, taken, number % readings.whom.shape[1])
        carries = listening.compensated and number >= 0 and taken != tick
        for i in range(world.state.alive.shape[1]):
            if not world.state.alive[w, i]:
                continue
            for k in range(listening.first[a], listening.first[a + 1] if more.age.shape[2] > 0 else 0):
                more.age[w, i, k] = (tick - taken) * listening.hold_s
            move = own_move(at, i, world, track, readings) if carries else (1.0, 0.0, 0.0, 0.0)
            tell_vehicles(at, i, move, listening, readings, world.senses.heard, see)
            tell_echoes(at, i, move, listening, readings, see)


@compiled_inner
def tell_vehicles(
    at: Reading, i: int, move: Move, listening: Listening, readings: Readings, heard: Int32, see: Fields
) -> None:
    """The vehicles that vehicle i heard in a reading, into its percept; by the link also who they are.

    A number of the reading below 0 is silence.
    """
    w, slot, linked = at.w, at.slot, see.link_identity.shape[2] > 0
    for k in range(listening.first[at.a], listening.first[at.a + 1]):
        j, x, y = NOBODY, 0.0, 0.0
        if at.number >= 0:
            j = readings.whom[w, slot, i, k]
        if j != NOBODY:
            x, y = np.float64(readings.where[w, slot, i, k, 0]), np.float64(readings.where[w, slot, i, k, 1])
            x, y = carried(x, y, move)
        heard[w, i, k] = max(j, NOBODY)
        see.heard[w, i, k] = 0.0 if j == NOBODY else 1.0
        see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1] = saturate(x, MAX_RANGE_M), saturate(y, MAX_RANGE_M)
        if linked:  # a velocity is written where the current is known
            see.link_identity[w, i, k] = max(j, NOBODY) + 1
            see.link_velocity[w, i, k, 0] = see.link_velocity[w, i, k, 1] = 0.0


@compiled_inner
def tell_echoes(at: Reading, i: int, move: Move, listening: Listening, readings: Readings, see: Fields) -> None:
    """The echoes that vehicle i heard in a reading, into its percept. A number of the reading below 0 is silence."""
    w, slot = at.w, at.slot
    for e in range(listening.active[at.a], listening.active[at.a + 1]):
        k, reach, x, y = see.heard.shape[2] + e, -1.0, 0.0, 0.0
        if at.number >= 0 and readings.whom[w, slot, i, k] != NOBODY:
            x, y = np.float64(readings.where[w, slot, i, k, 0]), np.float64(readings.where[w, slot, i, k, 1])
            far = math.sqrt(x * x + y * y)
            x, y = carried(x, y, move)
            reach = max(np.float64(readings.reach[w, slot, i, k]) + math.sqrt(x * x + y * y) - far, 0.0)
        see.echo[w, i, e] = 1.0 if reach >= 0.0 else 0.0
        see.echo_range[w, i, e] = min(max(reach, 0.0), MAX_RANGE_M)
        see.echo_position[w, i, e, 0] = saturate(x, MAX_RANGE_M)
        see.echo_position[w, i, e, 1] = saturate(y, MAX_RANGE_M)


@compiled_inner
def own_move(at: Reading, i: int, world: World, track: Track, readings: Readings) -> Move:
    """How vehicle i turned and went since a reading, as it knows it."""
    eta, heading, pose = world.state.eta, world.senses.heading, readings.pose
    x, y = pose[at.w, at.slot, i, at.a, 0], pose[at.w, at.slot, i, at.a, 1]
    c_then, s_then = pose[at.w, at.slot, i, at.a, 2], pose[at.w, at.slot, i, at.a, 3]
    c, s = heading[at.w, i, 0], heading[at.w, i, 1]
    dx, dy = eta[at.w, i, 0] + track.strayed[at.w, i, 0] - x, eta[at.w, i, 1] + track.strayed[at.w, i, 1] - y
    return c_then * c + s_then * s, s * c_then - c * s_then, c * dx + s * dy, c * dy - s * dx


@compiled
def carried(x: float, y: float, move: Move) -> tuple[float, float]:
    """A point that stands still, in the body frame after its owner's move, from the body frame before."""
    c, s, ahead, abeam = move
    return c * x + s * y - ahead, c * y - s * x - abeam
