"""Events on a replay's time line: collisions, near misses, losses and the arrival."""

from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.types import Bool, Float32, Int32

REARM_S = 2.0
"""Time for which a vehicle must keep its distance before its next near miss counts [s]."""


class Event(NamedTuple):
    """An event of an episode."""

    time_s: float
    kind: str
    """``collision`` between vehicles, ``obstacle`` with an obstacle, ``near`` and ``near_obstacle`` where spacing
    falls below s_u or clearance below s_o, ``lost``, or ``arrived`` for the swarm."""
    vehicles: tuple[int, ...]
    """Indices of all vehicles to which this happens at this time; empty for the swarm."""


def events_of(
    scenario: Scenario, time_s: Float32, alive: Bool, collisions: Int32, spacing: Float32, clearance: Float32,
    task_time_s: float | None,
) -> list[Event]:  # fmt: skip
    """All events, sorted by time.

    Arrays have shape (time, vehicle): ``collisions``, ``spacing`` and ``clearance`` [m] are those since the sample
    before. A vehicle whose hull starts to overlap an obstacle has collided with that, others with each other.
    """
    limits, inside = scenario.constraints, clearance < scenario.collision.hull_radius_m
    hit = (collisions > 0) & inside & ~_before(inside)
    happened = {
        "collision": collisions > hit,
        "obstacle": hit,
        "near": _anew(time_s, spacing < limits.s_u_m),
        "near_obstacle": _anew(time_s, clearance < limits.s_o_m),
        "lost": _before(alive) & ~alive,
    }
    events = [
        Event(float(time_s[t]), kind, tuple(np.flatnonzero(vehicles[t]).tolist()))
        for kind, vehicles in happened.items()
        for t in np.flatnonzero(vehicles.any(axis=1))
    ]
    if task_time_s is not None:
        events.append(Event(task_time_s, "arrived", ()))
    return sorted(events, key=lambda event: event.time_s)


def _before(values: Bool) -> Bool:
    """The values one sample earlier, False at first."""
    return np.vstack([np.zeros_like(values[:1]), values[:-1]])


def _anew(time_s: Float32, below: Bool) -> Bool:
    """Where near misses begin, from where vehicles are below their limit, shape (time, vehicle)."""
    latest = np.maximum.accumulate(np.where(below, time_s[:, None], -np.inf), axis=0)
    latest = np.vstack([np.full_like(latest[:1], -np.inf), latest[:-1]])
    return below & (time_s[:, None] - latest > REARM_S)
