"""Ray RLlib's form of the environment, for its new API stack. Needs the extra ``distributed``."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.envs.parallel_env import Infos, parallel_env
from uuv_marl.extras import extra
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32

with extra("distributed", "SwarmMultiAgentEnv"):
    from ray.rllib.env.multi_agent_env import MultiAgentEnv  # pyright: ignore[reportMissingImports]
    from ray.tune.registry import register_env  # pyright: ignore[reportMissingImports]


ENV_NAME = "uuv_swarm_v1"
"""The name under which ``register`` makes the environment known."""


class SwarmMultiAgentEnv(MultiAgentEnv):
    """The PettingZoo environment in RLlib's form: the same observations and rewards, bit for bit.

    A lost vehicle is terminated alone, with an observation of zeros, and never appears again. ``__all__`` is set in
    ``terminateds`` once the swarm has arrived or no vehicle is left, in ``truncateds`` at the time limit.

    Args:
        config: the keyword arguments of ``uuv_marl.parallel_env``; RLlib hands over its ``env_config``.
    """

    def __init__(self, config: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self._env = parallel_env(**(config or {}))
        self.render_mode = self._env.render_mode
        self.metadata = dict(self._env.metadata)  # RLlib writes into it
        self.possible_agents = list(self._env.possible_agents)
        self.agents = list(self.possible_agents)
        self._late = False
        self.observation_spaces = self._env.observation_spaces
        self.action_spaces = self._env.action_spaces

    @property
    def scenario(self) -> Scenario:
        """What is simulated."""
        return self._env.scenario

    @property
    def swarm(self) -> Swarm:
        """The simulation; ``uuv_marl.baselines.make_policy(name, env)`` follows it."""
        return self._env.swarm

    @property
    def observes_positions(self) -> bool:
        """Whether policies can read the observations: ``observe="positions"``."""
        return self._env.observes_positions

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

        ``truncateds`` holds only ``__all__``: if every agent had a flag of its own, RLlib would take the episode as
        terminated, and would learn that nothing follows a time limit.
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
    """Make the environment known to RLlib as ``ENV_NAME``, on every node of the cluster; returns the name.

    Call it after ``ray.init``, and again after each further ``ray.init``: Ray forgets registrations when it shuts down.
    """
    register_env(ENV_NAME, SwarmMultiAgentEnv)
    return ENV_NAME
