"""``StepReward``: the reward of a step, from compiled code, from a task's named terms or from a user's function."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.errors import RewardError
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float64

Terms = Mapping[str, NDArray[np.floating[Any]]]
"""Arrays by name."""
RewardFunction = Callable[[Swarm], Float64]
"""A user's own reward: from the swarm after a step to an array (world, vehicle)."""
MOST_REWARD = 1e9
"""Larger rewards overflow where learners square them in single precision."""


class StepReward(NamedTuple):
    """The reward of one step. Its arrays are zero until ``fill`` is called."""

    total: Float64
    """Sum of the terms, shape (world, vehicle)."""
    terms: Float64
    """The weighted terms in the order of ``Task.terms``, shape (term, world, vehicle); empty if they are not kept."""
    fill: Callable[[int, int], None]
    """Fills both arrays for the worlds from its first argument up to its second."""
    concurrent: bool = False
    """Whether ``fill`` may run for some worlds while others are still being stepped; if not, it fills all at once."""


def from_function(function: RewardFunction, swarm: Swarm, running: Bool) -> StepReward:
    """The reward of a user's function, without terms; for ``running`` worlds, shape (world,)."""
    shape = (swarm.num_worlds, swarm.num_vehicles)
    total = np.zeros(shape)

    def fill(_begin: int, _end: int) -> None:
        total[:] = valid_values(function(swarm), swarm, running, "the reward function's array")

    return StepReward(total, np.zeros((0, *shape)), fill)


def valid_values(values: Any, swarm: Swarm, running: Bool, what: str) -> Float64:
    """The values, zero for vehicles that did not act in the step, shape (world, vehicle)."""
    values, acted = np.asarray(values, np.float64), running[:, None] & (swarm.state.alive | swarm.facts.lost)
    if values.shape != acted.shape:
        raise RewardError(f"{what} must have shape {acted.shape} (world, vehicle), got {values.shape}")
    if not (np.abs(values[acted]) <= MOST_REWARD).all():
        raise RewardError(
            f"{what} must hold finite numbers of at most {MOST_REWARD:g}; facts.spacing of a lone vehicle and "
            "facts.clearance without obstacles are infinite"
        )
    return np.where(acted, values, 0.0)
