"""``Shuffled``: a network whose messages are those of other vehicles, which shows whether their content matters."""

from collections.abc import Sequence

import numpy as np

from research.second import runnable
from uuv_marl.baselines import Policy, make_policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike
from uuv_marl.types import Float32

SHUFFLED = "research.messages.shuffled:Shuffled,inner="
"""The name of such a policy, before that of the network."""


class Shuffled(Policy):
    """A network of ``mappo_broadcast``'s recipe; every vehicle sends the message of the one half a swarm further on."""

    requirements = PolicyRequirements(
        channels=("compass", "odometry", "messages"), message_entries=5, message_vectors=2, yaw_damping_nms=600.0,
        decision_period_s=0.5, outputs_force=True,
    )  # fmt: skip

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, inner: str) -> None:
        super().__init__(scenario, num_worlds)
        self._inner = make_policy(runnable(inner), scenario, num_worlds)

    def reset(self, seed: SeedLike = 0, worlds: Sequence[int] | None = None) -> None:
        """Reset also the inner policy."""
        super().reset(seed, worlds)
        self._inner.reset(seed, worlds)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 7)."""
        self._inner.active = self.active
        self._inner.update_memory(percept)
        action = self._inner.decide(percept).copy()
        action[..., 2:] = np.roll(action[..., 2:], action.shape[1] // 2, axis=1)
        return action
