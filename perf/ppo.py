"""End-to-end training, the same for every library: Stable-Baselines3's PPO, two layers of 64, a row per agent."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Space
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv
from worker import Case

STEPS, BATCH, EPOCHS = 16, 3456, 4
Indices = None | int | Iterable[int]


class Rows(VecEnv):
    """A VecEnv of two functions; episodes never end.

    Args:
        observation: observations at the start, shape (row, entry).
        step: from actions to observations and rewards, shape (row,).
        action_space: of one row.
        observation_space: of one row.
    """

    def __init__(
        self,
        observation: NDArray[Any],
        step: Callable[[NDArray[Any]], tuple[NDArray[Any], NDArray[Any]]],
        observation_space: Space[Any],
        action_space: Space[Any],
    ) -> None:
        self.render_mode = None
        super().__init__(len(observation), observation_space, action_space)
        self._observation, self._step = observation, step
        self._dones = np.zeros(self.num_envs, np.bool_)
        self._infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]

    def reset(self) -> NDArray[Any]:
        return self._observation

    def step_async(self, actions: NDArray[Any]) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.bool_], list[dict[str, Any]]]:
        observation, reward = self._step(self._actions)
        return observation, reward, self._dones, self._infos

    def close(self) -> None:
        pass

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:  # noqa: ARG002 - SB3's signature
        return [getattr(self, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> Sequence[bool]:  # noqa: ARG002
        return [False] * self.num_envs


def training(env: VecEnv) -> Case:
    """A unit is a rollout of ``STEPS`` steps of all rows, and the learning from it."""
    model = PPO(
        "MlpPolicy", env, n_steps=STEPS, batch_size=BATCH, n_epochs=EPOCHS, policy_kwargs={"net_arch": [64, 64]},
        seed=100_000, device="cpu",
    )  # fmt: skip
    amount = STEPS * env.num_envs
    return Case(lambda units: model.learn(units * amount, reset_num_timesteps=False), amount)
