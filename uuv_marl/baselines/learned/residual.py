"""A residual network: a base controller acts, and the network adds a bounded part to its actions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.actor import bound, in_disc
from uuv_marl.baselines.policy import Policy, part_of, parts_of
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike
from uuv_marl.types import Float32

SHARE = 0.5  # largest part of the full force that a network adds to the base controller's action


class ResidualPolicy(Policy):
    """Actions of a base controller plus those of an inner policy, made for the same scenario and worlds."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, base: Policy, inner: Policy) -> None:
        self.base, self.inner = base, inner
        self.name = inner.name
        self.requirements = base.requirements
        super().__init__(scenario, num_worlds)

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> None:
        """Reset both."""
        super().reset(seed, worlds)
        for each in (self.base, self.inner):
            each.reset(seed, worlds)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        actions: list[Float32] = []
        for each in (self.base, self.inner):
            each.active = self.active
            each.update_memory(percept)
            actions.append(each.decide(percept))
        action: Float32 = (actions[0] + np.float32(SHARE) * actions[1]).astype(np.float32)
        bound(action.reshape(-1, 2), in_disc(self))
        self.clamps[...] = self.base.clamps
        return action

    def record_action(self, action: Float32) -> None:
        """Report the actions to both."""
        super().record_action(action)
        for each in (self.base, self.inner):
            each.record_action(action)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Snapshots of both."""
        return super().snapshot() | parts_of(base=self.base, inner=self.inner)

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Restore both."""
        super().restore(snapshot)
        self.base.restore(part_of(snapshot, "base"))
        self.inner.restore(part_of(snapshot, "inner"))
