"""``Controller``: base class of hand-made policies with gains."""

from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines.policy import Policy, tuned
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.steering import velocity_gain
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Float32


class Controller(Policy):
    """A policy with ``gains``, by default the tuned ones. A subclass fills an array of actions in ``_write``."""

    requirements = PolicyRequirements(yaw_damping_nms=600.0, outputs_force=True)
    Gains: ClassVar[type[Any]]
    """Table of the gains."""
    tuned_as: ClassVar[str] = ""
    """Name of the tuned gains; empty for the table's defaults."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, gains: Any = None) -> None:
        super().__init__(scenario, num_worlds)
        self.gains = gains or self.Gains(**(tuned(self.tuned_as) if self.tuned_as else {}))
        self._centres, self._gain = scenario.sonar.echo_reports == "centre", velocity_gain(scenario)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        action: Float32 = np.empty((*percept.flat.shape[:2], 2), np.float32)
        self._write(percept, action)
        return action

    def _write(self, percept: Percept, action: Float32) -> None:
        raise NotImplementedError
