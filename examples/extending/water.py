"""A current of your own: a tide that turns. Before every step it is written into the water, around any environment."""

from typing import Any

import numpy as np
from pettingzoo.utils import BaseParallelWrapper

import uuv_marl
from uuv_marl import baselines
from uuv_marl.envs.parallel_env import SwarmParallelEnv

PERIOD_S = 40.0
"""Of the tide, far shorter than a real one, so that the swarm meets both directions."""


class Tide(BaseParallelWrapper[str, Any, Any]):
    """The scenario's own current as it is at high water, and in between less of it, or against it.

    ``swarm.currents`` holds how the water moves: ``mean``, ``gust`` and ``eddies``, first axis the world. What is
    written there before a step is what vehicles meet from then on, what pictures draw, and what ``swarm.flow_field()``
    gives anywhere.
    """

    def __init__(self, env: SwarmParallelEnv) -> None:
        super().__init__(env)
        if env.swarm.currents is None:
            raise ValueError("the scenario's water is still; set current.speed_mps")
        self._swarm, self._water = env.swarm, env.swarm.currents

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start an episode, at high water."""
        result = super().reset(seed, options)
        self._high = self._water.mean.copy()
        return result

    def step(self, actions: dict[str, Any]) -> Any:
        """One decision, at whose end the tide has come on."""
        time_s = self._swarm.facts.time_s + self._swarm.scenario.timing.decision_period_s
        self._water.mean[:] = self._high * np.cos(2.0 * np.pi * time_s / PERIOD_S)[:, None]
        return super().step(actions)


if __name__ == "__main__":
    changed = uuv_marl.load_scenario("starter", overrides={"current.speed_mps": 0.8, "current.direction_deg": 90.0})
    env = uuv_marl.parallel_env(baselines.with_policy_requirements("bio_inspired_plus", changed))
    tidal, policy, eastward = Tide(env), baselines.make_policy("bio_inspired_plus", env), list[float]()
    observations, infos = tidal.reset(seed=0)
    while tidal.agents:
        observations, _, _, _, infos = tidal.step(policy(observations))
        eastward.append(env.swarm.flow_field().at([0.0, 0.0])[1])
    ending, hits = infos["uuv_0"]["ending"], infos["uuv_0"]["collisions"]
    print(f"the water ran from {max(eastward):.1f} to {min(eastward):.1f} m/s east: {ending}, {hits} collisions")
