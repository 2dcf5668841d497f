"""Gather by sonar: ``uuv-marl benchmark --scenario starter --set task=task:Rendezvous --policy random``."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

import uuv_marl
from uuv_marl.percept import FLAG, PerceptField
from uuv_marl.scenario.fields import Positive, Section
from uuv_marl.sim.episode_setup import EpisodeSetup
from uuv_marl.tasks import Task

Floats, Bool = NDArray[np.floating[Any]], NDArray[np.bool_]


class Rendezvous(Task):
    """All come within ``near_m`` of the swarm's centre without a collision. No vehicle perceives a reference."""

    class Numbers(Section):
        near_m: Positive = 10.0

    observed: ClassVar[tuple[PerceptField, ...]] = (PerceptField("near", (1,), FLAG, "1 within near_m of the centre"),)
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {"dense": {"away": "-0.01/m", "collision": "-10 for each"}}
    columns: ClassVar[Mapping[str, str]] = {"spread_m": "mean distance from the centre at the end [m]"}

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        drawn = super().draw(world, rng)
        return drawn._replace(informed=np.zeros_like(drawn.informed), obstacles=np.zeros((0, 3)))

    def _away(self) -> Floats:
        return np.hypot(*np.moveaxis(self.swarm.state.eta[:, :, :2] - self.swarm.facts.centre[:, None], -1, 0))

    def at_goal(self) -> Bool:
        return self._away() <= self.numbers.near_m

    def done(self) -> Bool:
        return np.all(self.at_goal() | ~self.swarm.state.alive, axis=1)

    def observe(self, running: Bool) -> Mapping[str, Floats]:
        return {"near": self.at_goal()[:, :, None].astype(np.float64)}

    def reward(self, running: Bool) -> Mapping[str, Floats]:
        return {"away": -0.01 * self._away(), "collision": -10.0 * self.swarm.facts.vehicle_collisions}

    def metrics(self, world: int) -> dict[str, float | None]:
        return {**super().metrics(world), "spread_m": float(self._away()[world].mean())}

    def marks(self, world: int) -> Floats:
        return np.array([[*self.swarm.facts.centre[world], self.numbers.near_m]])


if __name__ == "__main__":
    env = uuv_marl.parallel_env("starter", task=f"{__name__}:Rendezvous")
    _, infos = env.reset(seed=0)
    while env.agents:
        *_, infos = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    print("gathered" if infos["uuv_0"]["is_success"] else "not gathered")
