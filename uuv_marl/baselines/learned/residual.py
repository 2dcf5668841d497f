"""A residual network: a base controller acts, and the network adds a bounded part to its actions."""

import numpy as np

from uuv_marl.baselines.learned.actor import bound, in_disc
from uuv_marl.baselines.policy import Policy
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Float32

SHARE = 0.5  # largest part of the full force that a network adds to the base controller's action


class ResidualPolicy(Policy):
    """Actions of a base controller plus those of an inner policy, made for the same scenario and worlds."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, base: Policy, inner: Policy) -> None:
        self.parts = {"base": base, "inner": inner}
        self.name = inner.name
        self.requirements = base.requirements
        super().__init__(scenario, num_worlds)

    def decide(self, percept: Percept) -> Float32:
        """Actions, and the network's messages, shape (world, vehicle, ``scenario.action_size``)."""
        base, action = (self.decide_part(name, percept) for name in self.parts)
        action[:, :, :2] = base + np.float32(SHARE) * action[:, :, :2]
        bound(action.reshape(-1, action.shape[2]), in_disc(self))
        self.clamps[...] = self.parts["base"].clamps
        return action
