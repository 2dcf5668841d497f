"""What is read off a swarm's routes: distance from the path, turns, groups, sides. Frame north, east [m]."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]


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
    vehicles: NDArray[np.int64] = np.arange(int(position.shape[1]))
    motion = (position[nearest + 1, vehicles] - position[nearest - 1, vehicles]).astype(np.float64)
    past = offset[nearest, vehicles]
    starboard = float(np.mean(motion[:, 0] * past[:, 1] - motion[:, 1] * past[:, 0] > 0.0))
    return min(starboard, 1.0 - starboard)


def path_length(position: Float32) -> float:
    """Mean distance travelled by a vehicle [m], from routes of shape (time, vehicle, 2)."""
    return float(np.linalg.norm(np.diff(position.astype(np.float64), axis=0), axis=-1).sum(axis=0).mean())


def pair_unrest(position: Float32) -> float:
    """Root mean square, over pairs of vehicles, of the standard deviation in time of their distance [m]."""
    offset: Float64 = (position[:, :, None] - position[:, None]).astype(np.float64)
    distance = np.linalg.norm(offset, axis=-1)
    variance: Float64 = distance.var(axis=0)
    return float(np.sqrt(variance[np.triu_indices(len(variance), 1)].mean()))
