"""``TrainingVecEnv``: a ``TrainingEnv`` as a Stable-Baselines3 ``VecEnv``, which sees what the actor sees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from uuv_marl.envs.sb3 import SharedEnvMixin
from uuv_marl.extras import extra
from uuv_marl.train.acting import ACTING
from uuv_marl.train.env import TRAINING_SEEDS, TrainingEnv
from uuv_marl.train.group import Problem
from uuv_marl.types import Bool, Float32

with extra("train", "training with Stable-Baselines3"):
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv


class TrainingVecEnv(SharedEnvMixin, VecEnv):
    """Rows of a ``TrainingEnv``: features of the actor in, its output out, as ``Acting`` takes it.

    Args:
        problem: what is trained on. Worlds go on with streams of their own; where it has conditions, they are made anew
            for each episode, and start from the next seed.
    """

    def __init__(self, problem: Problem) -> None:
        self._counts = bool(problem.conditions)
        self.next_seed: int | None = TRAINING_SEEDS[0] if self._counts else None
        """Seed of the next world that starts; None where worlds go on with their own streams."""
        self.env = TrainingEnv(problem, self._draw)
        self.reward_sum = 0.0
        """Mean reward of the rows, summed over the steps so far."""
        self.render_mode = None
        size, most = (self.env.features,), ACTING[problem.sees].most
        super().__init__(self.env.rows, Box(-np.inf, np.inf, size), Box(-most, most, (self.env.outputs,), np.float32))

    def _draw(self, num: int) -> Sequence[int] | None:
        """Counted on through all swarms at a reset after ``seed``; later each world goes on with its own stream."""
        if self.next_seed is None:
            return None
        first, self.next_seed = self.next_seed, self.next_seed + num
        low, high = TRAINING_SEEDS
        return [low + (seed - low) % (high - low) for seed in range(first, first + num)]

    @property
    def observation(self) -> Float32:
        """What every row sees now, shape (row, feature)."""
        return self.env.observation[:, : self.env.features].copy()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """For the next reset: world w, counted on through all swarms, starts from ``seed + w``.

        After the last training seed comes the first one again.
        """
        self.next_seed = seed
        return [seed] * self.num_envs

    def reset(self) -> Float32:
        """Start all worlds; shape (row, feature)."""
        self.env.reset()
        if not self._counts:
            self.next_seed = None
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self.observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, shape (row, outputs), for ``step_wait``."""
        self._actions = np.asarray(actions, np.float32)

    def step_wait(self) -> tuple[Float32, Float32, Bool, list[dict[str, Any]]]:
        """Features, rewards, dones and infos of every row; cut-off rows tell what they would have seen next."""
        transition = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row, last in zip(np.flatnonzero(transition.truncated), transition.final_obs, strict=True):
            infos[row] = {"TimeLimit.truncated": True, "terminal_observation": last[: self.env.features]}
        self.reward_sum += float(transition.reward.mean())
        return self.observation, transition.reward, transition.terminated | transition.truncated, infos

    def close(self) -> None:
        """Nothing is open."""
