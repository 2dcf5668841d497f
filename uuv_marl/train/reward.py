"""What training is paid: from the truth, which the actor never knows.

In the task ``follow`` this takes the place of the environment's own reward (``uuv_marl.tasks.follow``), which is made
to be sound and to compare; here the weights are steeper, and our own. In other tasks a training is paid what they pay.
"""

from typing import NamedTuple

import numpy as np

from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float64


class Weights(NamedTuple):
    """Weights of the terms of one decision of 0.5 s; shorter ones are paid in proportion, collisions whole."""

    distance_m: float = 35.0
    """A vehicle pays its distance to l(t) over this [m]; 1e9: nothing."""
    centre: float = 0.4
    """Pay per metre of a vehicle's ``lead_over_swarm``."""
    obstacle: float = 28.0
    obstacle_m: float = 30.0
    """Clearance c below ``obstacle_m`` costs obstacle x (1 - c / obstacle_m)^2."""
    spacing: float = 28.0
    spacing_m: float = 12.0
    """Distance to the nearest vehicle below which it costs so, too: a linear term's mean would hide rare close ones."""
    collision: float = 8.0
    """Cost of each contact that begins."""
    effort: float = 0.02
    """Cost of the squared action."""
    team: float = 0.0
    """All vehicles pay this for each metre from the swarm's centre to l(t), up to 60 m."""
    team_s: float = 1e9
    """The cost ``team`` is the less, the longer l(t) still moves: by exp(-time left / team_s) [s]."""
    astray_m: float = 1e9
    """A vehicle pays 1 where it is twice as far from l(t), nothing up to here, and at most 3 [m]."""
    late: float = 0.0
    """All vehicles pay this while l(t) rests and the swarm has not arrived; less, by up to two thirds, where the
    swarm's centre is within about 4 m of the end."""

    def __call__(self, swarm: Swarm) -> Float64:
        """The reward of the latest decision, shape (world, vehicle)."""
        return shaped_reward(swarm, self)


def shaped_reward(swarm: Swarm, by: Weights) -> Float64:
    """The reward of the latest decision, shape (world, vehicle)."""
    facts, share = swarm.facts, swarm.scenario.timing.decision_period_s / 0.5
    away = facts.away
    near = np.clip(1.0 - facts.clearance / by.obstacle_m, 0.0, 1.5)
    close = np.clip(1.0 - facts.spacing / by.spacing_m, 0.0, 1.0)
    rate = (
        -np.minimum(away, 300.0) / by.distance_m
        + (by.centre * np.clip(lead_over_swarm(swarm), -100.0, 100.0) if by.centre else 0.0)
        - by.obstacle * near * near
        - by.spacing * close * close
        - by.effort * facts.effort
        - np.clip(away / by.astray_m - 1.0, 0.0, 3.0)
    )
    if by.team or by.late:
        rate = rate - _shared(swarm, by)[:, None]
    return share * rate - by.collision * facts.contacts


def _shared(swarm: Swarm, by: Weights) -> Float64:
    """What all vehicles of a world pay for where their centre is, shape (world,)."""
    facts = swarm.facts
    error = np.hypot(*(facts.centre - swarm.mean_reference[:, :2]).T)
    left = np.maximum(swarm.duration_s - facts.time_s, 0.0)
    far, astray = np.minimum(error, 60.0), 1.0 - 2.0 / 3.0 * np.exp(-error / 4.0)
    return by.team * np.exp(-left / by.team_s) * far + by.late * (left == 0.0) * astray


def lead_over_swarm(swarm: Swarm) -> Float64:
    """How far a vehicle is ahead of the swarm's centre, on the way that the centre has to go [m], (world, vehicle).

    To first order a difference reward (Wolpert and Tumer 2002): n times what the vehicle does for the centre. From a
    shared centre error each would get 1/n of that, which its own noise hides. The whole difference also pays for being
    far from the centre, whatever the direction, and so spreads the swarm; this one sums to zero. Fades within 2 m.
    """
    error = swarm.facts.centre - swarm.mean_reference[:, :2]
    way = -error / np.sqrt(np.sum(error * error, axis=-1, keepdims=True) + 4.0)
    return np.sum((swarm.state.eta[:, :, :2] - swarm.facts.centre[:, None]) * way[:, None], axis=-1)
