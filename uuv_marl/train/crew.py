"""``Crew``: a ``Fleet`` as a Stable-Baselines3 ``VecEnv``, which sees what the actor sees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from uuv_marl.baselines.features import MOST_BARRIER
from uuv_marl.envs.sb3 import SharedRows
from uuv_marl.extras import extra
from uuv_marl.scenario import Scenario
from uuv_marl.train.fleet import Fleet
from uuv_marl.train.shaping import Weights

with extra("train", "training with Stable-Baselines3"):
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv

Float32 = NDArray[np.float32]


class Crew(SharedRows, VecEnv):
    """Rows of a fleet: features of the actor in, what it adds to the barrier [full force] out.

    Args:
        scenario: what to simulate.
        sizes: number of vehicles and of worlds of each swarm.
        weights: of the reward.
    """

    def __init__(self, scenario: Scenario, sizes: Sequence[tuple[int, int]], weights: Weights) -> None:
        self._next_seed: int | None = None
        self.fleet = Fleet(scenario, sizes, weights, self._draw)
        self.paid = 0.0
        """Mean reward of the rows, summed over the steps so far."""
        self.render_mode = None
        size = (self.fleet.features,)
        super().__init__(
            self.fleet.rows, Box(-np.inf, np.inf, size), Box(-MOST_BARRIER, MOST_BARRIER, (2,), np.float32)
        )

    def _draw(self, num: int) -> Sequence[int] | None:
        """Counted on through all swarms at a reset after ``seed``; later each world goes on with its own stream."""
        if self._next_seed is None:
            return None
        first, self._next_seed = self._next_seed, self._next_seed + num
        return range(first, first + num)

    @property
    def seen(self) -> Float32:
        """What every row sees now, shape (row, feature)."""
        return self.fleet.seen[:, : self.fleet.features].copy()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """For the next reset: worlds are counted on through all swarms, and world w starts from ``seed + w``."""
        self._next_seed = seed
        return [seed] * self.num_envs

    def reset(self) -> Float32:
        """Start all worlds; shape (row, feature)."""
        self.fleet.reset()
        self._next_seed = None
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self.seen

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, shape (row, 2), for ``step_wait``."""
        self._actions = np.asarray(actions, np.float32)

    def step_wait(self) -> tuple[Float32, Float32, NDArray[np.bool_], list[dict[str, Any]]]:
        """Features, rewards, dones and infos of every row; cut-off rows tell what they would have seen next."""
        moment = self.fleet.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row, last in zip(np.flatnonzero(moment.truncated), moment.last, strict=True):
            infos[row] = {"TimeLimit.truncated": True, "terminal_observation": last[: self.fleet.features]}
        self.paid += float(moment.reward.mean())
        return self.seen, moment.reward, moment.terminated | moment.truncated, infos

    def close(self) -> None:
        """Nothing is open."""
