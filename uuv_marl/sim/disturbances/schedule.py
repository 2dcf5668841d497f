"""Schedule of sonar readings: when each array takes one, and when a policy receives it.

A reading holds the detections of one array at the end of one control step. It is available from
``latency.processing_s`` after its reception until the array's next one is.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario, sonar_is_ideal
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float64, Int64


class SonarTiming(NamedTuple):
    """Constants of the arrays' schedule and latency; times in control steps."""

    ideal: bool  # whether readings are immediate and without error, so that percepts stay unchanged
    control_step_s: float  # length of a control step [s]
    control_steps: int  # control steps of a decision
    delay: int  # control steps from the reception of a reading until a policy receives it
    control_steps_per_metre: float  # control steps that sound takes per metre; 0: none
    compensated: bool  # whether readings are moved to the present pose
    every: Float64  # control steps between two readings of each array, at least 1, shape (array,)
    first: Int64  # first sub-sector of each array, and their number, shape (array + 1,)
    # First of its sub-sectors among the active ones, and their number, shape (array + 1,); none for passive arrays
    active: Int64


class Reading(NamedTuple):
    """One reading of an array, by all vehicles of a world."""

    w: int  # index of the world
    a: int  # index of the array
    number: int  # number of the reading among the array's
    tick: int  # control step of its reception
    slot: int  # slot of the delay line that stores the reading


def sonar_timing(scenario: Scenario) -> SonarTiming:
    """Constants of the scenario's schedule and latency for the compiled functions."""
    latency, arrays, control_step_s = scenario.latency, scenario.sonar.arrays, scenario.timing.control_step_s
    period_s = {"active": latency.active_period_s, "passive": latency.passive_period_s}
    sub_sectors = [array.sub_sectors for array in arrays]
    active = [array.sub_sectors if array.kind == "active" else 0 for array in arrays]
    return SonarTiming(
        ideal=sonar_is_ideal(scenario),
        control_step_s=control_step_s,
        control_steps=scenario.timing.control_steps_per_decision,
        delay=math.ceil(latency.processing_s / control_step_s - 1e-9),
        control_steps_per_metre=1.0 / (latency.sound_speed_mps * control_step_s) if latency.travel_time else 0.0,
        compensated=latency.compensated,
        every=np.array([max(period_s[array.kind] / control_step_s, 1.0) for array in arrays]),
        first=np.cumsum([0, *sub_sectors]),
        active=np.cumsum([0, *active]),
    )


@compiled
def control_step_of(number: int, every: float) -> int:
    """Control step of a reading, counted from the first one: the nearest to its time."""
    return math.floor(number * every + 0.5)


@compiled
def latest(control_step: int, every: float) -> int:
    """Number of the latest reading up to a control step, -1 for none."""
    if control_step < 0:
        return -1
    number = int((control_step + 0.5) / every) + 1
    while control_step_of(number, every) > control_step:
        number -= 1
    return number


@compiled
def due(control_step: int, every: float, delay: int, control_steps: int) -> int:
    """Number of the reading that an array takes at this control step; -1 for none, or for one that no decision uses.

    ``control_step`` counts from the array's first one; the others are those of ``SonarTiming``.
    """
    number = latest(control_step, every)
    if control_step_of(number, every) != control_step:
        return -1
    decision = (control_step + delay + control_steps - 1) // control_steps * control_steps
    return number if latest(decision - delay, every) == number else -1
