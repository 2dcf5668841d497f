"""Leader and follower by sonar: who does not perceive l(t) goes with whom it hears, and who does waits for them.

A follower wishes for a little more than the mean velocity of the neighbours that it remembers, nearer ones counting
more, and to their mean place. A leader goes to l(t), slower the farther it is ahead of the mean place of those that it
remembers. Both are pushed off near neighbours, bent round obstacles and made safe as ``scout``'s. So
informed individuals lead groups in Couzin, Krause, Franks and Levin, Effective leadership and decision-making in animal
groups on the move, Nature 433, 2005; waiting is ours.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.policy import Limits, tuned
from uuv_marl.baselines.safety.barrier import Barrier, planes_of, steer_safely, with_numbers
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.controller import modulated, pushed
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32, Float64


class LeaderFollowerGains(NamedTuple):
    """Free parameters. Those by default were found by hand; the policy has tuned ones."""

    follow: float = 1.05
    """Factor of the neighbours' mean velocity [1]: above 1, or a swarm comes to rest by following itself."""
    near: float = 15.0
    """Their velocities count as e^(-distance / near) [m]."""
    sightings: float = 3.0
    """Their velocities count once they were heard so often [1]."""
    gather: float = 0.4
    """A follower's pull to their mean place [1/s]."""
    gather_mps: float = 1.5
    """The largest of these pulls [m/s]."""
    pull: float = 0.15
    """A leader's pull to l(t) [1/s]."""
    ahead: float = 12.0
    """A leader slows where it is farther ahead of their mean place [m]."""
    stop: float = 37.0
    """And stops here, to go back beyond [m]."""
    speed: float = 4.0
    """Largest speed that a leader wishes, but for pushes [m/s]."""
    cruise: float = 4.0
    """Largest that a follower wishes, but for gathering and pushes [m/s]; a large ``follow`` keeps a swarm at it."""
    push: float = 10.0
    """Away from a neighbour at no distance [m/s]."""
    push_range: float = 15.0
    """Where pushes end [m]."""
    memory_s: float = 3.0
    """For how long a neighbour is remembered that is heard no more [s]."""


_BACK = -0.3
"""A leader that is too far ahead goes back at most at this share of its speed [1]. Assumed."""


class LeaderFollower(Filtered):
    """Who perceives l(t) leads and waits; the others go with whom they hear, by remembered positions alone."""

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, gains: LeaderFollowerGains | None = None,
        barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        own_gains, own_barrier = with_numbers(tuned("leader_follower"), LeaderFollowerGains(), Barrier())
        super().__init__(scenario, num_worlds, barrier or own_barrier)
        self.gains = gains or own_gains

    @property
    def memory_s(self) -> float:
        """For how long a neighbour is remembered that is heard no more [s]."""
        return float(self.gains.memory_s)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        flat = self.flat(percept)
        leads = percept["informed"] if "informed" in percept.names else np.ones((*flat.shape[:2], 1), np.float32)
        action = np.zeros((*flat.shape[:2], 2), np.float32)
        _act(
            leads, self.active, self.model.own.period_s, LeaderFollowerGains(*map(float, self.gains)), self.barrier,
            self.limits, self.gain, self.memory, self.planes, action,
        )  # fmt: skip
        return action


class NeighbourSummary(NamedTuple):
    """What a vehicle makes of its neighbours, along its map's axes."""

    v_x: float
    v_y: float
    """Their mean velocity [m/s]."""
    x: float
    y: float
    """Their mean place from the vehicle [m]."""


@compiled
def remembered(w: int, i: int, g: LeaderFollowerGains, memory: Surroundings) -> NeighbourSummary:
    """What it makes of those that it remembers."""
    v_x, v_y, weights, x, y, num = 0.0, 0.0, 1e-9, 0.0, 0.0, 0
    for k in range(memory.known.shape[2]):
        if memory.known[w, i, k] > 0.0:
            x, y = (
                x + memory.place[w, i, k, 0] - memory.pose[w, i, 0],
                y + memory.place[w, i, k, 1] - memory.pose[w, i, 1],
            )
            num += 1
            if memory.known[w, i, k] >= g.sightings:
                weight = math.exp(-memory.away[w, i, k] / g.near)
                v_x, v_y = v_x + weight * memory.velocity[w, i, k, 0], v_y + weight * memory.velocity[w, i, k, 1]
                weights += weight
    return NeighbourSummary(v_x / weights, v_y / weights, x / max(num, 1), y / max(num, 1))


@compiled
def at_most(x: float, y: float, length: float) -> tuple[float, float]:
    """A vector no longer than that."""
    share = min(length / max(math.hypot(x, y), 1e-9), 1.0)
    return share * x, share * y


@compiled
def _following(others: NeighbourSummary, g: LeaderFollowerGains) -> tuple[float, float]:
    """The velocity that a follower wishes [m/s]."""
    w_x, w_y = at_most(g.follow * others.v_x, g.follow * others.v_y, g.cruise)
    g_x, g_y = at_most(g.gather * others.x, g.gather * others.y, g.gather_mps)
    return w_x + g_x, w_y + g_y


@compiled
def _leading(
    w: int, i: int, others: NeighbourSummary, g: LeaderFollowerGains, memory: Surroundings
) -> tuple[float, float]:
    """The velocity that a leader wishes [m/s]."""
    at, speed = memory.reference[w, i], memory.reference_speed[w, i]
    to_x, to_y = at[0] - memory.pose[w, i, 0], at[1] - memory.pose[w, i, 1]
    w_x, w_y = at_most(speed * at[2] + g.pull * to_x, speed * at[3] + g.pull * to_y, g.speed)
    ahead = -(others.x * to_x + others.y * to_y) / max(math.hypot(to_x, to_y), 1e-6)
    share = min(max(1.0 - (ahead - g.ahead) / max(g.stop - g.ahead, 1e-6), _BACK), 1.0)
    return share * w_x, share * w_y


@compiled
def _act(
    leads: Float32, worlds: Bool, period: float, g: LeaderFollowerGains, barrier: Barrier, limits: Limits, gain: float,
    memory: Surroundings, planes: Float64, action: Float32,
) -> None:  # fmt: skip
    """The law for every vehicle; ``leads`` has shape (world, vehicle, 1)."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                others = remembered(w, i, g, memory)
                desired = _leading(w, i, others, g, memory) if leads[w, i, 0] > 0.0 else _following(others, g)
                w_x, w_y = pushed(desired[0], desired[1], w, i, g.push, g.push_range, memory)
                w_x, w_y = modulated(w_x, w_y, w, i, barrier, memory)
                num = planes_of(w, i, period, barrier, memory, planes)
                steer_safely(w, i, w_x, w_y, num, planes, gain, limits, memory, action)
