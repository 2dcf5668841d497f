"""The reward: named terms of every vehicle, weighted by the scenario, and their sum.

Sound by construction: terms per second are bounded and at most zero, arrival pays once and ends the episode, so that
arriving earlier never pays less; a lost vehicle is charged the worst that those terms could have cost it in the rest of
the episode, the arrival it misses, and a collision, so that dying never pays the one who dies (unless it would have
collided again and again). No term depends on the number of vehicles. One thing remains: where a straggler keeps the
swarm from arriving, the others gain from its loss.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.swarm import Swarm

Float64 = NDArray[np.float64]

RewardFunction = Callable[[Swarm], Float64]
"""A user's own reward: from the swarm after a step to an array (world, vehicle)."""


TERMS: Mapping[str, str] = {
    "tracking": "- w x period x (distance to l(t) / s_l - 1), the bracket within 0 and 1",
    "obstacle": "- w x period x (1 - distance to the nearest obstacle's surface / s_o), likewise",
    "spacing": "- w x period x (1 - distance to the nearest vehicle / s_u), likewise",
    "effort": "- w x period x squared length of the action",
    "collision": "- w for every contact episode that begins",
    "loss": "lost vehicle: minus collision's w, arrival's w, and the most that the four rates cost until the limit",
    "arrival": "+ w for every vehicle when the swarm arrives",
}
"""What each term is; w is its weight in the scenario's ``reward``, the period that between decisions [s]."""


def reward_terms(swarm: Swarm) -> Mapping[str, Float64]:
    """The weighted ``TERMS`` of the latest step, shape (world, vehicle) each; zero for vehicles lost before."""
    scenario, facts, state = swarm.scenario, swarm.facts, swarm.state
    weight, limit, period = scenario.reward, scenario.constraints, scenario.timing.decision_period_s
    present = state.alive | facts.lost
    away = np.hypot(*np.moveaxis(state.eta[:, :, :2] - facts.reference[:, None, :2], -1, 0))
    left_s = np.maximum(swarm.time_limit_s - facts.time_s, 0.0)[:, None]
    worst_rate = weight.tracking + weight.obstacle + weight.spacing + weight.effort
    terms = {
        "tracking": -weight.tracking * period * np.clip(away / limit.s_l_m - 1.0, 0.0, 1.0),
        "obstacle": -weight.obstacle * period * np.clip(1.0 - facts.clearance / limit.s_o_m, 0.0, 1.0),
        "spacing": -weight.spacing * period * np.clip(1.0 - facts.spacing / limit.s_u_m, 0.0, 1.0),
        "effort": -weight.effort * period * facts.effort,
        "collision": -weight.collision * facts.contacts.astype(np.float64),
        "loss": -(weight.collision + weight.arrival + worst_rate * left_s) * facts.lost,
        "arrival": weight.arrival * (state.alive & swarm.arrived[:, None]),
    }
    return {name: np.where(present, term, 0.0) for name, term in terms.items()}
