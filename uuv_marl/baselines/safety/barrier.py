"""Safety filter: the velocity nearest to a desired one that keeps clear of remembered obstacles and neighbours.

A control barrier function on velocities (Ames, Coogan, Egerstedt, Notomista, Sreenath and Tabuada, Control barrier
functions: theory and applications, ECC 2019): the distance d to an obstacle or neighbour may shrink no faster than in
proportion to its excess over a margin, n . v <= gamma (d - margin), so that a vehicle stays beyond the margin. Of two
neighbours that must change a velocity, each makes a share of the change, as in reciprocal avoidance (van den Berg et
al. 2011, see ``halfplanes``).
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from uuv_marl.baselines.memory.discs import CONFIRMED
from uuv_marl.baselines.memory.neighbours import noise_of
from uuv_marl.baselines.memory.pose import to_body_axes, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.safety.halfplanes import nearest_velocity
from uuv_marl.baselines.steering import full_speed, steer
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float32, Float64

G = TypeVar("G")


class Barrier(NamedTuple):
    """Margins and rates of the filter, found by hand on tuning seeds.

    13.5 m is the largest distance that the paper states, 12.63 m, and about the metre lost by sway, which can't be
    braked; 0.3 of a gap of 20 m, the narrowest of ``random_field``, is 6 m, more than the assumed s_o of the paper.
    """

    obstacle_m: float = 13.5  # distance kept from surfaces of obstacles [m]
    gap_share: float = 0.3  # largest share of the gap between two obstacles that is kept from each of them [1]
    narrowest_m: float = 8.0  # a narrower gap counts as closed [m]
    obstacle_rate: float = 1.0  # largest closing speed per metre beyond that distance [1/s]
    neighbour_m: float = 7.0  # distance kept from neighbours [m]
    neighbour_rate: float = 1.0  # largest closing speed per metre beyond that distance [1/s]
    noise_margin: float = 3.0  # factor of the neighbours' mean position error, added to that distance [1]
    share: float = 0.6  # share of a change that each of two neighbours makes [1]; half would do with full information
    horizon_m: float = 60.0  # neighbours and surfaces farther away are ignored [m]


class Steering(NamedTuple):
    """What the filter needs beside a vehicle's memory."""

    barrier: Barrier
    limits: Limits
    period: float  # decision period [s]
    gain: float  # force per velocity error [N s/m]
    planes: Float64  # work array for half-planes


MOST_CLOSED = 0.3  # largest share of the remaining distance that is closed in a decision period [1]
GUARD = Barrier(obstacle_m=6.0, obstacle_rate=2.0)
"""The filter of ``safety_filter=true``, with smaller margins than those of a controller that avoids obstacles early."""


def with_numbers(values: Mapping[str, float], gains: G, barrier: Barrier) -> tuple[G, Barrier]:
    """Gains and filter with the values by name that belong to the one or the other."""
    both: tuple[Any, Any] = gains, barrier
    updated = [
        each._replace(**{name: value for name, value in values.items() if name in each._fields}) for each in both
    ]
    return updated[0], updated[1]


@compiled
def margin(w: int, i: int, d: int, barrier: Barrier, memory: Surroundings) -> float:
    """Distance to keep from the surface of a remembered obstacle [m]: less where the gap to the next is narrow."""
    disc, least = memory.disc[w, i], barrier.obstacle_m
    for e in range(memory.score.shape[2]):
        if e != d and memory.score[w, i, e] >= CONFIRMED:
            x, y, radii = disc[e, 0] - disc[d, 0], disc[e, 1] - disc[d, 1], disc[e, 2] + disc[d, 2]
            if barrier.gap_share * (max(abs(x), abs(y)) - radii) > least + 1e-6:
                continue  # too far apart to count, which needs no root
            apart = math.hypot(x, y) - disc[e, 2] - disc[d, 2]
            if apart > barrier.narrowest_m:
                least = min(least, barrier.gap_share * apart)
    return least


@compiled
def planes_of(w: int, i: int, safe: Steering, memory: Surroundings) -> int:
    """Write the half-planes n . v <= b of remembered obstacles and neighbours in the map; returns their number."""
    barrier, planes, num = safe.barrier, safe.planes, 0
    x, y = memory.pose[w, i, 0], memory.pose[w, i, 1]
    rate = min(barrier.obstacle_rate, MOST_CLOSED / safe.period)
    for d in range(memory.score.shape[2]):
        if memory.score[w, i, d] < CONFIRMED:
            continue
        away = max(memory.disc_away[w, i, d], 1e-6)
        left = away - memory.disc[w, i, d, 2]
        if left < barrier.horizon_m:
            n_x, n_y = memory.disc[w, i, d, 0] - x, memory.disc[w, i, d, 1] - y
            planes[num, 0], planes[num, 1] = n_x / away, n_y / away
            planes[num, 2] = rate * (left - margin(w, i, d, barrier, memory))
            num += 1
    return neighbour_planes(w, i, num, safe, memory)


@compiled
def neighbour_planes(w: int, i: int, num: int, safe: Steering, memory: Surroundings) -> int:
    """Write the half-planes of neighbours after the first ``num``; returns the number of planes."""
    barrier, planes = safe.barrier, safe.planes
    x, y = memory.pose[w, i, 0], memory.pose[w, i, 1]
    v_x, v_y = to_map_axes(memory.motion[w, i, 0], memory.motion[w, i, 1], memory.pose[w, i])
    rate = min(barrier.neighbour_rate, MOST_CLOSED / safe.period)
    for k in range(memory.known.shape[2]):
        away = max(memory.away[w, i, k], 1e-6)
        if away < barrier.horizon_m:
            n_x, n_y = (memory.place[w, i, k, 0] - x) / away, (memory.place[w, i, k, 1] - y) / away
            own = n_x * v_x + n_y * v_y
            closing = own - n_x * memory.velocity[w, i, k, 0] - n_y * memory.velocity[w, i, k, 1]
            planes[num, 0], planes[num, 1] = n_x, n_y
            left = away - barrier.neighbour_m - barrier.noise_margin * noise_of(w, i, memory) * away
            planes[num, 2] = own + barrier.share * (rate * left - closing)
            num += 1
    return num


@compiled
def keeps(v_x: float, v_y: float, planes: Float64, num: int) -> bool:
    """Whether a velocity satisfies the half-planes."""
    for k in range(num):  # noqa: SIM110 - compiled
        if planes[k, 0] * v_x + planes[k, 1] * v_y > planes[k, 2]:
            return False
    return True


@compiled
def steer_safely(
    w: int, i: int, w_x: float, w_y: float, num: int, safe: Steering, memory: Surroundings, action: Float32
) -> None:
    """Write the action for the velocity nearest to a desired one that satisfies the half-planes."""
    w_x, w_y, _ = nearest_velocity(w_x, w_y, safe.planes, num, 0, full_speed(safe.limits))
    w_x, w_y = to_body_axes(w_x, w_y, memory.pose[w, i])
    steer(w_x, w_y, memory.motion[w, i, 0], memory.motion[w, i, 1], safe.gain, safe.limits, action[w, i])
