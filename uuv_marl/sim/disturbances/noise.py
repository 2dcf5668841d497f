"""What a reading gets wrong: vehicles and echoes missed, put elsewhere, imagined; arrays silent for a while, or dead.

Every draw is made for one reading, but for what lasts: a vehicle's factor on passive ranges, and bursts of silence.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.disturbances.actuation import ARRAY, Actuation, Hull, acts
from uuv_marl.sim.disturbances.purposes import BEARING_RANGE, DETECTION, FACTOR, FALSE_ECHO, FALSE_PLACE, SILENCE
from uuv_marl.sim.disturbances.readings import (
    FALSE_DETECTION,
    NO_DETECTION,
    OBSTACLE,
    PLACE,
    SHIFT,
    Detections,
    Readings,
    clear_array,
)
from uuv_marl.sim.disturbances.schedule import Reading, SonarTiming
from uuv_marl.sim.exponential import exp
from uuv_marl.sim.random import log, normal, normals, uniform, uniforms
from uuv_marl.sim.sonar import suite
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float64, Int64

_NEVER = 2**40
"""A reading that no episode reaches."""


class NoiseModel(NamedTuple):
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
    """Distance at which a vehicle is put that is heard by its bearing alone [m]."""
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
    """Range of each array [m], shape (array,)."""
    lower: Float64
    """Lower edge of each sub-sector, a unit vector, shape (sector, 2)."""
    width: Float64
    """Width of the sub-sectors of each array [rad], shape (array,)."""


@described
class SensorErrors(NamedTuple):
    """Errors that last longer than a reading."""

    factor: Annotated[Float64, "world vehicle", "On ranges that its passive arrays take."]
    silent: Annotated[
        Int64, "world vehicle array", "Reading at which its latest silence began, or the next will.", Bounds(0)
    ]


def noise(scenario: Scenario) -> NoiseModel:
    """The scenario's errors as numbers for the compiled functions."""
    settings, arrays = scenario.noise, scenario.sonar.arrays
    half_range = {"active": settings.active_r50_m, "passive": settings.passive_r50_m}
    decibels = {"active": 40.0, "passive": 20.0}  # per factor 10 of range: sound spreads there and back, or one way
    return NoiseModel(
        bearing=math.radians(settings.bearing_deg),
        range_m=settings.range_m,
        range_share=settings.range_share,
        factor_log_sd=settings.passive_range_log_sd,
        passive_ranges=settings.passive_ranges,
        nominal_range=settings.nominal_range_m,
        half_range=np.array([half_range[array.kind] for array in arrays]),
        decades=np.array([settings.detection_sd_db * log(10.0) / decibels[array.kind] for array in arrays]),
        silence=settings.silence_probability,
        silent_readings=settings.silence_readings,
        false_echo=settings.false_echo_probability,
        range=np.array([array.range_m for array in arrays]),
        lower=suite(scenario).lower,
        width=np.array([math.radians(array.aperture_deg / array.sub_sectors) for array in arrays]),
    )


def sample_sensor_errors(w: int, key: np.uint64, noise: NoiseModel, sensor_errors: SensorErrors) -> None:
    """Lasting factors of world w's new episode, from its key."""
    for i in range(sensor_errors.factor.shape[1]):
        sensor_errors.factor[w, i] = exp(noise.factor_log_sd * normal(key, FACTOR, 0, i, 0))


@compiled_inner
def schedule_outages(w: int, key: np.uint64, noise: NoiseModel, sensor_errors: SensorErrors) -> None:
    """When the arrays of world w, which begin to read, fall silent first."""
    for i in range(sensor_errors.silent.shape[1]):
        for a in range(sensor_errors.silent.shape[2]):
            sensor_errors.silent[w, i, a] = gap(uniform(key, SILENCE, 0, i, a), noise.silence)


@compiled_inline
def gap(chance: float, probability: float) -> int:
    """How often something of this probability doesn't happen before it does; ``chance`` is uniform in [0, 1)."""
    if 1.0 - probability == 1.0:
        return _NEVER
    if probability >= 1.0:
        return 0
    return int(min(log(1.0 - chance) / log(1.0 - probability), float(_NEVER)))


@compiled_inner
def add_errors(
    at: Reading,
    num: int,
    key: np.uint64,
    passive: bool,
    noise: NoiseModel,
    sensor_errors: SensorErrors,
    detections: Detections,
) -> None:
    """What an array of every vehicle misses, and puts elsewhere. ``hits`` are true before, and have errors after."""
    if noise.half_range[at.a] > 0.0:
        drop_missed(at, num, key, noise, detections)
    measured = noise.passive_ranges or not passive
    blurred = noise.bearing > 0.0 or noise.range_m > 0.0 or noise.range_share > 0.0
    if blurred or not measured or (passive and noise.factor_log_sd > 0.0):
        sample_perturbations(at, num, key, noise, detections)
        perturb(at, num, measured, passive, noise, sensor_errors, detections)


@compiled_inner
def drop_missed(at: Reading, num: int, key: np.uint64, noise: NoiseModel, detections: Detections) -> None:
    """What is too faint is missed: signal excess 20 log10(r50 / r), or 40 log10 there and back, plus noise <= 0.

    Ranges of those missed become negative.
    """
    w, decades, half_range = at.w, noise.decades[at.a], noise.half_range[at.a]
    for q in range(num):
        excess, _ = normals(key, DETECTION, at.tick, detections.code[w, q] >> SHIFT, detections.code[w, q] & PLACE)
        detections.first[w, q] = half_range * exp(decades * excess)
    for q in range(num):
        if detections.reach[w, q] >= detections.first[w, q]:
            detections.reach[w, q] = -1.0


@compiled_inner
def sample_perturbations(at: Reading, num: int, key: np.uint64, noise: NoiseModel, detections: Detections) -> None:
    """Cosine and sine of every bearing's error, and a standard normal number for its range; arguments as for ``miss``.

    The loop holds nothing else, so that it runs on vector registers.
    """
    w, bearing = at.w, noise.bearing
    for q in range(num):
        side, off = normals(key, BEARING_RANGE, at.tick, detections.code[w, q] >> SHIFT, detections.code[w, q] & PLACE)
        detections.first[w, q], detections.second[w, q] = cos_sin(bearing * side)
        detections.third[w, q] = off


@compiled_inner
def perturb(
    at: Reading,
    num: int,
    measured: bool,
    passive: bool,
    noise: NoiseModel,
    sensor_errors: SensorErrors,
    detections: Detections,
) -> None:
    """Put hits at a wrong bearing and range; an echo's position moves as far as its range does.

    ``measured``: whether the array measures ranges. The hits have draws of ``draw_blur``.
    """
    w = at.w
    for q in range(num):
        away = detections.reach[w, q]
        if away < 0.0:
            continue
        factor = sensor_errors.factor[w, detections.code[w, q] >> SHIFT] if passive else 1.0
        measured_range = max(factor * away + (noise.range_m + noise.range_share * away) * detections.third[w, q], 0.0)
        if not measured:
            measured_range = noise.nominal_range
        x, y, c, s = detections.x[w, q], detections.y[w, q], detections.first[w, q], detections.second[w, q]
        far = math.sqrt(x * x + y * y)
        share = max(far + (measured_range - away), 0.0) / far if far > 0.0 else 1.0
        detections.x[w, q], detections.y[w, q], detections.reach[w, q] = (
            share * (c * x - s * y),
            share * (s * x + c * y),
            measured_range,
        )


@compiled_inner
def apply_outages(
    at: Reading, key: np.uint64, sonar_timing: SonarTiming, noise: NoiseModel, sensor_errors: SensorErrors, actuation: Actuation, hull: Hull,
    detections: Detections, readings: Readings,
) -> None:  # fmt: skip
    """Echoes of nothing; arrays that are silent for a while; dead arrays."""
    if noise.false_echo > 0.0:
        add_false_echoes(at, key, sonar_timing, noise, detections, readings)
    if noise.silence > 0.0:
        for i in range(sensor_errors.silent.shape[1]):
            if is_silent(at, i, key, noise, sensor_errors):
                clear_array(at, i, sonar_timing, readings)
    for f in range(actuation.kind.shape[0]):
        if actuation.kind[f] == ARRAY and actuation.array[f] == at.a:
            for i in range(sensor_errors.silent.shape[1]):
                if acts(at.w, i, f, at.tick, hull):
                    clear_array(at, i, sonar_timing, readings)


@compiled_inner
def add_false_echoes(
    at: Reading,
    key: np.uint64,
    sonar_timing: SonarTiming,
    noise: NoiseModel,
    detections: Detections,
    readings: Readings,
) -> None:
    """Echoes of nothing, anywhere in a sub-sector within the array's range, unless something nearer is heard there.

    An active array takes one for an obstacle's surface, a passive one for a vehicle.
    """
    w, a, slot = at.w, at.a, at.slot
    first, end = sonar_timing.first[a], sonar_timing.first[a + 1]
    passive = sonar_timing.active[a] == sonar_timing.active[a + 1]
    # Where an active array's echoes lie, beyond its own sub-sectors.
    beyond = (
        0 if passive else readings.detected_index.shape[3] - sonar_timing.active[-1] + sonar_timing.active[a] - first
    )
    for i in range(readings.detected_index.shape[2]):
        detections.code[w, i] = first + gap(uniform(key, FALSE_ECHO, at.tick, i, first), noise.false_echo)
    for i in range(readings.detected_index.shape[2]):
        k = detections.code[w, i]
        while k < end:  # from one to the next, so that those who hear nothing false cost one draw
            far, side = uniforms(key, FALSE_PLACE, at.tick, i, k)
            away = noise.range[a] * far if noise.passive_ranges or not passive else noise.nominal_range
            place = k + beyond
            if (
                readings.detected_index[w, slot, i, place] == NO_DETECTION
                or np.float32(away) < readings.reach[w, slot, i, place]
            ):
                c, s = cos_sin(noise.width[a] * (1.0 - side))
                readings.detected_index[w, slot, i, place] = FALSE_DETECTION if passive else OBSTACLE
                readings.reach[w, slot, i, place] = away
                readings.position[w, slot, i, place, 0] = away * (c * noise.lower[k, 0] - s * noise.lower[k, 1])
                readings.position[w, slot, i, place, 1] = away * (s * noise.lower[k, 0] + c * noise.lower[k, 1])
            k += 1 + gap(uniform(key, FALSE_ECHO, at.tick, i, k + 1), noise.false_echo)


@compiled_inner
def is_silent(at: Reading, i: int, key: np.uint64, noise: NoiseModel, sensor_errors: SensorErrors) -> bool:
    """Whether an array of vehicle i is silent at a reading; a silence is over before the next can begin.

    ``ears`` is written where a silence is over.
    """
    while at.number - sensor_errors.silent[at.w, i, at.a] >= noise.silent_readings:
        end = sensor_errors.silent[at.w, i, at.a] + noise.silent_readings
        sensor_errors.silent[at.w, i, at.a] = end + gap(uniform(key, SILENCE, end, i, at.a), noise.silence)
    return at.number >= sensor_errors.silent[at.w, i, at.a]


@compiled_inner
def write_ranged(w: int, alive: Bool, sonar_timing: SonarTiming, noise: NoiseModel, more: DisturbanceFields) -> None:
    """Write into the percepts of world w which sub-sectors measure ranges."""
    if more.ranged.shape[2] == 0:
        return
    for a in range(sonar_timing.every.shape[0]):
        passive = sonar_timing.active[a] == sonar_timing.active[a + 1]
        for i in range(alive.shape[1]):
            for k in range(sonar_timing.first[a], sonar_timing.first[a + 1]):
                more.ranged[w, i, k] = 1.0 if alive[w, i] and (noise.passive_ranges or not passive) else 0.0
