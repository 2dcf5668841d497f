"""A current of your own: a tide that turns. Before every step it is written into the water, around any environment."""

from typing import Any

import numpy as np
from pettingzoo.utils import BaseParallelWrapper

import uuv_marl
from uuv_marl import baselines

PERIOD_S = 40.0
"""Of the tide, far shorter than a real one, so that the swarm meets both directions."""


class Tide(BaseParallelWrapper[str, Any, Any]):
    """The scenario's own current as it is at high water, and in between less of it, or against it.

    ``swarm.currents`` holds how the water moves: ``mean``, ``gust`` and ``eddies``, first axis the world. What is
    written there before a step is what vehicles meet from then on, what pictures draw, and what ``swarm.flow_field()``
    gives anywhere.
    """

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start an episode, at high water."""
        found = super().reset(seed, options)
        self._high = self.unwrapped.swarm.currents.mean.copy()
        return found

    def step(self, actions: dict[str, Any]) -> Any:
        """One decision, at whose end the tide has come on."""
        swarm = self.unwrapped.swarm
        time_s = swarm.facts.time_s + swarm.scenario.timing.decision_period_s
        swarm.currents.mean[:] = self._high * np.cos(2.0 * np.pi * time_s / PERIOD_S)[:, None]
        return super().step(actions)


if __name__ == "__main__":
    changed = uuv_marl.load_scenario("starter", overrides={"current.speed_mps": 0.8, "current.direction_deg": 90.0})
    scenario = baselines.granted("bio_inspired_plus", changed)
    env = Tide(uuv_marl.parallel_env(scenario))
    policy = baselines.make("bio_inspired_plus", env)
    observations, infos = env.reset(seed=0)
    policy.reset(seed=0)
    eastward = []
    while env.agents:
        observations, _, _, _, infos = env.step(policy(observations))
        eastward.append(env.unwrapped.swarm.flow_field().at([0.0, 0.0])[1])
    collisions, ending = (next(iter(infos.values()))[name] for name in ("collisions", "ending"))
    print(f"the water ran from {max(eastward):.1f} to {min(eastward):.1f} m/s east: {ending}, {collisions} collisions")
