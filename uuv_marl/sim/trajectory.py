"""The reference point l(t) (Eq. 5): constant speed along a polyline, then at rest at its end or beyond it."""

import numpy as np

from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float64


def arrival_times(waypoints: Float64, speed: float) -> Float64:
    """Time at which l(t) passes each waypoint [s], shape (point,). ``waypoints`` [m] has shape (point, 2)."""
    legs = np.hypot(*np.diff(waypoints, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(legs)]) / speed


@compiled
def reference(
    t: float, waypoints: Float64, times: Float64, last: int, passes: bool
) -> tuple[float, float, float, float]:
    """Position [m] and velocity [m/s] of l(t), north and east.

    Args:
        t: time since the reset [s].
        waypoints: corners of the trajectory, north and east [m], shape (point, 2).
        times: when l(t) passes them [s], shape (point,).
        last: index of the last corner; those beyond it are padding.
        passes: whether it moves on beyond the end instead of resting there (``arrival.criterion``); a reference that
            starts at its end rests.
    """
    if t >= times[last] and (not passes or times[last] == 0.0):
        return waypoints[last, 0], waypoints[last, 1], 0.0, 0.0
    k = 0
    while k < last - 1 and t >= times[k + 1]:
        k += 1
    duration = times[k + 1] - times[k]
    v_x = (waypoints[k + 1, 0] - waypoints[k, 0]) / duration
    v_y = (waypoints[k + 1, 1] - waypoints[k, 1]) / duration
    return waypoints[k, 0] + v_x * (t - times[k]), waypoints[k, 1] + v_y * (t - times[k]), v_x, v_y
