"""A user's own reward. The rewards that ship are the tasks' own: ``Follow`` in ``uuv_marl/tasks/follow.py`` is one."""

from collections.abc import Callable

import numpy as np

from uuv_marl.errors import RewardError
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float64

RewardFunction = Callable[[Swarm], Float64]
"""A user's own reward: from the swarm after a step to an array (world, vehicle)."""

MOST_REWARD = 1e9
"""Larger sizes of a reward overflow where learners square them in single precision."""


def own_reward(function: RewardFunction, swarm: Swarm, present: Bool) -> Float64:
    """What a user's own reward gives, shape (world, vehicle); zero for vehicles that are not present.

    Args:
        function: the reward.
        swarm: after a step.
        present: vehicles that were there before the step, shape (world, vehicle).

    Raises:
        RewardError: the function gives an array of another shape, or numbers that are not finite, or huge.
    """
    reward = np.asarray(function(swarm), np.float64)
    if reward.shape != present.shape:
        raise RewardError(f"the reward function must give an array {present.shape}, got {reward.shape}")
    if not (np.abs(reward[present]) <= MOST_REWARD).all():
        raise RewardError(
            f"the reward function must give finite numbers, {MOST_REWARD:g} at most; distances are infinite where "
            "nobody is near (facts.spacing of a lone vehicle) or nothing is there (facts.clearance without obstacles)"
        )
    return np.where(present, reward, 0.0)
