"""Events on a replay's time line: collisions, near misses, losses and the arrival."""

import numpy as np

from uuv_marl.replay.recording import Event
from uuv_marl.types import Bool, Float32, Int32

REARM_S = 2.0
"""Time for which a vehicle must keep its distance before its next near miss counts [s]."""


def near_misses(kind: str, time_s: Float32, below: Bool) -> list[Event]:
    """An event for each sample at which near misses begin, with these vehicles.

    ``below`` says whether a vehicle is below its limit, shape (time, vehicle).
    """
    events: list[Event] = []
    last = np.full(below.shape[1], -np.inf)
    for now, low in zip(time_s.tolist(), below, strict=True):
        began = np.flatnonzero(low & (now - last > REARM_S))
        if began.size:
            events.append(Event(now, kind, tuple(began.tolist())))
        last[low] = now
    return events


def collisions(
    time_s: Float32, began: Int32, clearance: Float32, position: Float32, hull_radius_m: float
) -> list[Event]:
    """An event for each collision that the simulator counted.

    The simulator counts collisions for each vehicle without the other party: a vehicle whose hull starts to overlap an
    obstacle has collided with that, and the others with each other.

    Args:
        time_s: shape (time,).
        began: collisions since the previous sample, shape (time, vehicle).
        clearance: smallest distance to an obstacle's surface since the previous sample [m], shape (time, vehicle).
        position: position, also of vehicles lost in the collision [m], shape (time, vehicle, 2).
        hull_radius_m: distance to an obstacle's surface below which they collide; twice this for two vehicles.
    """
    events: list[Event] = []
    inside = clearance < hull_radius_m
    for t in np.flatnonzero(began.any(axis=1)).tolist():
        now, left = float(time_s[t]), began[t].copy()
        hit = np.flatnonzero((left > 0) & inside[t] & ~inside[t - 1]).tolist()
        left[hit] -= 1
        while left.any():
            i = int(left.argmax())
            j = _partner(i, left, position[t - 1 : t + 1], 2 * hull_radius_m)
            if j is None:
                hit += [i] * int(left[i])
                left[i] = 0
            else:
                events.append(Event(now, "collision", (min(i, j), max(i, j))))
                left[[i, j]] -= 1
        events += [Event(now, "obstacle", (i,)) for i in hit]
    return events


def _partner(i: int, left: Int32, position: Float32, collision_m: float) -> int | None:
    """The vehicle that collided with ``i``: the nearest with a collision left, first of those apart before.

    ``left`` is the number of collisions without an event, shape (vehicle,); ``position`` (2, vehicle, 2) [m].
    """
    before, now = np.hypot(*np.moveaxis(position - position[:, i : i + 1], -1, 0))
    others = np.flatnonzero((left > 0) & (np.arange(len(left)) != i)).tolist()
    return min(others, key=lambda j: (before[j] < collision_m, now[j]), default=None)


def losses(time_s: Float32, alive: Bool) -> list[Event]:
    """An event for each vehicle at its first sample with ``alive`` (time, vehicle) False."""
    gone, vehicles = np.nonzero(alive[:-1] & ~alive[1:])
    return [Event(float(time_s[t + 1]), "lost", (i,)) for t, i in zip(gone.tolist(), vehicles.tolist(), strict=True)]


def arrival(task_time_s: float | None) -> list[Event]:
    """The event of the swarm's arrival, if it arrives."""
    return [] if task_time_s is None else [Event(task_time_s, "arrived", ())]
