"""The reward: named terms of every vehicle, weighted by the scenario, and their sum.

Two laws hold by construction. An earlier arrival never pays less: terms per second are bounded and at most zero, and
arrival pays once, whether it ends the episode or not. A vehicle never gains from its own loss, unless it would have
collided again and again: a lost vehicle is charged the worst that those terms could have cost it in the rest of the
episode, an arrival, and a collision. No term depends on the number of vehicles. One weakness remains: if a straggler
keeps the swarm from arriving, the others gain from its loss.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from uuv_marl.errors import RewardError
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import Facts, State
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.model import rules
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float64

RewardFunction = Callable[[Swarm], Float64]
"""A user's own reward: from the swarm after a step to an array (world, vehicle)."""


def own_reward(function: RewardFunction, swarm: Swarm, present: Bool) -> Float64:
    """What a user's own reward gives, shape (world, vehicle); zero for vehicles that are not present.

    Args:
        function: the reward.
        swarm: after a step.
        present: vehicles that were there before the step, shape (world, vehicle).

    Raises:
        RewardError: the function gives an array of another shape, or numbers that are not finite.
    """
    reward = np.asarray(function(swarm), np.float64)
    if reward.shape != present.shape:
        raise RewardError(f"the reward function must give an array {present.shape}, got {reward.shape}")
    if not np.isfinite(reward[present]).all():
        raise RewardError(
            "the reward function must give finite numbers; distances are infinite where nobody is near "
            "(facts.spacing of a lone vehicle) or nothing is there (facts.clearance without obstacles)"
        )
    return np.where(present, reward, 0.0)


TERMS: Mapping[str, str] = {
    "tracking": "-w · dt · clip(d/s_l - 1, 0, 1); d: the vehicle's distance to l(t)",
    "obstacle": "-w · dt · clip(1 - d/s_o, 0, 1); d: distance to the nearest obstacle's surface",
    "spacing": "-w · dt · clip(1 - d/s_u, 0, 1); d: distance to the nearest vehicle",
    "effort": "-w · dt · a²; a²: mean squared length of the action, 1 at full force",
    "collision": "-w for every collision that begins",
    "loss": "once, for a lost vehicle: -(w_collision + w_arrival + (w_tracking + w_obstacle + w_spacing + w_effort) · "
    "T); T: time left until the limit",
    "arrival": "+w for every vehicle when the swarm arrives",
}
"""The formula of each term; w is its weight in the scenario's ``reward``, dt the time between two decisions [s]."""


class RewardWeights(NamedTuple):
    """The scenario's weights and lengths, as numbers for the compiled functions."""

    period_s: float
    tracking: float
    obstacle: float
    spacing: float
    effort: float
    collision: float
    arrival: float
    s_l_m: float
    s_o_m: float
    s_u_m: float
    settled_s: float
    """The step that arrives ends less than this after ``Facts.arrival_s``, and every later one after it."""


def reward_weights(scenario: Scenario) -> RewardWeights:
    """The scenario's weights and lengths."""
    weight, limit, timing = scenario.reward, scenario.constraints, scenario.timing
    dwell = rules(scenario).dwell_ticks
    return RewardWeights(
        timing.decision_period_s, weight.tracking, weight.obstacle, weight.spacing, weight.effort,
        weight.collision, weight.arrival, limit.s_l_m, limit.s_o_m, limit.s_u_m,
        settled_s=(dwell + timing.holds_per_decision - 0.5) * timing.control_hold_s,
    )  # fmt: skip


def reward_terms(swarm: Swarm) -> Mapping[str, Float64]:
    """The weighted ``TERMS`` of the latest step, shape (world, vehicle) each; zero for vehicles lost before."""
    return named(compute_reward(swarm, reward_weights(swarm.scenario), np.ones(swarm.num_worlds, np.bool_))[1])


def named(terms: Float64) -> Mapping[str, Float64]:
    """The terms that ``compute_reward`` gave, by name."""
    return dict(zip(TERMS, terms, strict=True))


def compute_reward(swarm: Swarm, weights: RewardWeights, running: Bool) -> tuple[Float64, Float64]:
    """What the latest step pays in the worlds that are ``running``, shape (world,); others are paid nothing.

    Returns:
        The reward, shape (world, vehicle), and the weighted ``TERMS`` that it sums, shape (term, world, vehicle); zero
        for vehicles lost before.
    """
    reward, terms, pay = payer(swarm, weights, running)
    pay(0, swarm.num_worlds)
    return reward, terms


def payer(swarm: Swarm, weights: RewardWeights, running: Bool) -> tuple[Float64, Float64, Callable[[int, int], None]]:
    """The arrays of ``compute_reward``, still zero, and what fills them for a range of worlds: first and end."""
    terms = np.zeros((len(TERMS), swarm.num_worlds, swarm.num_vehicles))
    reward, limit_s = np.zeros(terms.shape[1:]), swarm.time_limit_s

    def pay(begin: int, end: int) -> None:
        _fill_some(begin, end, running, limit_s, swarm.state, swarm.facts, weights, terms, reward)

    return reward, terms, pay


@compiled
def shortfall(share: float) -> float:
    """A cost between 0 and 1 [1]."""
    return min(max(share, 0.0), 1.0)


@compiled
def _fill(
    w: int, time_limit_s: Float64, state: State, facts: Facts, weights: RewardWeights, terms: Float64, reward: Float64
) -> None:
    """Fill the weighted ``terms`` of one world, shape (term, world, vehicle), and their sum; both are zero before."""
    left_s = max(time_limit_s[w] - facts.time_s[w], 0.0)
    worst_rate = weights.tracking + weights.obstacle + weights.spacing + weights.effort
    arrives = facts.time_s[w] - facts.arrival_s[w, 0] < weights.settled_s  # no NaN is
    for i in range(state.alive.shape[1]):
        alive, lost = state.alive[w, i], facts.lost[w, i]
        if not (alive or lost):
            continue
        dx, dy = state.eta[w, i, 0] - facts.reference[w, 0], state.eta[w, i, 1] - facts.reference[w, 1]
        away = math.sqrt(dx * dx + dy * dy)
        terms[0, w, i] = -weights.tracking * weights.period_s * shortfall(away / weights.s_l_m - 1.0)
        terms[1, w, i] = -weights.obstacle * weights.period_s * shortfall(1.0 - facts.clearance[w, i] / weights.s_o_m)
        terms[2, w, i] = -weights.spacing * weights.period_s * shortfall(1.0 - facts.spacing[w, i] / weights.s_u_m)
        terms[3, w, i] = -weights.effort * weights.period_s * facts.effort[w, i]
        terms[4, w, i] = -weights.collision * facts.contacts[w, i]
        if lost:
            terms[5, w, i] = -(weights.collision + weights.arrival + worst_rate * left_s)
        if alive and arrives:
            terms[6, w, i] = weights.arrival
        for k in range(terms.shape[0]):
            reward[w, i] += terms[k, w, i]


@compiled
def _fill_some(
    begin: int, end: int, running: Bool, time_limit_s: Float64, state: State, facts: Facts, weights: RewardWeights,
    terms: Float64, reward: Float64,
) -> None:  # fmt: skip
    """``_fill`` for those worlds of a range that are ``running``, shape (world,)."""
    for w in range(begin, end):
        if running[w]:
            _fill(w, time_limit_s, state, facts, weights, terms, reward)
