"""Leader and followers by sonar: informed vehicles lead and wait, the others follow their neighbours.

A follower's desired velocity is a little more than the mean velocity of the neighbours in its memory, near ones
weighing more, and a pull to their mean position. A leader moves to l(t), slower the farther it is ahead of that mean
position. Both are pushed off near neighbours, bent around obstacles and made safe as ``scout`` is. Informed individuals
lead groups in this way in Couzin, Krause, Franks and Levin, Effective leadership and decision-making in animal groups
on the move, Nature 433, 2005; waiting is added here.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.safety.barrier import Steering, planes_of, steer_safely
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.controller import modulated, pushed
from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32


class LeaderFollowerGains(NamedTuple):
    """Free parameters. The defaults were found by hand; the policy has tuned ones."""

    # factor of the neighbours' mean velocity [1]; at 1 and below a swarm comes to rest by following itself
    follow: float = 1.05
    near: float = 15.0  # their velocities are weighted by e^(-distance / near) [m]
    sightings: float = 3.0  # number of detections from which their velocities count [1]
    gather: float = 0.4  # a follower's pull to their mean position [1/s]
    gather_mps: float = 1.5  # largest such pull [m/s]
    pull: float = 0.15  # a leader's pull to l(t) [1/s]
    ahead: float = 12.0  # a leader slows where it is farther ahead of their mean position [m]
    stop: float = 37.0  # distance ahead at which it stops; beyond, it moves back [m]
    speed: float = 4.0  # a leader's largest desired speed, without pushes [m/s]
    cruise: float = 4.0  # a follower's, without gathering and pushes [m/s]; a large ``follow`` holds a swarm at it
    push: float = 10.0  # away from a neighbour at distance 0 [m/s]
    push_range: float = 15.0  # distance at which pushes end [m]
    memory_s: float = 3.0  # time for which an undetected neighbour is remembered [s]


_BACK = -0.3  # largest speed back of a leader that is too far ahead, as a share of its speed [1]. Assumed.


class LeaderFollower(Filtered):
    """Informed vehicles lead and wait; the others follow their neighbours, from remembered positions alone."""

    Gains = LeaderFollowerGains
    tuned_as = "leader_follower"

    @staticmethod
    def leads(percept: Percept) -> Float32:
        """1 for informed vehicles, all where there is no such field, shape (world, vehicle, 1)."""
        return percept["informed"] if "informed" in percept.names else np.ones_like(percept["yaw_rate"])

    def _write(self, percept: Percept, action: Float32) -> None:
        _act(self.leads(percept), self.active, self.float_gains, self.safe, self.surroundings, action)


Others = tuple[float, float, float, float]
"""Mean velocity [m/s] of a vehicle's neighbours, and mean position from it [m], in its map."""


@compiled
def remembered(w: int, i: int, g: LeaderFollowerGains, memory: Surroundings) -> Others:
    """Means of the neighbours in a vehicle's memory."""
    v_x, v_y, weights, x, y, num = 0.0, 0.0, 1e-9, 0.0, 0.0, 0
    for k in range(memory.known.shape[2]):
        if memory.known[w, i, k] > 0.0:
            x, num = x + memory.place[w, i, k, 0] - memory.pose[w, i, 0], num + 1
            y = y + memory.place[w, i, k, 1] - memory.pose[w, i, 1]
            if memory.known[w, i, k] >= g.sightings:
                weight = math.exp(-memory.away[w, i, k] / g.near)
                v_x, v_y = v_x + weight * memory.velocity[w, i, k, 0], v_y + weight * memory.velocity[w, i, k, 1]
                weights += weight
    return v_x / weights, v_y / weights, x / max(num, 1), y / max(num, 1)


@compiled
def at_most(x: float, y: float, length: float) -> tuple[float, float]:
    """The vector, shortened to a length if it is longer."""
    share = min(length / max(math.hypot(x, y), 1e-9), 1.0)
    return share * x, share * y


@compiled
def following(others: Others, g: LeaderFollowerGains) -> tuple[float, float]:
    """Desired velocity of a follower [m/s]."""
    v_x, v_y, x, y = others
    w_x, w_y = at_most(g.follow * v_x, g.follow * v_y, g.cruise)
    g_x, g_y = at_most(g.gather * x, g.gather * y, g.gather_mps)
    return w_x + g_x, w_y + g_y


@compiled
def leading(w: int, i: int, others: Others, g: LeaderFollowerGains, memory: Surroundings) -> tuple[float, float]:
    """Desired velocity of a leader [m/s]."""
    at, speed = memory.reference[w, i], memory.reference_speed[w, i]
    to_x, to_y = at[0] - memory.pose[w, i, 0], at[1] - memory.pose[w, i, 1]
    w_x, w_y = at_most(speed * at[2] + g.pull * to_x, speed * at[3] + g.pull * to_y, g.speed)
    ahead = -(others[2] * to_x + others[3] * to_y) / max(math.hypot(to_x, to_y), 1e-6)
    share = min(max(1.0 - (ahead - g.ahead) / max(g.stop - g.ahead, 1e-6), _BACK), 1.0)
    return share * w_x, share * w_y


@compiled
def _act(
    leads: Float32, worlds: Bool, g: LeaderFollowerGains, safe: Steering, memory: Surroundings, action: Float32
) -> None:
    """Write every vehicle's action. ``leads`` has shape (world, vehicle, 1)."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                others = remembered(w, i, g, memory)
                desired = leading(w, i, others, g, memory) if leads[w, i, 0] > 0.0 else following(others, g)
                w_x, w_y = pushed(desired[0], desired[1], w, i, g.push, g.push_range, memory)
                w_x, w_y = modulated(w_x, w_y, w, i, safe.barrier, memory)
                num = planes_of(w, i, safe, memory)
                steer_safely(w, i, w_x, w_y, num, safe, memory, action)
