"""``nearest_target``: searches a box for silent targets, and follows the nearest that no other vehicle is nearer to.

It tracks one target, which it remembers for a while after its last detection, moving on. Without one it searches:
straight on with reflection at the sides of the box, to and fro in lanes, one for each vehicle, or where its map is
unsearched. Pushes among near neighbours and the safety filter are as in ``scout``.
"""

import dataclasses
import math
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from uuv_marl.baselines.memory.pose import to_map, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings, with_surroundings
from uuv_marl.baselines.policy import PolicyError
from uuv_marl.baselines.requirements import with_parameters
from uuv_marl.baselines.safety.barrier import Barrier, Steering, planes_of, steer_safely
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.controller import pushed
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.views import fields
from uuv_marl.tasks.unsearched import place_in_box
from uuv_marl.types import Bool, Float32, Float64


class SeekerGains(NamedTuple):
    """Free parameters. The defaults were found by hand; the policy has tuned ones."""

    speed: float = 5.0  # of a search [m/s]
    rate: float = 0.5  # speed towards the target, beside its own, over the distance to the point behind it [1/s]
    stay_m: float = 12.0  # distance to keep from the target [m]
    claim_m: float = 45.0  # a target is another vehicle's if that one is nearer to it, and within this distance [m]
    lost_s: float = 8.0  # time for which an undetected target is followed [s]
    edge_m: float = 60.0  # distance from the box's side at which a search turns back [m]
    push: float = 10.0  # away from a neighbour at distance 0 [m/s]
    push_range: float = 12.0  # distance at which pushes end [m]
    steering: float = 1.0  # factor of the force that follows the desired velocity [1]


class TrackedTarget(NamedTuple):
    """The target that a vehicle follows, in its map, and its search."""

    target: Annotated[Float64, "world vehicle 4", "Position [m] and velocity [m/s] of its target."]
    track_timeout_s: Annotated[Float64, "world vehicle", "Time left to follow it without detection [s]."]
    search: Annotated[Float64, "world vehicle 2", "Direction of its search in the box; in lanes, of x, and the lane."]


SeekerMemory = with_surroundings("SeekerMemory", TrackedTarget)
_ALPHA, _BETA = 0.8, 0.5  # gains by which an echo corrects a target's position and velocity [1]. Assumed.
_GATE_M, _GATE_MPS = 8.0, 4.0
"""Distance from the predicted target within which an echo is its own, and its growth with the time undetected.
Assumed."""
_SILENT_S, _GOES_MPS = 1.2, 0.5
"""Time undetected after which a vehicle moves to the target; speed from which it stays behind it. Assumed."""
_AHEAD_M = 40.0  # distance ahead at which a vehicle returns to its lane [m]. Assumed.
_RING_PULLS = (2.0, 0.5)
"""Pull of a near and of a far unsearched octant, over that of the bow [1]. Found by hand on 32 maps."""


class NearestTarget(Filtered):
    """Search a box, then stay near the nearest detected target that no other vehicle is nearer to.

    With ``lanes`` each vehicle searches in its own lane across the box, with ``unsearched`` in the direction of most
    unsearched octants, else straight on; ``gains`` and ``barrier`` replace those tuned for this search. Raises
    PolicyError if the scenario's task has no box, or both are given.
    """

    Memory: ClassVar[type[Any] | None] = SeekerMemory
    Gains = SeekerGains
    tuned_as = "nearest_target"
    requirements = Filtered.requirements._replace(channels_if={"lanes": ["identity"], "unsearched": ["unsearched"]})

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, lanes: bool = False, unsearched: bool = False,
        gains: SeekerGains | None = None, barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        if lanes and unsearched:
            raise PolicyError("lanes and unsearched are both true; leave one out")
        self.requirements = with_parameters(self.requirements, ["lanes"] * lanes + ["unsearched"] * unsearched)
        tuned_for = "lanes" if lanes or unsearched else ""
        super().__init__(scenario, num_worlds, tuned_for=tuned_for, gains=gains, barrier=barrier)
        if "box" not in self.layout.starts:
            raise PolicyError(
                f"nearest_target searches a box, which task {scenario.task.name!r} does not have; run it on "
                "silent_targets"
            )
        self._half_m = 0.5 * scenario.task_numbers.side_m
        self._lanes = scenario.swarm.num_vehicles if lanes else 0
        self._unsearched = unsearched
        self._track = TrackedTarget(*self.own)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update tracks from the echoes, and the surroundings without echoes, since targets are not obstacles."""
        seen = dataclasses.replace(percept, flat=percept.flat.copy())
        for name in ("echo", "echo_range", "echo_position"):
            seen[name][:] = 0.0
        super().remember(seen, worlds)
        update_tracks(
            self.flat(percept), self.layout.offsets, worlds, percept["box"], self.safe.period, self._half_m,
            self._lanes, self.float_gains, self.surroundings, self._track,
        )  # fmt: skip

    def _write(self, percept: Percept, action: Float32) -> None:
        gains = self.float_gains
        shares = percept["unsearched"] if self._unsearched else np.zeros((*action.shape[:2], 0, 0), np.float32)
        seek(
            self.flat(percept), self.layout.offsets, self.active, percept["box"], shares, self._half_m, self._lanes,
            gains, self.safe._replace(gain=self._gain * gains.steering), self.surroundings, self._track, action,
        )  # fmt: skip


@compiled
def claimed(w: int, i: int, x: float, y: float, claim_m: float, memory: Surroundings) -> bool:
    """Whether another vehicle is nearer to a target at (x, y) in the map, and within ``claim_m``."""
    least = min(math.hypot(memory.pose[w, i, 0] - x, memory.pose[w, i, 1] - y), claim_m)
    for k in range(memory.known.shape[2]):
        if (
            memory.known[w, i, k] > 0.0
            and math.hypot(memory.place[w, i, k, 0] - x, memory.place[w, i, k, 1] - y) < least
        ):
            return True
    return False


@compiled
def _detected_target(
    w: int, i: int, gate: float, see: Fields, g: SeekerGains, memory: Surroundings, track: TrackedTarget
) -> tuple[float, float, bool]:
    """Position in the map of the detected target to follow [m], and whether one exists.

    ``gate``: largest distance from its predicted position [m]; infinite where no target is tracked.
    """
    pose, (x, y, is_detected), best = memory.pose[w, i], (0.0, 0.0, False), gate
    from_x, from_y = (pose[0], pose[1]) if gate == math.inf else (track.target[w, i, 0], track.target[w, i, 1])
    for a in range(see.echo.shape[2]):
        if see.echo[w, i, a] > 0.0:
            p_x, p_y = to_map(see.echo_position[w, i, a, 0], see.echo_position[w, i, a, 1], pose)
            far = math.hypot(p_x - from_x, p_y - from_y)
            if far < best and not claimed(w, i, p_x, p_y, g.claim_m, memory):
                best, x, y, is_detected = far, p_x, p_y, True
    return x, y, is_detected


@compiled
def update_tracks(
    flat: Float32, at: Starts, worlds: Bool, box: Float32, period: float, half_m: float, lanes: int, g: SeekerGains,
    memory: Surroundings, track: TrackedTarget,
) -> None:  # fmt: skip
    """Update tracks with the echoes, all of which are targets', and turn searches back."""
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1] if worlds[w] else 0):
            if memory.begun[w, i] == 0.0:
                continue
            goal = track.target[w, i]
            goal[0], goal[1] = goal[0] + period * goal[2], goal[1] + period * goal[3]
            track.track_timeout_s[w, i] -= period
            since, follows = g.lost_s - track.track_timeout_s[w, i], track.track_timeout_s[w, i] > 0.0
            gate = _GATE_M + _GATE_MPS * since if follows else math.inf
            x, y, is_detected = _detected_target(w, i, gate, see, g, memory, track)
            if is_detected and follows:
                d_x, d_y = x - goal[0], y - goal[1]
                goal[0], goal[1] = goal[0] + _ALPHA * d_x, goal[1] + _ALPHA * d_y
                goal[2], goal[3] = goal[2] + _BETA * d_x / since, goal[3] + _BETA * d_y / since
            elif is_detected:
                goal[0], goal[1], goal[2], goal[3] = x, y, 0.0, 0.0
            if is_detected:
                track.track_timeout_s[w, i] = g.lost_s
            elif follows and claimed(w, i, goal[0], goal[1], g.claim_m, memory):
                track.track_timeout_s[w, i] = 0.0
            _turn_back(w, i, half_m - g.edge_m, lanes, see, box, track)


@compiled
def _turn_back(w: int, i: int, most: float, lanes: int, see: Fields, box: Float32, track: TrackedTarget) -> None:
    """Begin a search along the bow or the lane; beyond ``most`` from the centre [m], reflect it or change the lane."""
    search = track.search[w, i]
    if search[0] == 0.0 and search[1] == 0.0:
        search[0], search[1] = float(box[w, i, 0]), float(box[w, i, 1])
        if lanes:
            lane = round(float(see.identity[w, i, 0]) * lanes - 0.5)
            search[0], search[1] = (1.0 if lane % 2 == 0 else -1.0), lane + 0.5
    place = place_in_box(see.reference[w, i], box[w, i])
    for k in range(1 if lanes else 2):
        if abs(place[k]) > most and place[k] * search[k] > 0.0:
            search[k] = -search[k]
            if lanes:
                search[1] = (search[1] + 1.0) % lanes


@compiled
def _to_unsearched(speed: float, shares: Float32) -> tuple[float, float]:
    """Velocity in the body frame [m/s] ahead and to octants, by the cubes of their shares, (ring, octant)."""
    x, y = 1.0, 0.0
    for k in range(shares.shape[1]):
        c, s = cos_sin((k + 0.5) * 2.0 * math.pi / shares.shape[1])
        pull = 0.0
        for r in range(shares.shape[0]):
            share = float(shares[r, k])
            pull += _RING_PULLS[r] * share * share * share
        x, y = x + pull * c, y + pull * s
    size = max(math.hypot(x, y), 1e-6)
    return speed * x / size, speed * y / size


@compiled
def _searching(
    w: int, i: int, half_m: float, lanes: int, see: Fields, box: Float32, shares: Float32, speed: float,
    memory: Surroundings, track: TrackedTarget,
) -> tuple[float, float]:  # fmt: skip
    """Desired velocity of a search, in the map [m/s]."""
    if shares.shape[2] > 0:
        x, y = _to_unsearched(speed, shares[w, i])
        return to_map_axes(x, y, memory.pose[w, i])
    x, y = track.search[w, i, 0], track.search[w, i, 1]
    if lanes:
        off = (2.0 * y / lanes - 1.0) * half_m - place_in_box(see.reference[w, i], box[w, i])[1]
        far = math.hypot(_AHEAD_M, off)
        x, y = x * _AHEAD_M / far, off / far
    c, s = float(box[w, i, 0]), float(box[w, i, 1])
    return to_map_axes(speed * (c * x + s * y), speed * (c * y - s * x), memory.pose[w, i])


@compiled
def _following(w: int, i: int, g: SeekerGains, memory: Surroundings, track: TrackedTarget) -> tuple[float, float]:
    """Desired velocity behind the target, or to one that is not detected, in the map [m/s]."""
    goal, pose = track.target[w, i], memory.pose[w, i]
    x, y, v_x, v_y = goal[0] - pose[0], goal[1] - pose[1], goal[2], goal[3]
    b_x, b_y = (v_x, v_y) if math.hypot(v_x, v_y) > _GOES_MPS else (x, y)
    stay = g.stay_m if track.track_timeout_s[w, i] > g.lost_s - _SILENT_S else 0.0
    stay /= max(math.hypot(b_x, b_y), 1e-6)
    return v_x + g.rate * (x - stay * b_x), v_y + g.rate * (y - stay * b_y)


@compiled
def seek(
    flat: Float32, at: Starts, worlds: Bool, box: Float32, shares: Float32, half_m: float, lanes: int, g: SeekerGains,
    safe: Steering, memory: Surroundings, track: TrackedTarget, action: Float32,
) -> None:  # fmt: skip
    """Write every vehicle's action."""
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                if track.track_timeout_s[w, i] > 0.0:
                    w_x, w_y = _following(w, i, g, memory, track)
                else:
                    w_x, w_y = _searching(w, i, half_m, lanes, see, box, shares, g.speed, memory, track)
                w_x, w_y = pushed(w_x, w_y, w, i, g.push, g.push_range, memory)
                num = planes_of(w, i, safe, memory)
                steer_safely(w, i, w_x, w_y, num, safe, memory, action)
