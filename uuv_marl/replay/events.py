"""What is marked on a replay's time line: contacts, near misses, losses and the arrival."""

import numpy as np
from numpy.typing import NDArray

from uuv_marl.replay.recording import Event, Float32

Bool = NDArray[np.bool_]
Int32 = NDArray[np.int32]

REARM_S = 2.0
"""A vehicle's next near miss counts once it has kept its distance for so long, so that one which stays at the limit
makes one mark, not a hundred."""


def near_misses(kind: str, time_s: Float32, below: Bool) -> list[Event]:
    """An event for each sample at which near misses begin, with all vehicles whose miss begins there.

    Args:
        kind: of the events.
        time_s: shape (time,).
        below: whether a vehicle is below its limit, shape (time, vehicle).
    """
    events: list[Event] = []
    last = np.full(below.shape[1], -np.inf)
    for now, low in zip(time_s.tolist(), below, strict=True):
        began = np.flatnonzero(low & (now - last > REARM_S))
        if began.size:
            events.append(Event(now, kind, tuple(began.tolist())))
        last[low] = now
    return events


def contacts(time_s: Float32, began: Int32, clearance: Float32, position: Float32, hull_radius_m: float) -> list[Event]:
    """An event for each contact that the engine counted.

    The engine counts contacts for each vehicle, not with whom: a vehicle whose hull begins to overlap an obstacle has
    hit that, and the others have hit each other, nearest pairs first.

    Args:
        time_s: shape (time,).
        began: contacts that began since the sample before, shape (time, vehicle).
        clearance: smallest distance to an obstacle's surface since the sample before [m], shape (time, vehicle).
        position: also of those who are lost by the contact [m], shape (time, vehicle, 2).
        hull_radius_m: an obstacle's surface nearer than this is a contact.
    """
    events: list[Event] = []
    for t in np.flatnonzero(began.any(axis=1)).tolist():
        now, left = float(time_s[t]), began[t].copy()
        inside, before = clearance[t] < hull_radius_m, clearance[max(t - 1, 0)] < hull_radius_m
        hit = np.flatnonzero((left > 0) & inside & ~before).tolist()
        left[hit] -= 1
        for i, j in _nearest_pairs(position[t], left):
            events.append(Event(now, "collision", (i, j)))
            left[[i, j]] -= 1
        hit += np.repeat(np.arange(len(left)), left).tolist()
        events += [Event(now, "obstacle", (i,)) for i in hit]
    return events


def _nearest_pairs(position: Float32, left: Int32) -> list[tuple[int, int]]:
    """Pairs of vehicles, nearest first, until each has as many as it has contacts ``left`` or is without a partner."""
    these = np.flatnonzero(left > 0).tolist()
    away = {(i, j): float(np.hypot(*(position[i] - position[j]))) for i in these for j in these if i < j}
    count, pairs = left.copy(), list[tuple[int, int]]()
    for i, j in sorted(away, key=lambda pair: away[pair]):
        if count[i] > 0 and count[j] > 0:
            pairs.append((i, j))
            count[[i, j]] -= 1
    return pairs


def losses(time_s: Float32, alive: Bool) -> list[Event]:
    """An event for each vehicle at the first sample without it; ``alive`` has shape (time, vehicle)."""
    gone, who = np.nonzero(alive[:-1] & ~alive[1:])
    return [Event(float(time_s[t + 1]), "lost", (i,)) for t, i in zip(gone.tolist(), who.tolist(), strict=True)]


def arrival(task_time_s: float | None) -> list[Event]:
    """The swarm's arrival, if it did arrive."""
    return [] if task_time_s is None else [Event(task_time_s, "arrived", ())]
