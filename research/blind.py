"""``Blind``: another policy without echoes, which shows the value of its obstacle sonar."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from uuv_marl.baselines import Policy, make_policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike
from uuv_marl.types import Float32

BLIND = "research.blind:Blind,inner="
"""The name of a blind policy, before that of the policy inside."""


class Blind(Policy):
    """A network, or any policy with its decision period and yaw damping, without echoes in its percepts."""

    requirements = PolicyRequirements(yaw_damping_nms=600.0, decision_period_s=0.5, outputs_force=True)

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, inner: str) -> None:
        super().__init__(scenario, num_worlds)
        self._inner = make_policy(inner, scenario, num_worlds)
        masks = [np.full(field.size, not field.name.startswith("echo")) for field in self.layout.table]
        self._mask = np.concatenate(masks).astype(np.float32)

    def reset(self, seed: SeedLike = 0, worlds: Sequence[int] | None = None) -> None:
        """Reset also the inner policy."""
        super().reset(seed, worlds)
        self._inner.reset(seed, worlds)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        masked = dataclasses.replace(percept, flat=percept.flat * self._mask)
        self._inner.active = self.active
        self._inner.update_memory(masked)
        return self._inner.decide(masked)
