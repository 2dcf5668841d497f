"""``few_informed``: few vehicles perceive l(t); the others must follow the swarm by sonar detections."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np

from uuv_marl.percept import FLAG, FieldTable, PerceptField
from uuv_marl.scenario.fields import Positive, within
from uuv_marl.sim.episode_setup import EpisodeSetup, start_state
from uuv_marl.sim.trigonometry import cos_sin, rotated
from uuv_marl.tasks.reach import Reach, ReachNumbers
from uuv_marl.tasks.reward import Terms
from uuv_marl.tasks.task import Task
from uuv_marl.types import Bool


class FewInformedNumbers(ReachNumbers):
    """Numbers of ``few_informed``."""

    near_m: Positive = 80.0
    """A vehicle is at its goal within this distance of l(t)'s end. Assumed: the paper's ``arrival.spread_m``."""
    informed: Annotated[int, within(1, 16_384)]
    """Number of vehicles that perceive l(t), sampled for each episode; all if there are fewer."""


_OWN = {
    "progress": "Phi now - Phi before, Phi = -min(d, D)/c; d: distance to l(t), perceived or not, D: "
    "progress_far_m, c: progress_m",
}


class FewInformed(Reach):
    """Be within ``near_m`` of l(t)'s end at the time limit, collision-free; only ``informed`` vehicles perceive l(t).

    For the others the reference and its velocity are zero, and the start is turned at random against the first leg, so
    that only the motion of the vehicles that they detect shows the direction. All have the same reward.
    """

    Numbers = FewInformedNumbers
    reference_label: ClassVar[str] = Task.reference_label
    observed: ClassVar[FieldTable] = (
        PerceptField("informed", (1,), FLAG, "1 if the vehicle perceives l(t); 0 if its reference always reads 0"),
    )
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {
        **{name: {**terms, **_OWN} for name, terms in Reach.rewards.items()},
        "leader": {**Reach.rewards["first_arrival"], **_OWN},
    }
    headline: ClassVar[str] = "uninformed_share"
    columns: ClassVar[Mapping[str, str]] = {"uninformed_share": "share of the uninformed vehicles that succeed [1]"}
    reference_policy: ClassVar[str] = "leader_follower"

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        """The scenario's own, but the start is turned, without obstacles in it, and informed vehicles are sampled."""
        drawn, scenario, n = Task.draw(self, world, rng), self.swarm.scenario, self.swarm.num_vehicles
        (first, second), (c, s) = drawn.waypoints[0][:2], cos_sin(rng.uniform(-np.pi, np.pi))
        ahead = first + rotated(second - first, c, s)
        block = (n, (float(first[0]), float(first[1])), (float(ahead[0]), float(ahead[1])))
        gap = 2.0 * (scenario.constraints.s_o_m + scenario.constraints.s_u_m)  # as between the obstacles of a field
        clear = [scenario.start.distance(*block, (x, y)) >= radius + gap for x, y, radius in drawn.obstacles]
        eta, nu = start_state(scenario, np.array([first, ahead]), rng)
        informed = np.zeros(n, np.bool_)
        informed[rng.permutation(n)[: self.numbers.informed]] = True
        return drawn._replace(obstacles=drawn.obstacles[np.array(clear, np.bool_)], eta=eta, nu=nu, informed=informed)

    def observe(self, running: Bool) -> Terms:  # noqa: ARG002
        """Whether each vehicle is informed."""
        return {"informed": self.swarm.world_map.informed[:, :, None].astype(np.float64)}

    def reward(self, running: Bool) -> Terms:
        """With ``leader`` each informed vehicle gets the mean of each term over all vehicles, except ``loss``."""
        terms, informed = super().reward(running), self.swarm.world_map.informed
        if self.reward_name != "leader":
            return terms
        mean = {name: np.where(informed, own.mean(axis=1, keepdims=True), own) for name, own in terms.items()}
        return mean | {"loss": terms["loss"]}

    def at_goal(self) -> Bool:
        """Vehicles within ``near_m`` of l(t) once it rests at its end."""
        return (self.swarm.facts.time_s >= self.swarm.duration_s)[:, None] & super().at_goal()

    def done(self) -> Bool:
        """No world: the time limit ends the episode, so that vehicles must stay."""
        return np.zeros(self.swarm.num_worlds, np.bool_)

    def metrics(self, world: int) -> dict[str, float | None]:
        """Also the headline; None if all are informed."""
        uninformed = ~self.swarm.world_map.informed[world]
        share = float(self.succeeded()[world, uninformed].mean()) if uninformed.any() else None
        return {**super().metrics(world), "uninformed_share": share}
