"""End-to-end training, the same for every library: Stable-Baselines3's PPO, two layers of 64, a row per agent."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv
from worker import Case

STEPS, BATCH, EPOCHS = 16, 3456, 4
Step = Callable[[NDArray[Any]], tuple[NDArray[Any], NDArray[Any]]]


class Rows(VecEnv):
    """A VecEnv of first observations, shape (row, entry), and of a function from actions to observations and rewards.

    Episodes never end. ``spaces`` are a row's, of observations and of actions.
    """

    def __init__(self, observation: NDArray[Any], step: Step, *spaces: Any) -> None:
        self.render_mode = None
        super().__init__(len(observation), *spaces)
        self._observation, self._step = observation, step
        self._told = np.zeros(len(observation), np.bool_), [{} for _ in observation]

    def reset(self) -> Any:
        return self._observation

    def step_async(self, actions: NDArray[Any]) -> None:
        self._actions = actions

    def step_wait(self) -> Any:
        return *self._step(self._actions), *self._told

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs

    def _unused(self, *args: Any, **kwargs: Any) -> Any:
        raise NotImplementedError

    close = set_attr = env_method = _unused


def training(env: VecEnv, seed: int | None = 100_000, **changes: Any) -> Case:
    """A unit is a rollout of all rows, and the learning from it; ``changes`` replace settings."""
    settings = {"n_steps": STEPS, "batch_size": BATCH, "n_epochs": EPOCHS, "policy_kwargs": {"net_arch": [64, 64]}}
    model = PPO("MlpPolicy", env, seed=seed, device="cpu", **(settings | changes))
    amount = model.n_steps * env.num_envs
    return Case(lambda units: model.learn(units * amount, reset_num_timesteps=False), amount)
