"""Measures of a run for the paper's claims, from its traces.

Below them measures of trajectories: distance from the path, turns, groups, sides. Frame north, east [m].
"""

from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from uuv_marl.benchmark.results import Trace
from uuv_marl.types import Float32, Float64, Int64

SPEED_MPS = 4.0
"""Speed of l(t) [m/s]. Section 5.1."""
SETTLED_S = 60.0
"""After this long the two groups have met (assumed; the paper's figure 9 shows no times)."""
WINDOW_S = 40.0
"""Times this long before and after a corner count as near it [s]: the swarm trails l(t) by about 16 s."""
LINK_M = 20.0
"""Vehicles nearer than the start's gap belong to one group."""


def between(trace: Trace, name: str, start: float, end: float) -> Float32:
    """A series, or routes, in a window of time, both ends included; the first axis is time."""
    time = trace["route_time_s" if name.startswith("route_") else "time_s"]
    return trace[name][(time >= start) & (time <= end)]


def corners(trace: Trace) -> Float64:
    """Times at which l(t) passes the corners and the end [s]."""
    return corner_times(trace["waypoints"], SPEED_MPS)


def near_corners(trace: Trace, name: str) -> list[tuple[float, Float32, Float32]]:
    """When l(t) passes a corner [s], and a series in the windows before and after it."""
    return [
        (t, between(trace, name, t - WINDOW_S, t), between(trace, name, t, t + WINDOW_S)) for t in corners(trace)[:-1]
    ]


def order_on_last_leg(trace: Trace) -> float:
    """Mean order parameter in the last minute on the last leg."""
    end = corners(trace)[-1]
    return float(between(trace, "order_parameter", end - SETTLED_S, end).mean())


def unrest_at_end(trace: Trace) -> float:
    """Variation of the distances between vehicles in the last 10 s [m]."""
    return pair_unrest(between(trace, "route_position", trace["time_s"][-1] - 10.0, np.inf))


def groups_at(trace: Trace, time: float) -> float:
    """Groups of vehicles at a time [s]."""
    index = min(int(np.searchsorted(trace["route_time_s"], time)), len(trace["route_time_s"]) - 1)
    return num_groups(trace["route_position"][index], LINK_M)


def off_path(trace: Trace, start: float, end: float) -> Float64:
    """Distance of the swarm's centre from the path [m] in a window of time."""
    centre = between(trace, "route_position", start, end).mean(axis=1)
    return path_distance(centre, trace["waypoints"])


def off_path_at_leg_ends(trace: Trace) -> float:
    """Distance of the swarm's centre from the path at the ends of legs, largest [m]."""
    return max(off_path(trace, t - 10.0, t).mean() for t in corners(trace))


def rise_after_corners(trace: Trace) -> float:
    """Rise of that distance after a corner, the smaller one [m]."""
    return min(
        off_path(trace, t, t + WINDOW_S).max() - off_path(trace, t - 10.0, t).mean() for t in corners(trace)[:-1]
    )


def left_at_next_corner(trace: Trace) -> float:
    """Remaining share of that rise at the next corner, the larger one."""
    return max(
        off_path(trace, after - 10.0, after).mean() / off_path(trace, t, t + WINDOW_S).max()
        for t, after in pairwise(corners(trace))
    )


def rise_from_l(trace: Trace) -> float:
    """Rise of the distance from l(t) after a corner, the smaller one [m]."""
    return min(
        float(after.max() - between(trace, "centre_error_m", t - 10.0, t).mean())
        for t, _, after in near_corners(trace, "centre_error_m")
    )


def turn_near_corner(trace: Trace) -> float:
    """Turn of the mean heading in the window after the corners, against a window on the leg before, smallest ratio."""
    heading, time = mean_heading(trace["route_heading"]), trace["route_time_s"]

    def turned(start: float) -> float:
        inside = heading[(time >= start) & (time <= start + WINDOW_S)]
        return abs(float(inside[-1] - inside[0]))

    return min(turned(t) / max(turned(t - WINDOW_S), 1e-3) for t in corners(trace)[:-1])


def extent_at_first_corner(trace: Trace) -> float:
    """Largest spacing after the first corner over its mean before."""
    _, before, after = near_corners(trace, "max_spacing_m")[0]
    return float(after.max() / before.mean())


def spread_of(trace: Trace, name: str) -> float:
    """Range of a series that holds 90 % of the time, over the mean, once settled and until l(t) rests."""
    inside = between(trace, name, SETTLED_S, corners(trace)[-1])
    return float((np.percentile(inside, 95) - np.percentile(inside, 5)) / inside.mean())


def spacing_change_at_corners(trace: Trace) -> float:
    """Change of the mean smallest spacing from before to after a corner, the larger share."""
    return max(
        abs(float(after.mean() / before.mean()) - 1.0) for _, before, after in near_corners(trace, "min_spacing_m")
    )


def extent_before(trace: Trace) -> float:
    """Largest spacing [m] when the swarm has gathered, 10 s before its first vehicle detects an obstacle at 100 m."""
    nearest = trace["obstacle_distance_m"].min(axis=1)
    detected = trace["time_s"][np.argmax(nearest < 100.0)]
    return float(between(trace, "max_spacing_m", detected - 10.0, detected).mean())


def dispersal(trace: Trace) -> float:
    """Largest spacing over that before the obstacle is detected."""
    return float(between(trace, "max_spacing_m", SETTLED_S, np.inf).max()) / extent_before(trace)


def regathered(trace: Trace) -> float:
    """Largest spacing at the end over that before the obstacle is detected."""
    return float(trace["max_spacing_m"][-1]) / extent_before(trace)


def sides(trace: Trace) -> float:
    """Over the obstacles, the most even split; 0 around one that a vehicle passes through."""
    avoided = trace["obstacle_distance_m"].min(axis=0) > 0.0
    shares = [smaller_side(trace["route_position"], obstacle) for obstacle in trace["obstacles"]]
    return float(np.max(np.where(avoided, shares, 0.0)))


def distance_travelled(trace: Trace) -> float:
    """Distance that a vehicle travels, on average [m]."""
    steps: Float64 = np.diff(trace["route_position"].astype(np.float64), axis=0)
    return float(np.linalg.norm(steps, axis=-1).sum(axis=0).mean())


def energy(trace: Trace) -> float:
    """Sum of effort over time [s at full force]."""
    return float(trace["effort"][1:].sum() * np.diff(trace["time_s"]).mean())


def path_distance(position: Float32, waypoints: Float32) -> Float64:
    """Distance [m] of points of shape (..., 2) from the polyline through ``waypoints``."""
    best = np.full(position.shape[:-1], np.inf)
    for a, b in pairwise(waypoints):
        leg = (b - a).astype(np.float64)
        share = np.clip(((position - a) @ leg) / (leg @ leg), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(position - a - share[..., None] * leg, axis=-1))
    return best


def corner_times(waypoints: Float32, speed_mps: float) -> Float64:
    """When l(t) passes each waypoint but the first [s]: the corners, then the end."""
    return np.cumsum(np.linalg.norm(np.diff(waypoints.astype(np.float64), axis=0), axis=1)) / speed_mps


def mean_heading(heading: Float32) -> Float64:
    """Heading of the mean heading vector over vehicles [rad], unwrapped in time; ``heading`` is (time, vehicle)."""
    return np.unwrap(np.angle(np.exp(1j * heading.astype(np.float64)).mean(axis=1)))


def num_groups(position: Float32, link_m: float) -> int:
    """Groups of vehicles, shape (vehicle, 2), that are linked by distances below ``link_m``."""
    offset = position[:, None] - position[None]
    linked = csr_array((np.hypot(offset[..., 0], offset[..., 1]) < link_m).astype(np.float64))
    return int(connected_components(linked, directed=False)[0])


def smaller_side(position: Float32, obstacle: Float32) -> float:
    """Share of vehicles on the less used side of an obstacle, each judged where it comes nearest; at most 1/2.

    ``position`` is (time, vehicle, 2), ``obstacle`` centre and radius. A side is that of the vehicle's own motion.
    """
    offset = (position - obstacle[:2]).astype(np.float64)
    nearest = np.argmin(np.hypot(offset[..., 0], offset[..., 1])[1:-1], axis=0) + 1
    vehicles: Int64 = np.arange(int(position.shape[1]))
    motion = (position[nearest + 1, vehicles] - position[nearest - 1, vehicles]).astype(np.float64)
    past = offset[nearest, vehicles]
    starboard = float(np.mean(motion[:, 0] * past[:, 1] - motion[:, 1] * past[:, 0] > 0.0))
    return min(starboard, 1.0 - starboard)


def pair_unrest(position: Float32) -> float:
    """Root mean square, over pairs of vehicles, of the standard deviation in time of their distance [m]."""
    offset: Float64 = (position[:, :, None] - position[:, None]).astype(np.float64)
    distance = np.linalg.norm(offset, axis=-1)
    variance: Float64 = distance.var(axis=0)
    return float(np.sqrt(variance[np.triu_indices(len(variance), 1)].mean()))
