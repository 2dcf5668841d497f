"""How late the sonar is: when each array reads, and the delay line from what is true to what vehicles know.

A reading is what one array hears at the end of one control hold: whom and where, and echoes. It stands from
``latency.processing_s`` after its reception until the array's next one does.

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
from numpy.typing import NDArray

from uuv_marl.scenario import MAX_RANGE_M, Scenario, hears_ideally
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.perception import saturate
from uuv_marl.sim.sea.navigation import Track
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.sim.views import Fields, SeaFields

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Move = tuple[float, float, float, float]
"""Cosine and sine of a turn, then how far a vehicle went, ahead and abeam as it is headed now [m]."""

NOBODY, PHANTOM = -1, -2
"""Whom a sub-sector hears where it hears no vehicle: nobody, or one that isn't there."""


class Listening(NamedTuple):
    """Numbers of a scenario's arrays and of how late they are. Times in control holds."""

    ideal: bool
    """Whether all is heard at once and as it is, so that percepts stay as they are."""
    hold_s: float
    """Length of a control hold [s]."""
    holds: int
    """Of a decision."""
    delay: int
    """From the reception of a reading until a policy has it."""
    holds_per_metre: float
    """That sound takes; 0: none."""
    compensated: bool
    """Whether readings are carried to the present pose."""
    every: Float64
    """Between two readings of each array, at least 1, shape (array,)."""
    first: Int64
    """First sub-sector of each array, and their number, shape (array + 1,)."""
    active: Int64
    """First of its sub-sectors among the active ones, and their number, shape (array + 1,)."""


@described
class Readings(NamedTuple):
    """The delay line: reading number m of an array lies in slot m modulo the number of slots."""

    began: Annotated[Int64, "world", "Control hold at which the arrays read first."]
    past: Annotated[Float64, "world past vehicle 2", "Positions at the latest control holds, by their number [m]."]
    pose: Annotated[
        Float64, "world slot vehicle array 4", "Own position as known at reception [m], cosine and sine of the heading."
    ]
    whom: Annotated[
        Int32, "world slot vehicle sector", "Index of the vehicle heard, ``NOBODY`` or ``PHANTOM``.",
        Bounds(PHANTOM, "vehicle"),
    ]  # fmt: skip
    where: Annotated[Float32, "world slot vehicle sector 2", "Where it is heard, in the body frame at reception [m]."]
    surface: Annotated[Float32, "world slot vehicle active", "Range of the echo [m], -1 for none."]
    point: Annotated[Float32, "world slot vehicle active 2", "Its position in the body frame at reception [m]."]


class Reading(NamedTuple):
    """One reading of an array, by all vehicles of a world."""

    w: int
    """The world."""
    a: int
    """The array."""
    number: int
    """Of those that the array took."""
    tick: int
    """Control hold of its reception."""
    slot: int
    """Where it is kept."""


def listening(scenario: Scenario) -> Listening:
    """The scenario's arrays and delays as numbers for the compiled functions."""
    latency, arrays, hold_s = scenario.latency, scenario.sonar.arrays, scenario.timing.control_hold_s
    period_s = {"active": latency.active_period_s, "passive": latency.passive_period_s}
    sub_sectors = [array.sub_sectors for array in arrays]
    active = [array.sub_sectors if array.kind == "active" else 0 for array in arrays]
    return Listening(
        ideal=hears_ideally(scenario),
        hold_s=hold_s,
        holds=scenario.timing.holds_per_decision,
        delay=math.ceil(latency.processing_s / hold_s - 1e-9),
        holds_per_metre=1.0 / (latency.sound_speed_mps * hold_s) if latency.travel_time else 0.0,
        compensated=latency.compensated,
        every=np.array([max(period_s[array.kind] / hold_s, 1.0) for array in arrays]),
        first=np.cumsum([0, *sub_sectors]),
        active=np.cumsum([0, *active]),
    )


def line_sizes(scenario: Scenario) -> dict[str, int]:
    """Lengths of the axes of ``Readings``: all readings on their way and the one that stands; the past in earshot."""
    numbers = listening(scenario)
    far = max(array.range_m for array in scenario.sonar.arrays) * numbers.holds_per_metre
    return {
        "array": len(scenario.sonar.arrays),
        "active": int(numbers.active[-1]),
        "slot": 2 + math.floor(numbers.delay / float(numbers.every.min())),
        "past": math.floor(far) + 2 if far > 0.0 else 0,
    }


# --- When arrays read ---


@compiled
def hold_of(number: int, every: float) -> int:
    """Control hold, from the first reading on, at which an array takes a reading: the nearest to its time."""
    return math.floor(number * every + 0.5)


@compiled
def latest(hold: int, every: float) -> int:
    """Number of the latest reading up to a control hold, -1 for none."""
    if hold < 0:
        return -1
    number = int((hold + 0.5) / every) + 1
    while hold_of(number, every) > hold:
        number -= 1
    return number


@compiled
def due(hold: int, every: float, delay: int, holds: int) -> int:
    """Number of the reading that an array takes at this control hold; -1 for none, or one that no decision will see.

    Args:
        hold: since the array began.
        every: control holds between readings.
        delay: control holds until a policy has a reading.
        holds: of a decision.
    """
    number = latest(hold, every)
    if hold_of(number, every) != hold:
        return -1
    decision = (hold + delay + holds - 1) // holds * holds
    return number if latest(decision - delay, every) == number else -1


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
    """The arrays of world w begin now; whoever is there has stood there before."""
    readings.began[w] = state.tick[w]
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
    whole = int(ago)
    share, began, past = ago - whole, readings.began[w], readings.past
    later, earlier = max(tick - whole, began) % past.shape[1], max(tick - whole - 1, began) % past.shape[1]
    x, y = past[w, later, j, 0], past[w, later, j, 1]
    return x + share * (past[w, earlier, j, 0] - x), y + share * (past[w, earlier, j, 1] - y)


@compiled_inner
def keep(at: Reading, world: World, see: Fields, listening: Listening, track: Track, readings: Readings) -> None:
    """Put what an array of every living vehicle hears now into the line.

    Args:
        at: the reading.
        world: its arrays; percepts hold what is true.
        see: fields of the percepts.
        listening: the scenario's numbers.
        track: how far vehicles believe to be from where they are.
        readings: is written.
    """
    w, a, slot = at.w, at.a, at.slot
    eta, heading, heard = world.state.eta, world.senses.heading, world.senses.heard
    for i in range(eta.shape[1]):
        if not world.state.alive[w, i]:
            continue
        x, y, c, s = eta[w, i, 0], eta[w, i, 1], heading[w, i, 0], heading[w, i, 1]
        readings.pose[w, slot, i, a, 0] = x + track.drift[w, i, 0]
        readings.pose[w, slot, i, a, 1] = y + track.drift[w, i, 1]
        readings.pose[w, slot, i, a, 2], readings.pose[w, slot, i, a, 3] = c, s
        for k in range(listening.first[a], listening.first[a + 1]):
            j = heard[w, i, k]
            readings.whom[w, slot, i, k] = j
            readings.where[w, slot, i, k, 0] = see.neighbour[w, i, k, 0]
            readings.where[w, slot, i, k, 1] = see.neighbour[w, i, k, 1]
            if j >= 0 and listening.holds_per_metre > 0.0:
                dx, dy = eta[w, j, 0] - x, eta[w, j, 1] - y
                ago = math.sqrt(dx * dx + dy * dy) * listening.holds_per_metre
                north, east = was_at(w, j, at.tick, ago, readings)
                dx, dy = north - x, east - y
                readings.where[w, slot, i, k, 0] = c * dx + s * dy
                readings.where[w, slot, i, k, 1] = c * dy - s * dx
        for e in range(listening.active[a], listening.active[a + 1]):
            readings.surface[w, slot, i, e] = see.echo_range[w, i, e] if see.echo[w, i, e] > 0.0 else -1.0
            readings.point[w, slot, i, e, 0] = see.echo_position[w, i, e, 0]
            readings.point[w, slot, i, e, 1] = see.echo_position[w, i, e, 1]


# --- From the line into percepts ---


@compiled_inner
def recall(
    w: int, world: World, listening: Listening, track: Track, readings: Readings, see: Fields, more: SeaFields
) -> None:
    """Write into the percepts of world w, and into ``heard``, what the readings that stand now say.

    Args:
        w: the world.
        world: its arrays.
        listening: the scenario's numbers.
        track: how far vehicles believe to be from where they are.
        readings: the line.
        see: fields of the percepts, which are written.
        more: fields of the sea's channels, which are written.
    """
    tick, since = world.state.tick[w], world.state.tick[w] - readings.began[w]
    for a in range(listening.every.shape[0]):
        number = latest(since - listening.delay, listening.every[a])
        taken = readings.began[w] + hold_of(max(number, 0), listening.every[a])  # before the first: since they began
        at = Reading(w, a, number, taken, number % readings.whom.shape[1])
        for k in range(listening.first[a], listening.first[a + 1] if more.age.shape[2] > 0 else 0):
            for i in range(world.state.alive.shape[1]):
                if world.state.alive[w, i]:
                    more.age[w, i, k] = (tick - taken) * listening.hold_s
        tell_vehicles(at, world, listening, track, readings, see)
        tell_echoes(at, world, listening, track, readings, see)


@compiled_inner
def tell_vehicles(
    at: Reading, world: World, listening: Listening, track: Track, readings: Readings, see: Fields
) -> None:
    """The vehicles that a reading heard, into every living vehicle's percept; by the link also who they are.

    Args:
        at: the reading; a number below 0 for silence.
        world: its arrays.
        listening: the scenario's numbers.
        track: how far vehicles believe to be from where they are.
        readings: the line.
        see: fields of the percepts, which are written.
    """
    w, a, slot, linked = at.w, at.a, at.slot, see.link_identity.shape[2] > 0
    for i in range(world.state.alive.shape[1]):
        if not world.state.alive[w, i]:
            continue
        moved = listening.compensated and at.number >= 0 and at.tick != world.state.tick[w]
        move = own_move(at, i, world, track, readings) if moved else (1.0, 0.0, 0.0, 0.0)
        for k in range(listening.first[a], listening.first[a + 1]):
            j, x, y = NOBODY, 0.0, 0.0
            if at.number >= 0:
                j = readings.whom[w, slot, i, k]
            if j != NOBODY:
                x, y = np.float64(readings.where[w, slot, i, k, 0]), np.float64(readings.where[w, slot, i, k, 1])
                if moved:
                    x, y = carried(x, y, move)
            world.senses.heard[w, i, k] = max(j, NOBODY)
            see.heard[w, i, k] = 0.0 if j == NOBODY else 1.0
            see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1] = saturate(x, MAX_RANGE_M), saturate(y, MAX_RANGE_M)
            if linked:  # a velocity is written where the current is known
                see.link_identity[w, i, k] = max(j, NOBODY) + 1
                see.link_velocity[w, i, k, 0] = see.link_velocity[w, i, k, 1] = 0.0


@compiled_inner
def tell_echoes(at: Reading, world: World, listening: Listening, track: Track, readings: Readings, see: Fields) -> None:
    """The echoes that a reading heard, into every living vehicle's percept; arguments as for ``tell_vehicles``."""
    w, a, slot = at.w, at.a, at.slot
    if listening.active[a] == listening.active[a + 1]:
        return
    for i in range(world.state.alive.shape[1]):
        if not world.state.alive[w, i]:
            continue
        moved = listening.compensated and at.number >= 0 and at.tick != world.state.tick[w]
        move = own_move(at, i, world, track, readings) if moved else (1.0, 0.0, 0.0, 0.0)
        for e in range(listening.active[a], listening.active[a + 1]):
            reach, x, y = -1.0, 0.0, 0.0
            if at.number >= 0:
                reach = np.float64(readings.surface[w, slot, i, e])
            if reach >= 0.0:
                x, y = np.float64(readings.point[w, slot, i, e, 0]), np.float64(readings.point[w, slot, i, e, 1])
                if moved:
                    far = math.sqrt(x * x + y * y)
                    x, y = carried(x, y, move)
                    reach = max(reach + math.sqrt(x * x + y * y) - far, 0.0)
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
    dx, dy = eta[at.w, i, 0] + track.drift[at.w, i, 0] - x, eta[at.w, i, 1] + track.drift[at.w, i, 1] - y
    return c_then * c + s_then * s, s * c_then - c * s_then, c * dx + s * dy, c * dy - s * dx


@compiled
def carried(x: float, y: float, move: Move) -> tuple[float, float]:
    """A point that stands still, in the body frame after its owner's move, from the body frame before."""
    c, s, ahead, abeam = move
    return c * x + s * y - ahead, c * y - s * x - abeam
