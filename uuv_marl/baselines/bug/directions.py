"""Direction of a vehicle: to the goal, or past the end of an obstacle, on one side.

TangentBug (Kamon, Rimon and Rivlin, TangentBug: a range-sensor-based navigation algorithm, International Journal of
Robotics Research 17(9), 1998), with all remembered echoes as its view. Unknown space counts as free.
"""

import math

import numpy as np

from uuv_marl.baselines.bug.gains import BugGains
from uuv_marl.baselines.bug.walls import Walls
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float64

RAYS = 120  # number of candidate directions, the first to the goal, then clockwise
TURNS: Float64 = np.array([cos_sin(2.0 * math.pi * k / RAYS) for k in range(RAYS)])
"""Unit vectors of the directions relative to the goal's, shape (ray, 2)."""
_FREE_M = 1e6  # free distance where no echo is known [m]


@compiled
def look_round(w: int, i: int, stand: float, memory: Surroundings, walls: Walls, looks: Float64, free: Float64) -> None:
    """Fill ``free``, shape (ray,), with the collision-free distance along each direction [m].

    ``looks`` are unit vectors in the vehicle's map, shape (ray, 2); ``stand`` is the clearance [m]. From a position
    nearer than that, directions are free that do not reduce the distance.
    """
    free[:] = _FREE_M
    for k in range(int(walls.num[w, i])):
        x, y = walls.echoes[w, i, k, 0] - memory.pose[w, i, 0], walls.echoes[w, i, k, 1] - memory.pose[w, i, 1]
        away = math.hypot(x, y)
        wide = min(walls.echoes[w, i, k, 2] + stand, 0.999 * away)
        for j in range(looks.shape[0]):
            along, across = looks[j, 0] * x + looks[j, 1] * y, looks[j, 0] * y - looks[j, 1] * x
            if along > 0.0 and abs(across) < wide:
                free[j] = min(free[j], along - math.sqrt(wide * wide - across * across))


@compiled
def past(side: int, reach: float, away: float, looks: Float64, free: Float64) -> tuple[int, float]:
    """The first free direction on one side of the goal's, and the length of the path past its end to the goal [m].

    ``side`` is 1 or -1, ``reach`` the distance for which it must be free [m], ``away`` the goal's distance [m];
    ``looks`` and ``free`` as for ``look_round``. The index is 0 where no direction is free.
    """
    num, last = looks.shape[0], 0
    for turn in range(1, num):
        j = (side * turn) % num
        if free[j] >= reach:
            to_x, to_y = free[last] * looks[last, 0], free[last] * looks[last, 1]
            return j, free[last] + math.hypot(away * looks[0, 0] - to_x, away * looks[0, 1] - to_y)
        last = j
    return 0, _FREE_M


@compiled
def chosen_ray(w: int, i: int, away: float, g: BugGains, walls: Walls, looks: Float64, free: Float64) -> int:
    """Index of the direction to take; the chosen side is stored in ``walls``. Arguments as for ``past``."""
    side = int(walls.side[w, i])
    near = free[0] >= min(g.look_m, away) and (side == 0 or away < walls.hit_m[w, i] - g.nearer_m)
    if near or free[0] >= away:
        walls.side[w, i] = 0.0
        return 0
    reach = min(max(g.look_m, free[0] + g.beyond_m), away)
    right, right_m = past(1, reach, away, looks, free)
    left, left_m = past(-1, reach, away, looks, free)
    if side == 0:
        walls.hit_m[w, i], walls.turned[w, i] = away, 0.0
        side = 1 if right_m <= left_m else -1
    elif side * (right_m - left_m) > g.turn_back_m * 2.0 ** walls.turned[w, i]:
        walls.turned[w, i] += 1.0
        side = -side
    walls.side[w, i] = side
    best = right if side > 0 else left
    return best if best > 0 else int(np.argmax(free))


@compiled
def choose_directions(
    worlds: Bool, g: BugGains, turns: Float64, looks: Float64, free: Float64, memory: Surroundings, walls: Walls
) -> None:
    """Choose every vehicle's direction; ``turns`` are ``TURNS``, ``looks`` and ``free`` work arrays."""
    for w in range(worlds.shape[0]):
        for i in range(walls.num.shape[1] if worlds[w] else 0):
            x = memory.reference[w, i, 0] - memory.pose[w, i, 0]
            y = memory.reference[w, i, 1] - memory.pose[w, i, 1]
            away = max(math.hypot(x, y), 1e-6)
            for j in range(turns.shape[0]):
                looks[j, 0] = (x * turns[j, 0] - y * turns[j, 1]) / away
                looks[j, 1] = (y * turns[j, 0] + x * turns[j, 1]) / away
            look_round(w, i, g.stand_m, memory, walls, looks, free)
            j = chosen_ray(w, i, away, g, walls, looks, free)
            walls.direction[w, i, 0], walls.direction[w, i, 1] = looks[j, 0], looks[j, 1]
