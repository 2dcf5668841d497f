"""Leaders that broadcast: informed vehicles send how far l(t) has moved, and every vehicle moves as far.

A message holds l(t)'s displacement since the start, its velocity and the age of this information. Each
vehicle keeps the newest, extrapolates it, and sends it on in its own slots, so that it reaches vehicles beyond
``modem.range_m`` over several others. By dead reckoning the vehicle keeps its place relative to l(t), a virtual leader
(Leonard and Fiorelli, Virtual leaders, artificial potentials and coordinated control of groups, CDC 2001); before the
first message it follows its neighbours as ``leader_follower`` does, whose pushes and safety filter it has.
"""

import math
from typing import Annotated, Any, ClassVar, NamedTuple

from uuv_marl.baselines.comparators.leader_follower import (
    LeaderFollower,
    LeaderFollowerGains,
    at_most,
    following,
    leading,
    remembered,
)
from uuv_marl.baselines.memory.pose import to_body_axes, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings, with_surroundings
from uuv_marl.baselines.safety.barrier import Steering, planes_of, steer_safely
from uuv_marl.baselines.scout.controller import modulated, pushed
from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32, Float64

_FAR_M, _FAST_MPS, _OLD_S = 1024.0, 8.0, 128.0
"""Displacement, speed and age at which a message's entries saturate. Assumed: beyond those of the shipped tasks."""


class ToldReference(NamedTuple):
    """What a vehicle knows of l(t), by its own sensor or by messages."""

    told: Annotated[Float64, "world vehicle 4", "Displacement since the start [m] and velocity [m/s], in its map."]
    told_age_s: Annotated[Float64, "world vehicle", "Age of this information [s]; 0 before any."]
    is_told: Annotated[Float64, "world vehicle", "1 once it has any."]


LeaderBroadcastMemory = with_surroundings("LeaderBroadcastMemory", ToldReference)


class LeaderBroadcast(LeaderFollower):
    """Every vehicle keeps its place relative to l(t), whose motion the informed broadcast."""

    tuned_as = "leader_broadcast"
    Memory: ClassVar[type[Any] | None] = LeaderBroadcastMemory
    requirements = LeaderFollower.requirements._replace(channels=("messages",), message_entries=5, message_vectors=2)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the surroundings, and what is known of l(t)."""
        super().remember(percept, worlds)
        update_told(
            worlds, self.safe.period, self.leads(percept), percept["message_valid"], percept["message"],
            percept["message_age"], self.surroundings, ToldReference(*self.own),
        )  # fmt: skip

    def _write(self, percept: Percept, action: Float32) -> None:
        told = ToldReference(*self.own)
        act(self.leads(percept), self.active, self.float_gains, self.safe, self.surroundings, told, action)


@compiled
def update_told(
    worlds: Bool, period: float, leads: Float32, valid: Float32, message: Float32, age: Float32, memory: Surroundings,
    told: ToldReference,
) -> None:  # fmt: skip
    """Extrapolate what vehicles know of l(t), and replace it by newer messages, or by what the informed perceive."""
    for w in range(leads.shape[0]):
        for i in range(leads.shape[1] if worlds[w] else 0):
            known, pose = told.told[w, i], memory.pose[w, i]
            known[0], known[1] = known[0] + period * known[2], known[1] + period * known[3]
            told.told_age_s[w, i] += period
            if leads[w, i, 0] > 0.0:
                at, speed = memory.reference[w, i], memory.reference_speed[w, i]
                known[0], known[1], known[2], known[3] = at[0], at[1], speed * at[2], speed * at[3]
                told.told_age_s[w, i], told.is_told[w, i] = 0.0, 1.0
            for r in range(valid.shape[2]):
                old_s = age[w, i, r] + 0.5 * _OLD_S * (message[w, i, r, 4] + 1.0)
                newer = told.is_told[w, i] == 0.0 or old_s < told.told_age_s[w, i] - period
                if valid[w, i, r] > 0.0 and message[w, i, r, 4] < 1.0 and newer:
                    x, y = to_map_axes(message[w, i, r, 0], message[w, i, r, 1], pose)
                    v_x, v_y = to_map_axes(message[w, i, r, 2], message[w, i, r, 3], pose)
                    known[2], known[3] = _FAST_MPS * v_x, _FAST_MPS * v_y
                    known[0], known[1] = _FAR_M * x + age[w, i, r] * known[2], _FAR_M * y + age[w, i, r] * known[3]
                    told.told_age_s[w, i], told.is_told[w, i] = old_s, 1.0


@compiled
def act(
    leads: Float32, worlds: Bool, g: LeaderFollowerGains, safe: Steering, memory: Surroundings,
    told: ToldReference, action: Float32,
) -> None:  # fmt: skip
    """Write every vehicle's action and message."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                pose, known = memory.pose[w, i], told.told[w, i]
                x, y = g.pull * (known[0] - pose[0]), g.pull * (known[1] - pose[1])
                move_as_told(w, i, leads, told.is_told[w, i], (known[2] + x, known[3] + y), g, safe, memory, action)
                x, y = to_body_axes(known[0] / _FAR_M, known[1] / _FAR_M, pose)
                v_x, v_y = to_body_axes(known[2] / _FAST_MPS, known[3] / _FAST_MPS, pose)
                action[w, i, 2], action[w, i, 3], action[w, i, 4], action[w, i, 5] = x, y, v_x, v_y
                old_s = told.told_age_s[w, i] if told.is_told[w, i] > 0.0 else math.inf
                action[w, i, 6] = min(2.0 * old_s / _OLD_S, 2.0) - 1.0


@compiled
def move_as_told(
    w: int, i: int, leads: Float32, is_told: float, velocity: tuple[float, float], g: LeaderFollowerGains,
    safe: Steering, memory: Surroundings, action: Float32,
) -> None:  # fmt: skip
    """Write a vehicle's forces: it leads if it is informed, moves with ``velocity`` [m/s] if told, or follows."""
    others = remembered(w, i, g, memory)
    if leads[w, i, 0] > 0.0:
        w_x, w_y = leading(w, i, others, g, memory)
    elif is_told > 0.0:
        w_x, w_y = at_most(velocity[0], velocity[1], g.speed)
        x, y = at_most(g.gather * others[2], g.gather * others[3], g.gather_mps)
        w_x, w_y = w_x + x, w_y + y
    else:
        w_x, w_y = following(others, g)
    w_x, w_y = pushed(w_x, w_y, w, i, g.push, g.push_range, memory)
    w_x, w_y = modulated(w_x, w_y, w, i, safe.barrier, memory)
    steer_safely(w, i, w_x, w_y, planes_of(w, i, safe, memory), safe, memory, action)
