"""Sonar errors: missed, displaced and false detections, and outages of arrays.

All random numbers are drawn per reading, except a vehicle's lasting factor on passive ranges and the outages' starts.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields
from uuv_marl.scenario import Scenario
from uuv_marl.sim import random
from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.disturbances.actuation import ARRAY, Actuation, Hull, acts
from uuv_marl.sim.disturbances.readings import (
    FALSE_DETECTION,
    NO_DETECTION,
    OBSTACLE,
    Detections,
    Readings,
    clear_array,
)
from uuv_marl.sim.disturbances.schedule import Reading, SonarTiming
from uuv_marl.sim.exponential import exp
from uuv_marl.sim.sonar import suite
from uuv_marl.sim.tables import Bounds, described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float64, Int64

_NEVER = 2**40
"""Number of a reading beyond every episode."""


class NoiseModel(NamedTuple):
    """Constants of a scenario's sonar errors."""

    bearing: float  # standard deviation of a bearing [rad]
    range_m: float  # standard deviation of a range [m]
    range_share: float  # ... plus this share of it
    factor_log_sd: float  # standard deviation of the logarithm of the factor on passive ranges
    passive_ranges: bool  # whether passive arrays measure ranges
    nominal_range: float  # distance reported where only a bearing is measured [m]
    half_range: Float64  # range at which an array detects with probability 1/2 [m], 0: always detects; shape (array,)
    # Standard deviation of the signal excess, as natural logarithm of the equivalent range, shape (array,)
    decades: Float64
    silence: float  # probability that an outage of an array begins at a reading
    silent_readings: int  # ... and how many readings it lasts
    false_echo: float  # probability of a false detection, per sub-sector and reading
    range: Float64  # range of each array [m], shape (array,)
    lower: Float64  # lower edge of each sub-sector, a unit vector, shape (sector, 2)
    width: Float64  # width of the sub-sectors of each array [rad], shape (array,)


@described
class SensorErrors(NamedTuple):
    """Errors that last longer than a reading."""

    factor: Annotated[Float64, "world vehicle", "Factor on the ranges that its passive arrays measure."]
    silent: Annotated[
        Int64, "world vehicle array", "Reading at which its latest outage began or the next will begin.", Bounds(0)
    ]


def noise_model(scenario: Scenario) -> NoiseModel:
    """Constants of the scenario's sonar errors for the compiled functions."""
    settings, arrays = scenario.noise, scenario.sonar.arrays
    half_range = {"active": settings.active_r50_m, "passive": settings.passive_r50_m}
    decibels = {"active": 40.0, "passive": 20.0}  # per factor 10 of range, two-way or one-way
    return NoiseModel(
        bearing=math.radians(settings.bearing_deg),
        range_m=settings.range_m,
        range_share=settings.range_share,
        factor_log_sd=settings.passive_range_log_sd,
        passive_ranges=settings.passive_ranges,
        nominal_range=settings.nominal_range_m,
        half_range=np.array([half_range[array.kind] for array in arrays]),
        decades=np.array([settings.detection_sd_db * random.log(10.0) / decibels[array.kind] for array in arrays]),
        silence=settings.silence_probability,
        silent_readings=settings.silence_readings,
        false_echo=settings.false_echo_probability,
        range=np.array([array.range_m for array in arrays]),
        lower=suite(scenario).lower,
        width=np.array([math.radians(array.aperture_deg / array.sub_sectors) for array in arrays]),
    )


def sample_sensor_errors(w: int, key: np.uint64, noise: NoiseModel, errors: SensorErrors) -> None:
    """Sample the lasting factors of world w's new episode from its key."""
    for i in range(errors.factor.shape[1]):
        errors.factor[w, i] = exp(noise.factor_log_sd * random.normal(key, random.FACTOR, 0, i, 0))


@compiled_inner
def schedule_outages(w: int, key: np.uint64, noise: NoiseModel, errors: SensorErrors) -> None:
    """Sample the first outage of each array of world w."""
    for i in range(errors.silent.shape[1]):
        for a in range(errors.silent.shape[2]):
            errors.silent[w, i, a] = gap(random.uniform(key, random.SILENCE, 0, i, a), noise.silence)


@compiled_inline
def gap(chance: float, probability: float) -> int:
    """Geometric variate: failures before the first success; ``chance`` is uniform in [0, 1)."""
    if 1.0 - probability == 1.0:
        return _NEVER
    if probability >= 1.0:
        return 0
    return int(min(random.log(1.0 - chance) / random.log(1.0 - probability), float(_NEVER)))


@compiled_inner
def add_errors(
    at: Reading, num: int, key: np.uint64, passive: bool, noise: NoiseModel, errors: SensorErrors,
    detections: Detections,
) -> None:  # fmt: skip
    """Add missed detections and errors of bearing and range to the true ``detections`` of an array."""
    if noise.half_range[at.a] > 0.0:
        drop_missed(at, num, key, noise, detections)
    measured = noise.passive_ranges or not passive
    blurred = noise.bearing > 0.0 or noise.range_m > 0.0 or noise.range_share > 0.0
    if blurred or not measured or (passive and noise.factor_log_sd > 0.0):
        sample_perturbations(at, num, key, noise, detections)
        perturb(at, num, measured, passive, noise, errors, detections)


@compiled_inner
def drop_missed(at: Reading, num: int, key: np.uint64, noise: NoiseModel, detections: Detections) -> None:
    """Miss what is too faint: signal excess 20 log10(r50 / r), two-way 40 log10(r50 / r), plus noise <= 0.

    The range of a missed detection becomes negative.
    """
    w, decades, half_range = at.w, noise.decades[at.a], noise.half_range[at.a]
    for q in range(num):
        excess, _ = random.normals(key, random.DETECTION, at.tick, detections.listener[w, q], detections.place[w, q])
        detections.first[w, q] = half_range * exp(decades * excess)
    for q in range(num):
        if detections.reach[w, q] >= detections.first[w, q]:
            detections.reach[w, q] = -1.0


@compiled_inner
def sample_perturbations(at: Reading, num: int, key: np.uint64, noise: NoiseModel, detections: Detections) -> None:
    """Sample cosine and sine of every bearing's error, and a standard normal number for its range.

    The loop does nothing else, so that it is vectorised.
    """
    w, bearing = at.w, noise.bearing
    for q in range(num):
        i, k = detections.listener[w, q], detections.place[w, q]
        side, off = random.normals(key, random.BEARING_RANGE, at.tick, i, k)
        detections.first[w, q], detections.second[w, q] = cos_sin(bearing * side)
        detections.third[w, q] = off


@compiled_inner
def perturb(
    at: Reading, num: int, measured: bool, passive: bool, noise: NoiseModel, errors: SensorErrors,
    detections: Detections,
) -> None:  # fmt: skip
    """Displace detections by the sampled errors; an echo's position moves by the error of its range.

    ``measured``: whether the array measures ranges.
    """
    w = at.w
    for q in range(num):
        away = detections.reach[w, q]
        if away < 0.0:
            continue
        factor = errors.factor[w, detections.listener[w, q]] if passive else 1.0
        measured_range = max(factor * away + (noise.range_m + noise.range_share * away) * detections.third[w, q], 0.0)
        if not measured:
            measured_range = noise.nominal_range
        x, y, c, s = detections.x[w, q], detections.y[w, q], detections.first[w, q], detections.second[w, q]
        far = math.sqrt(x * x + y * y)
        share = max(far + (measured_range - away), 0.0) / far if far > 0.0 else 1.0
        detections.x[w, q], detections.y[w, q] = share * (c * x - s * y), share * (s * x + c * y)
        detections.reach[w, q] = measured_range


@compiled_inner
def apply_outages(
    at: Reading, key: np.uint64, timing: SonarTiming, noise: NoiseModel, errors: SensorErrors, actuation: Actuation,
    hull: Hull, detections: Detections, readings: Readings,
) -> None:  # fmt: skip
    """Apply false detections, outages and array faults to a reading."""
    if noise.false_echo > 0.0:
        add_false_echoes(at, key, timing, noise, detections, readings)
    if noise.silence > 0.0:
        for i in range(errors.silent.shape[1]):
            if is_silent(at, i, key, noise, errors):
                clear_array(at, i, timing, readings)
    for f in range(actuation.kind.shape[0]):
        if actuation.kind[f] == ARRAY and actuation.array[f] == at.a:
            for i in range(errors.silent.shape[1]):
                if acts(at.w, i, f, at.tick, hull):
                    clear_array(at, i, timing, readings)


@compiled_inner
def add_false_echoes(
    at: Reading, key: np.uint64, timing: SonarTiming, noise: NoiseModel, detections: Detections, readings: Readings
) -> None:
    """Add false detections at random places of sub-sectors, unless something nearer is detected there.

    In an active array one is an echo of an obstacle's surface, in a passive one a vehicle.
    """
    w, a, slot = at.w, at.a, at.slot
    first, end = timing.first[a], timing.first[a + 1]
    passive = timing.active[a] == timing.active[a + 1]
    # Offset from an active array's sub-sectors to its echoes.
    beyond = 0 if passive else readings.target_index.shape[3] - timing.active[-1] + timing.active[a] - first
    for i in range(readings.target_index.shape[2]):
        detections.place[w, i] = first + gap(
            random.uniform(key, random.FALSE_ECHO, at.tick, i, first), noise.false_echo
        )
    for i in range(readings.target_index.shape[2]):
        k = detections.place[w, i]
        while k < end:  # from one to the next, so that a vehicle without any costs one draw
            far, side = random.uniforms(key, random.FALSE_PLACE, at.tick, i, k)
            away = noise.range[a] * far if noise.passive_ranges or not passive else noise.nominal_range
            place = k + beyond
            empty = readings.target_index[w, slot, i, place] == NO_DETECTION
            if empty or np.float32(away) < readings.reach[w, slot, i, place]:
                c, s = cos_sin(noise.width[a] * (1.0 - side))
                readings.target_index[w, slot, i, place] = FALSE_DETECTION if passive else OBSTACLE
                readings.reach[w, slot, i, place] = away
                readings.position[w, slot, i, place, 0] = away * (c * noise.lower[k, 0] - s * noise.lower[k, 1])
                readings.position[w, slot, i, place, 1] = away * (s * noise.lower[k, 0] + c * noise.lower[k, 1])
            k += 1 + gap(random.uniform(key, random.FALSE_ECHO, at.tick, i, k + 1), noise.false_echo)


@compiled_inner
def is_silent(at: Reading, i: int, key: np.uint64, noise: NoiseModel, errors: SensorErrors) -> bool:
    """Whether an outage silences an array of vehicle i at a reading; ``errors`` is written when an outage is over."""
    while at.number - errors.silent[at.w, i, at.a] >= noise.silent_readings:
        end = errors.silent[at.w, i, at.a] + noise.silent_readings
        errors.silent[at.w, i, at.a] = end + gap(random.uniform(key, random.SILENCE, end, i, at.a), noise.silence)
    return at.number >= errors.silent[at.w, i, at.a]


@compiled_inner
def write_ranged(w: int, alive: Bool, timing: SonarTiming, noise: NoiseModel, more: DisturbanceFields) -> None:
    """Write into the percepts of world w which sub-sectors measure ranges."""
    if more.ranged.shape[2] == 0:
        return
    for a in range(timing.every.shape[0]):
        passive = timing.active[a] == timing.active[a + 1]
        for i in range(alive.shape[1]):
            for k in range(timing.first[a], timing.first[a + 1]):
                more.ranged[w, i, k] = 1.0 if alive[w, i] and (noise.passive_ranges or not passive) else 0.0
