"""``Controller``: base class of hand-made policies with gains."""

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from uuv_marl.baselines.policy import Policy, tuned
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.steering import velocity_gain
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Float32


class NoGains(NamedTuple):
    """Table of a policy without gains."""


class Controller(Policy):
    """A policy with ``gains``, by default those tuned for a task. A subclass fills an array of actions in ``_write``.

    ``tuned_for`` is the task, such as ``two_swarms`` where gains were tuned for it, or "" for the usual gains.
    """

    requirements = PolicyRequirements(yaw_damping_nms=600.0, outputs_force=True)
    Gains: ClassVar[type[Any]] = NoGains
    """Table of the gains."""
    tuned_as: ClassVar[str] = ""
    """Name of the tuned gains; empty for the table's defaults."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, tuned_for: str = "", gains: Any = None) -> None:
        super().__init__(scenario, num_worlds)
        self.gains = gains or self.Gains(**self.tuned_numbers(tuned_for))
        self._centres, self._gain = scenario.sonar.echo_reports == "centre", velocity_gain(scenario)

    def tuned_numbers(self, tuned_for: str) -> Mapping[str, float]:
        """Tuned numbers by name; none if nothing was tuned. Raises PolicyError if none were tuned for this task."""
        return tuned(self.tuned_as, tuned_for) if self.tuned_as or tuned_for else {}

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2), and the messages of a policy that sends some."""
        action: Float32 = np.zeros((*percept.flat.shape[:2], 2 + self.requirements.message_entries), np.float32)
        self._write(percept, action)
        return action

    def _write(self, percept: Percept, action: Float32) -> None:
        raise NotImplementedError
