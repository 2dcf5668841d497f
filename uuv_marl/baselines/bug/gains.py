"""Gains of ``tangent_bug``."""

from typing import NamedTuple

from uuv_marl.baselines.safety.barrier import Barrier


class BugGains(NamedTuple):
    """Gains of path choice and desired velocity."""

    cruise: float = 4.5  # speed [m/s]
    pull: float = 0.2  # near the goal the speed is this times the distance [1/s]
    stand_m: float = 3.0  # clearance of a collision-free direction from remembered echoes [m]
    look_m: float = 25.0  # a direction is free if it is collision-free for this distance [m] ...
    beyond_m: float = 15.0  # ... and for this much farther than the obstacle on the line to the goal [m]
    nearer_m: float = 5.0  # a vehicle leaves a wall once it is this much nearer to the goal than where it met it [m]
    turn_back_m: float = 50.0  # it turns back if the other side is shorter by this, twice as much each time [m]
    push: float = 2.5  # away from a neighbour at distance 0 [m/s], falling linearly to 0 at ``push_range``
    push_range: float = 9.0  # [m]


BUG_BARRIER = Barrier(obstacle_m=3.0, obstacle_rate=0.8, neighbour_m=4.5, neighbour_rate=0.5)
"""Margins and rates of the safety filter, found by hand on tuning seeds: gaps between rocks are at least 6 m wide."""
