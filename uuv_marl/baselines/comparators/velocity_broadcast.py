"""Leaders that broadcast a velocity: every vehicle moves with that of l(t), as it was told last, and repeats it.

A message holds the velocity of l(t) and whether the sender knows it. Vehicles stay together by the pull to their
neighbours' mean position; unlike in ``leader_broadcast`` nothing corrects a displacement. Informed vehicles lead, and
vehicles that have heard nothing follow their neighbours, as in ``leader_follower``. A message is read and repeated
without a memory of older ones, and an error in it does not accumulate over distance, so that networks can imitate it.
Consensus on a heading by exchange is that of Jadbabaie, Lin and Morse, IEEE Transactions on Automatic Control 48(6),
2003; repeating the latest message instead of averaging is ours.
"""

from typing import Annotated, Any, ClassVar, NamedTuple

from uuv_marl.baselines.comparators.leader_broadcast import move_as_told
from uuv_marl.baselines.comparators.leader_follower import LeaderFollower, LeaderFollowerGains
from uuv_marl.baselines.memory.pose import to_body_axes, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings, with_surroundings
from uuv_marl.baselines.safety.barrier import Steering
from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32, Float64

_FAST_MPS = 5.0
"""Speed at which a message's entries saturate. Assumed: above those of l(t) in the shipped tasks."""


class ToldVelocity(NamedTuple):
    """What a vehicle knows of l(t), by its own sensor or by messages."""

    told: Annotated[Float64, "world vehicle 2", "Velocity [m/s], in its map."]
    is_told: Annotated[Float64, "world vehicle", "1 once it has any."]


VelocityBroadcastMemory = with_surroundings("VelocityBroadcastMemory", ToldVelocity)


class VelocityBroadcast(LeaderFollower):
    """Every vehicle moves with the velocity of l(t), which the informed broadcast and the others repeat."""

    tuned_as = "leader_broadcast"
    Memory: ClassVar[type[Any] | None] = VelocityBroadcastMemory
    requirements = LeaderFollower.requirements._replace(channels=("messages",), message_entries=3, message_vectors=1)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the surroundings, and what is known of l(t)."""
        super().remember(percept, worlds)
        _update_told(
            worlds, self.leads(percept), percept["message_valid"], percept["message"], self.surroundings,
            ToldVelocity(*self.own),
        )  # fmt: skip

    def _write(self, percept: Percept, action: Float32) -> None:
        told = ToldVelocity(*self.own)
        _act(self.leads(percept), self.active, self.float_gains, self.safe, self.surroundings, told, action)


@compiled
def _update_told(
    worlds: Bool, leads: Float32, valid: Float32, message: Float32, memory: Surroundings, told: ToldVelocity
) -> None:
    """Replace what vehicles know of l(t) by their own perception, or by the latest message of one that knows."""
    for w in range(leads.shape[0]):
        for i in range(leads.shape[1] if worlds[w] else 0):
            if leads[w, i, 0] > 0.0:
                leg, speed = memory.reference[w, i], memory.reference_speed[w, i]
                told.told[w, i, 0], told.told[w, i, 1], told.is_told[w, i] = speed * leg[2], speed * leg[3], 1.0
                continue
            for r in range(valid.shape[2]):
                if valid[w, i, r] > 0.0 and message[w, i, r, 2] > 0.0:
                    x, y = to_map_axes(message[w, i, r, 0], message[w, i, r, 1], memory.pose[w, i])
                    told.told[w, i, 0], told.told[w, i, 1] = _FAST_MPS * x, _FAST_MPS * y
                    told.is_told[w, i] = 1.0
                    break


@compiled
def _act(
    leads: Float32, worlds: Bool, g: LeaderFollowerGains, safe: Steering, memory: Surroundings, told: ToldVelocity,
    action: Float32,
) -> None:  # fmt: skip
    """Write every vehicle's action and message."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                velocity, is_told = (told.told[w, i, 0], told.told[w, i, 1]), told.is_told[w, i]
                move_as_told(w, i, leads, is_told, velocity, g, safe, memory, action)
                x, y = to_body_axes(velocity[0] / _FAST_MPS, velocity[1] / _FAST_MPS, memory.pose[w, i])
                action[w, i, 2], action[w, i, 3], action[w, i, 4] = x, y, 2.0 * is_told - 1.0
