"""The units in which a policy computes: on a scenario in a vehicle's scale, units that make it look like the paper's.

A policy's gains carry units, such as newtons per metre. Instead of scaled gains, the policy gets
other units: lengths over L and speeds over V of ``scenario.scale``, times over L / V. The unit of force is full thrust
over the paper's 3,000 N, so that a policy has as much force as it was made with, and saturates where it did. A hull
with another drag or mass than the paper's then moves differently, but the policy does not dare more or less.
Torque follows: force times length. Actions are shares of full force and need no conversion. So a vehicle that
differs from the paper's only in size gets the paper's runs, bit for bit where its scale is a power of two.
"""

from typing import NamedTuple

import numpy as np

from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.dimensions import NUMBER, Dimension, converted
from uuv_marl.scenario.scale import Scale
from uuv_marl.types import Float32

_DIMENSIONS = {
    "m": Dimension(1, 0, 0), "m/s": Dimension(1, -1, 0), "rad/s": Dimension(0, -1, 0), "s": Dimension(0, 1, 0),
    "1": NUMBER,
}  # fmt: skip
"""Dimensions by the unit of a percept's field."""


def in_own_units(scenario: Scenario) -> Scenario:
    """A scenario in the units of its scale, which is 1 then: the paper's numbers, and the vehicle's in these units."""
    if scenario.scale == Scale():
        return scenario
    return converted(scenario, scenario.scale.units.inverse).model_copy(update={"scale": Scale()})


class Reader(NamedTuple):
    """Takes percepts of a scaled scenario into the units of its scale."""

    factors: Float32
    """One over the unit of each entry, shape (entry,)."""
    time: float
    """The unit of time [s]."""

    @staticmethod
    def of(scenario: Scenario) -> "Reader | None":
        """That of a scenario; None where its scale is 1."""
        if scenario.scale == Scale():
            return None
        units, table = scenario.scale.units, PerceptLayout.of(scenario).table
        factors = [1.0 / units.of(_DIMENSIONS[field.kind.unit]) for field in table]
        return Reader(np.repeat(np.array(factors, np.float32), [field.size for field in table]), units.time)

    def read(self, percept: Percept) -> Percept:
        """A percept in the policy's units; one that has other entries comes back as it is, to be refused."""
        if percept.flat.shape[-1] != len(self.factors):
            return percept
        clock = percept.clock and percept.clock._replace(time_s=percept.clock.time_s / self.time)
        return Percept(percept.flat * self.factors, percept.layout, clock, percept.alive)
