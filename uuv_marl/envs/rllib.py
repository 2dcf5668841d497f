"""Ray RLlib's form of the environment, for its new API stack. Needs the extra ``distributed``."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.envs.mixins import EnvMixin
from uuv_marl.envs.parallel_env import Infos, parallel_env
from uuv_marl.extras import extra
from uuv_marl.types import Float32

with extra("distributed", "SwarmMultiAgentEnv"):
    from ray.rllib.env.multi_agent_env import MultiAgentEnv  # pyright: ignore[reportMissingImports]
    from ray.tune.registry import register_env  # pyright: ignore[reportMissingImports]


ENV_NAME = "uuv_swarm_v2"
"""The name that ``register`` uses."""


class SwarmMultiAgentEnv(EnvMixin, MultiAgentEnv):
    """The PettingZoo environment in RLlib's form, with the same observations and rewards.

    A lost vehicle is terminated alone, with an observation of zeros, and does not appear again. ``__all__`` is set in
    ``terminateds`` once the task is done or no vehicle is left, in ``truncateds`` at the time limit.

    Args:
        config: RLlib's ``env_config``: the keyword arguments of ``uuv_marl.parallel_env``, such as ``for_policy``.
    """

    def __init__(self, config: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self._env = parallel_env(**(config or {}))
        self._batch = self._env._batch  # pyright: ignore[reportPrivateUsage]
        self.render_mode = self._env.render_mode
        self.metadata = dict(self._env.metadata)  # RLlib writes into it
        self.possible_agents = list(self._env.possible_agents)
        self.agents = list(self.possible_agents)
        self._late = False
        self.observation_spaces = self._env.observation_spaces
        self.action_spaces = self._env.action_spaces

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Float32], Infos]:
        """Start an episode, as ``SwarmParallelEnv.reset``."""
        observations, infos = self._env.reset(seed, options)
        self._late = False
        self.agents = list(self._env.agents)
        return observations, infos

    def step(
        self, action_dict: Mapping[str, ArrayLike]
    ) -> tuple[dict[str, Float32], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """One decision of every agent, as ``SwarmParallelEnv.step``, errors included.

        ``truncateds`` holds only ``__all__``: with a flag for every agent RLlib would treat the episode as terminated
        and would not bootstrap beyond the time limit.
        """
        observations, rewards, terminateds, truncateds, infos = self._env.step(action_dict)
        self.agents = list(self._env.agents)
        self._late |= any(truncateds.values())
        terminateds["__all__"] = not self.agents and not self._late
        return observations, rewards, terminateds, {"__all__": self._late}, infos

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the swarm as ``SwarmParallelEnv.render`` does."""
        return self._env.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._env.close()


def register() -> str:
    """Register the environment with RLlib as ``ENV_NAME``, on every node of the cluster; returns the name.

    Call it after every ``ray.init``: Ray loses registrations when it shuts down.
    """
    register_env(ENV_NAME, SwarmMultiAgentEnv)
    return ENV_NAME
