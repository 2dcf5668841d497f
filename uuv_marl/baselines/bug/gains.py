"""The numbers of ``tangent_bug``."""

from typing import NamedTuple

from uuv_marl.baselines.safety.barrier import Barrier


class BugGains(NamedTuple):
    """Gains of the way and of the wished velocity."""

    cruise: float = 4.5
    """Speed [m/s]."""
    pull: float = 0.2
    """Near the goal the speed is this times the distance [1/s]."""
    stand_m: float = 3.0
    """A way is free that keeps so much from what is remembered [m]."""
    look_m: float = 25.0
    """A way is free if it is so for this far [m]."""
    beyond_m: float = 15.0
    """... and for so much farther than what blocks the way to the goal [m]."""
    nearer_m: float = 5.0
    """By so much nearer to the goal than where it was blocked, a vehicle leaves a wall; another may follow [m]."""
    turn_back_m: float = 50.0
    """A vehicle turns back if the other way round is shorter by this, twice as much each time [m]."""
    push: float = 2.5
    """Away from a neighbour at no distance [m/s], falling linearly to none at ``push_range``."""
    push_range: float = 9.0
    """Where pushes end [m]."""


BUG_BARRIER = Barrier(obstacle_m=3.0, obstacle_rate=0.8, neighbour_m=4.5, neighbour_rate=0.5)
"""Margins and rates of the filter, found by hand on tuning seeds: gaps between rocks are from 6 m wide."""
