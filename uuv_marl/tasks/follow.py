"""``follow``: the paper's task. The swarm follows l(t) around obstacles and comes to rest at its end.

Properties of both rewards: an earlier arrival along the same path never lowers the return, since costs per second are
at most zero, progress sums to the distance at the start, and an arrival is rewarded once. Moving away and back gains
nothing. A vehicle never gains from its own loss, unless it would have collided many times: it is charged the most that
the terms could have cost it in the rest of the episode, an arrival and a collision. No term depends on the number of
vehicles. A weakness: if one vehicle keeps the swarm from arriving, the others gain from its loss.
"""

import math
from collections import namedtuple
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from uuv_marl.errors import ScenarioError
from uuv_marl.percept import DURATION, FieldTable, PerceptField
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.sections import Constraints, Reward
from uuv_marl.sim.arrays import Facts, State
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.model import rules
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.reward import StepReward, Terms
from uuv_marl.tasks.task import Task
from uuv_marl.types import Bool, Float64

_TERMS = {
    "tracking": "-w · dt · clip(d/s_l - 1, 0, 1); d: the vehicle's distance to l(t)",
    "obstacle": "-w · dt · clip(1 - d/s_o, 0, 1); d: distance to the nearest obstacle's surface",
    "spacing": "-w · dt · clip(1 - d/s_u, 0, 1); d: distance to the nearest vehicle",
    "effort": "-w · dt · a²; a²: mean squared length of the action, 1 at full force",
    "collision": "-w for every collision that begins",
    "loss": "once, for a lost vehicle: -(w_collision + w_arrival + (w_tracking + w_obstacle + w_spacing + "
    "w_effort) · T), T: time left until the limit; in dense also what is left of progress, -(D - min(d, D))/c",
    "arrival": "+w for every vehicle when the swarm arrives",
    "progress": "dense alone: Phi now - Phi before, with Phi = -min(d, D)/c, and 0 once the swarm has arrived; "
    "d: the vehicle's distance to l(t), D: progress_far_m, c: progress_m",
}
"""Each term of ``dense``, in the compiled order; ``sparse`` has all but the last."""
PROGRESS = len(_TERMS) - 1


class Follow(Task):
    """Follow l(t) and arrive together, as ``arrival`` and ``time_limit`` of the scenario define it."""

    ending: ClassVar[str] = "arrival"
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "dense": _TERMS,
        "sparse": {name: formula for name, formula in _TERMS.items() if name != "progress"},
    }

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        self._weights = reward_weights(swarm.scenario)

    @classmethod
    def check(cls) -> None:
        """Also raise ScenarioError for a subclass with other ``rewards`` and the reward of this class."""
        super().check()
        if cls.reward is Follow.reward and cls.rewards != Follow.rewards:
            raise ScenarioError(f"task {cls.__name__} has rewards of its own; define reward(running), which gives them")

    def step_reward(self, running: Bool, *, keep_terms: bool = True) -> StepReward:
        """The compiled reward, filled while worlds are stepped, unless a subclass defines its own ``reward``."""
        own = type(self).reward is not Follow.reward
        return super().step_reward(running) if own else self._compiled(running, keep_terms)

    def _compiled(self, running: Bool, keep_terms: bool = True) -> StepReward:
        swarm = self.swarm
        worlds, n = swarm.num_worlds, swarm.num_vehicles
        terms = np.zeros((len(_TERMS) - (self.reward_name == "sparse"), worlds if keep_terms else 0, n))
        reward, limit_s = np.zeros((worlds, n)), swarm.time_limit_s

        def fill(begin: int, end: int) -> None:
            _fill(begin, end, running, limit_s, swarm.state, swarm.facts, self._weights, terms, reward)

        return StepReward(reward, terms, fill, concurrent=True)

    def reward(self, running: Bool) -> Terms:
        """The weighted terms of the latest step; zero for vehicles lost before."""
        step_reward = self._compiled(running)
        step_reward.fill(0, self.swarm.num_worlds)
        return dict(zip(_TERMS, step_reward.terms, strict=False))

    def done(self) -> Bool:
        """Worlds whose swarm has arrived, unless ``arrival.ends_episode`` is false."""
        return self.swarm.arrived & self.swarm.scenario.arrival.ends_episode

    def at_goal(self) -> Bool:
        """All vehicles of a swarm that has arrived: the paper defines success for the swarm."""
        return np.broadcast_to(self.swarm.arrived[:, None], self.swarm.state.alive.shape)

    def arrived_before(self) -> Bool:
        """All vehicles of a swarm that has arrived."""
        return self.at_goal()

    @classmethod
    def state_fields(cls, scenario: Scenario) -> FieldTable:
        """Also for how long the swarm has been together at the end."""
        return *super().state_fields(scenario), PerceptField("dwell", (1,), DURATION, "time in arrival.spread_m")

    def state(self) -> Terms:
        """The values of ``state_fields``."""
        dwell = self.swarm.state.dwell[:, :1] * self.swarm.scenario.timing.control_step_s
        return {**super().state(), "dwell": dwell}

    def arrived(self, world: int) -> bool:
        """Whether the swarm has arrived."""
        return bool(self.swarm.arrived[world])

    def metrics(self, world: int) -> dict[str, float | None]:  # noqa: ARG002
        """None beyond those of every run (``uuv_marl.benchmark.metrics``)."""
        return {}

    def success(self, world: int, vehicle: int | None = None) -> bool:  # noqa: ARG002 - the swarm's
        """Whether the swarm has arrived, with or without collisions: the paper's success."""
        return self.arrived(world)


RewardWeights: Any = namedtuple(
    "RewardWeights", [*Reward.model_fields, *Constraints.model_fields, "period_s", "settled_s"]
)
"""The scenario's weights and lengths, as numbers for the compiled function.

The step of the arrival ends less than ``settled_s`` after ``Facts.arrival_s``, later steps end more.
"""


def reward_weights(scenario: Scenario) -> Any:
    """The scenario's ``RewardWeights``."""
    timing, dwell = scenario.timing, rules(scenario).dwell_ticks
    settled_s = (dwell + timing.control_steps_per_decision - 0.5) * timing.control_step_s
    numbers = {**dict(scenario.reward), **dict(scenario.constraints)}
    return RewardWeights(**numbers, period_s=timing.decision_period_s, settled_s=settled_s)


@compiled
def shortfall(share: float) -> float:
    """A cost between 0 and 1 [1]."""
    return min(max(share, 0.0), 1.0)


@compiled
def _fill(
    begin: int, end: int, running: Bool, time_limit_s: Float64, state: State, facts: Facts, weights: Any,
    terms: Float64, reward: Float64,
) -> None:  # fmt: skip
    """Fill the weighted ``terms``, shape (term, world or 0, vehicle), and their sum; zero before.

    Only for the worlds of a range that are ``running``, shape (world,).
    """
    worst_rate = weights.tracking + weights.obstacle + weights.spacing + weights.effort
    far, dense, store_terms = weights.progress_far_m, terms.shape[0] > PROGRESS, terms.shape[1] > 0
    for w in range(begin, end):
        left_s = max(time_limit_s[w] - facts.time_s[w], 0.0)
        arrived = not math.isnan(facts.arrival_s[w, 0])
        arrives = facts.time_s[w] - facts.arrival_s[w, 0] < weights.settled_s  # no NaN is
        for i in range(state.alive.shape[1] if running[w] else 0):
            alive, lost = state.alive[w, i], facts.lost[w, i]
            if not (alive or lost):
                continue
            away = facts.away[w, i]
            tracking = -weights.tracking * weights.period_s * shortfall(away / weights.s_l_m - 1.0)
            obstacle = -weights.obstacle * weights.period_s * shortfall(1.0 - facts.clearance[w, i] / weights.s_o_m)
            spacing = -weights.spacing * weights.period_s * shortfall(1.0 - facts.spacing[w, i] / weights.s_u_m)
            effort = -weights.effort * weights.period_s * facts.effort[w, i]
            collision = -weights.collision * facts.vehicle_collisions[w, i]
            loss, arrival, progress = 0.0, 0.0, 0.0
            if lost:
                left = (far - min(away, far)) / weights.progress_m if dense else 0.0
                loss = -(weights.collision + weights.arrival + worst_rate * left_s + left)
            if alive and arrives:
                arrival = weights.arrival
            if dense and (arrives or not arrived):
                left = 0.0 if arrives else min(away, far)
                progress = (min(facts.away_before[w, i], far) - left) / weights.progress_m
            reward[w, i] = 0.0 + tracking + obstacle + spacing + effort + collision + loss + arrival + progress
            if store_terms:
                for k, term in enumerate((tracking, obstacle, spacing, effort, collision, loss, arrival)):
                    terms[k, w, i] = term
                if dense:
                    terms[PROGRESS, w, i] = progress
