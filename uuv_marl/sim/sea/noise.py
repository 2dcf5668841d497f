"""What a reading gets wrong: vehicles and echoes missed, put elsewhere, imagined; arrays silent for a while, or dead.

Every draw is made for one reading, but for what lasts: a vehicle's factor on passive ranges, and bursts of silence.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.exponential import exp
from uuv_marl.sim.random import log, normal, normals, uniform, uniforms
from uuv_marl.sim.sea.actuation import ARRAY, Actuation, Hull, acts
from uuv_marl.sim.sea.purposes import BEARING_RANGE, DETECTION, FACTOR, FALSE_ECHO, FALSE_PLACE, SILENCE
from uuv_marl.sim.sea.readings import NOBODY, PHANTOM, Listening, Reading, Readings
from uuv_marl.sim.sonar import suite
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.views import SeaFields

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]
UInt64 = NDArray[np.uint64]

_NEVER = 2**40
"""A reading that no episode reaches."""


class Noise(NamedTuple):
    """Numbers of what a scenario's sonar gets wrong."""

    bearing: float
    """Standard deviation of a bearing [rad]."""
    range_m: float
    """Standard deviation of a range [m] ..."""
    range_share: float
    """... plus this share of it."""
    factor_log_sd: float
    """Standard deviation of the logarithm of a vehicle's factor on passive ranges."""
    passive_ranges: bool
    """Whether passive arrays measure ranges."""
    nominal_range: float
    """Where a vehicle is put that is heard by its bearing alone [m]."""
    half_range: Float64
    """Range at which an array detects every second time [m], 0: always detects; shape (array,)."""
    decades: Float64
    """Standard deviation of the signal excess, as natural logarithm of the range that makes up for it; (array,)."""
    silence: float
    """Probability that an array falls silent at a reading ..."""
    silent_readings: int
    """... for so many."""
    false_echo: float
    """Probability of an echo of nothing, per sub-sector and reading."""
    range: Float64
    """Of each array [m], shape (array,)."""
    lower: Float64
    """Lower edge of each sub-sector, a unit vector, shape (sector, 2)."""
    width: Float64
    """Of the sub-sectors of each array [rad], shape (array,)."""


@described
class Ears(NamedTuple):
    """What lasts."""

    factor: Annotated[Float64, "world vehicle", "On ranges that its passive arrays take."]
    silent: Annotated[
        Int64, "world vehicle array", "Reading at which its latest silence began, or the next will.", Bounds(0)
    ]


def noise(scenario: Scenario) -> Noise:
    """The scenario's errors as numbers for the compiled functions."""
    given, arrays = scenario.noise, scenario.sonar.arrays
    half_range = {"active": given.active_r50_m, "passive": given.passive_r50_m}
    decibels = {"active": 40.0, "passive": 20.0}  # per factor 10 of range: sound spreads there and back, or one way
    return Noise(
        bearing=math.radians(given.bearing_deg),
        range_m=given.range_m,
        range_share=given.range_share,
        factor_log_sd=given.passive_range_log_sd,
        passive_ranges=given.passive_ranges,
        nominal_range=given.nominal_range_m,
        half_range=np.array([half_range[array.kind] for array in arrays]),
        decades=np.array([given.detection_sd_db * log(10.0) / decibels[array.kind] for array in arrays]),
        silence=given.silence_probability,
        silent_readings=given.silence_readings,
        false_echo=given.false_echo_probability,
        range=np.array([array.range_m for array in arrays]),
        lower=suite(scenario).lower,
        width=np.array([math.radians(array.aperture_deg / array.sub_sectors) for array in arrays]),
    )


def draw_ears(w: int, key: np.uint64, noise: Noise, ears: Ears) -> None:
    """Lasting factors of world w's new episode, from its key."""
    for i in range(ears.factor.shape[1]):
        ears.factor[w, i] = exp(noise.factor_log_sd * normal(key, FACTOR, 0, i, 0))


@compiled_inner
def begin_ears(w: int, key: np.uint64, noise: Noise, ears: Ears) -> None:
    """When the arrays of world w, which begin to read, fall silent first."""
    for i in range(ears.silent.shape[1]):
        for a in range(ears.silent.shape[2]):
            ears.silent[w, i, a] = gap(uniform(key, SILENCE, 0, i, a), noise.silence)


@compiled
def gap(chance: float, probability: float) -> int:
    """How often something of this probability doesn't happen before it does; ``chance`` is uniform in [0, 1)."""
    if 1.0 - probability == 1.0:
        return _NEVER
    if probability >= 1.0:
        return 0
    return int(min(log(1.0 - chance) / log(1.0 - probability), float(_NEVER)))


@compiled_inner
def spoil(
    at: Reading, key: np.uint64, listening: Listening, noise: Noise, ears: Ears, actuation: Actuation, hull: Hull,
    readings: Readings,
) -> None:  # fmt: skip
    """What an array of every vehicle gets wrong in a reading.

    Args:
        at: the reading.
        key: of the world's episode.
        listening: the scenario's arrays.
        noise: the scenario's errors.
        ears: what lasts; is written.
        actuation: the scenario's faults.
        hull: when they act.
        readings: the line, in which the reading is true, and becomes what is heard.
    """
    if noise.half_range[at.a] > 0.0:
        miss(at, key, listening, noise, readings)
    blur_vehicles(at, key, listening, noise, ears, readings)
    blur_echoes(at, key, listening, noise, readings)
    if noise.false_echo > 0.0:
        imagine(at, key, listening, noise, readings)
    if noise.silence > 0.0:
        for i in range(ears.silent.shape[1]):
            if is_silent(at, i, key, noise, ears):
                hush(at, i, listening, readings)
    for f in range(actuation.kind.shape[0]):
        if actuation.kind[f] == ARRAY and actuation.array[f] == at.a:
            for i in range(ears.silent.shape[1]):
                if acts(at.w, i, f, at.tick, hull):
                    hush(at, i, listening, readings)


@compiled_inner
def miss(at: Reading, key: np.uint64, listening: Listening, noise: Noise, readings: Readings) -> None:
    """What is too faint is not heard: signal excess 20 log10(r50 / r), or 40 log10 there and back, plus noise <= 0.

    Args:
        at: the reading.
        key: of the world's episode.
        listening: the scenario's arrays.
        noise: the scenario's errors.
        readings: is written.
    """
    w, a, slot = at.w, at.a, at.slot
    first, e_first, echoes = listening.first[a], listening.active[a], listening.active[a + 1] > listening.active[a]
    for i in range(readings.whom.shape[2]):
        for k in range(first, listening.first[a + 1]):
            e = e_first + k - first
            loud = echoes and readings.surface[w, slot, i, e] >= 0.0
            if readings.whom[w, slot, i, k] == NOBODY and not loud:
                continue
            vehicle, obstacle = normals(key, DETECTION, at.tick, i, k)
            if length(readings.where, w, slot, i, k) >= noise.half_range[a] * exp(noise.decades[a] * vehicle):
                readings.whom[w, slot, i, k] = NOBODY
            if loud and readings.surface[w, slot, i, e] >= noise.half_range[a] * exp(noise.decades[a] * obstacle):
                readings.surface[w, slot, i, e] = -1.0


@compiled_inner
def blur_vehicles(
    at: Reading, key: np.uint64, listening: Listening, noise: Noise, ears: Ears, readings: Readings
) -> None:
    """Vehicles are heard at a wrong bearing and range, or by their bearing alone; arguments as for ``spoil``."""
    w, a, slot = at.w, at.a, at.slot
    passive = listening.active[a] == listening.active[a + 1]
    blurred = noise.bearing > 0.0 or noise.range_m > 0.0 or noise.range_share > 0.0
    measured = noise.passive_ranges or not passive
    if not blurred and measured and (noise.factor_log_sd == 0.0 or not passive):
        return
    for i in range(readings.whom.shape[2]):
        factor = ears.factor[w, i] if passive else 1.0
        for k in range(listening.first[a], listening.first[a + 1]):
            if readings.whom[w, slot, i, k] == NOBODY:
                continue
            side, off = normals(key, BEARING_RANGE, at.tick, i, k) if blurred else (0.0, 0.0)
            away = length(readings.where, w, slot, i, k)
            heard = max(factor * away + (noise.range_m + noise.range_share * away) * off, 0.0)
            if not measured:
                heard = noise.nominal_range
            put(readings.where, w, slot, i, k, noise.bearing * side, heard / away if away > 0.0 else 1.0)


@compiled_inner
def blur_echoes(at: Reading, key: np.uint64, listening: Listening, noise: Noise, readings: Readings) -> None:
    """Echoes are heard at a wrong bearing and range; their position moves as far as the range does.

    Args:
        at: the reading.
        key: of the world's episode.
        listening: the scenario's arrays.
        noise: the scenario's errors.
        readings: is written.
    """
    w, a, slot = at.w, at.a, at.slot
    if noise.bearing == 0.0 and noise.range_m == 0.0 and noise.range_share == 0.0:
        return
    for i in range(readings.whom.shape[2]):
        for e in range(listening.active[a], listening.active[a + 1]):
            if readings.surface[w, slot, i, e] < 0.0:
                continue
            side, off = normals(key, BEARING_RANGE, at.tick, i, readings.whom.shape[3] + e)
            away = np.float64(readings.surface[w, slot, i, e])
            heard = max(away + (noise.range_m + noise.range_share * away) * off, 0.0)
            far = length(readings.point, w, slot, i, e)
            share = max(far + heard - away, 0.0) / far if far > 0.0 else 1.0
            readings.surface[w, slot, i, e] = heard
            put(readings.point, w, slot, i, e, noise.bearing * side, share)


@compiled_inner
def length(points: NDArray[np.float32], w: int, slot: int, i: int, k: int) -> float:
    """Distance of a point of a reading [m].

    Args:
        points: shape (world, slot, vehicle, sub-sector, 2).
        w: the world.
        slot: where the reading is kept.
        i: the vehicle.
        k: the sub-sector.
    """
    x, y = np.float64(points[w, slot, i, k, 0]), np.float64(points[w, slot, i, k, 1])
    return math.sqrt(x * x + y * y)


@compiled_inner
def put(points: NDArray[np.float32], w: int, slot: int, i: int, k: int, turn: float, share: float) -> None:
    """Turn a point of a reading about the vehicle, clockwise [rad], and change its distance to this share of it.

    The other arguments are those of ``length``.
    """
    x, y = np.float64(points[w, slot, i, k, 0]), np.float64(points[w, slot, i, k, 1])
    c, s = cos_sin(turn)
    points[w, slot, i, k, 0], points[w, slot, i, k, 1] = share * (c * x - s * y), share * (s * x + c * y)


@compiled_inner
def imagine(at: Reading, key: np.uint64, listening: Listening, noise: Noise, readings: Readings) -> None:
    """Echoes of nothing, anywhere in a sub-sector within the array's range, unless something nearer is heard there.

    An active array takes one for an obstacle's surface, a passive one for a vehicle.

    Args:
        at: the reading.
        key: of the world's episode.
        listening: the scenario's arrays.
        noise: the scenario's errors.
        readings: is written.
    """
    w, a, slot = at.w, at.a, at.slot
    first, end = listening.first[a], listening.first[a + 1]
    passive = listening.active[a] == listening.active[a + 1]
    for i in range(readings.whom.shape[2]):
        # From one to the next, so that those who hear nothing false cost one draw.
        k = first + gap(uniform(key, FALSE_ECHO, at.tick, i, first), noise.false_echo)
        while k < end:
            far, side = uniforms(key, FALSE_PLACE, at.tick, i, k)
            away = noise.range[a] * far if noise.passive_ranges or not passive else noise.nominal_range
            c, s = cos_sin(noise.width[a] * (1.0 - side))
            x = away * (c * noise.lower[k, 0] - s * noise.lower[k, 1])
            y = away * (s * noise.lower[k, 0] + c * noise.lower[k, 1])
            e = listening.active[a] + k - first
            if passive and (readings.whom[w, slot, i, k] == NOBODY or length(readings.where, w, slot, i, k) > away):
                readings.whom[w, slot, i, k] = PHANTOM
                readings.where[w, slot, i, k, 0], readings.where[w, slot, i, k, 1] = x, y
            elif not passive and not 0.0 <= readings.surface[w, slot, i, e] <= away:
                readings.surface[w, slot, i, e] = away
                readings.point[w, slot, i, e, 0], readings.point[w, slot, i, e, 1] = x, y
            k += 1 + gap(uniform(key, FALSE_ECHO, at.tick, i, k + 1), noise.false_echo)


@compiled_inner
def is_silent(at: Reading, i: int, key: np.uint64, noise: Noise, ears: Ears) -> bool:
    """Whether an array of vehicle i is silent at a reading; a silence is over before the next can begin.

    Args:
        at: the reading.
        i: the vehicle.
        key: of the world's episode.
        noise: the scenario's errors.
        ears: is written where a silence is over.
    """
    while at.number - ears.silent[at.w, i, at.a] >= noise.silent_readings:
        end = ears.silent[at.w, i, at.a] + noise.silent_readings
        ears.silent[at.w, i, at.a] = end + gap(uniform(key, SILENCE, end, i, at.a), noise.silence)
    return at.number >= ears.silent[at.w, i, at.a]


@compiled_inner
def hush(at: Reading, i: int, listening: Listening, readings: Readings) -> None:
    """An array of vehicle i has heard nothing."""
    for k in range(listening.first[at.a], listening.first[at.a + 1]):
        readings.whom[at.w, at.slot, i, k] = NOBODY
    for e in range(listening.active[at.a], listening.active[at.a + 1]):
        readings.surface[at.w, at.slot, i, e] = -1.0


@compiled_inner
def tell_ranged(w: int, alive: NDArray[np.bool_], listening: Listening, noise: Noise, more: SeaFields) -> None:
    """Write into the percepts of world w which sub-sectors measure ranges.

    Args:
        w: the world.
        alive: the vehicles that have a percept, shape (world, vehicle).
        listening: the scenario's arrays.
        noise: the scenario's errors.
        more: fields of the sea's channels, which are written.
    """
    if more.ranged.shape[2] == 0:
        return
    for a in range(listening.every.shape[0]):
        passive = listening.active[a] == listening.active[a + 1]
        for i in range(alive.shape[1]):
            for k in range(listening.first[a], listening.first[a + 1]):
                more.ranged[w, i, k] = 1.0 if alive[w, i] and (noise.passive_ranges or not passive) else 0.0
