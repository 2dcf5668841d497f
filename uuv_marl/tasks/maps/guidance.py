"""The fields of the channel ``path``: a point ahead on a shortest path, and the nearest walls."""

import math

import numpy as np

from uuv_marl.percept import LENGTH, POSITION, PerceptField
from uuv_marl.sim.arrays import State, WorldMap
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.maps.grid_paths import CELL_M
from uuv_marl.tasks.reward import Terms
from uuv_marl.types import Float64, Int64

NUM_WALLS = 8
"""Nearest walls in the channel. Assumed: all that a hull can reach within a second or two."""
AHEAD_M = 12.0
"""Distance of the point ahead on the path [m]. Assumed, tried by hand."""
PATH_FIELDS = (
    PerceptField("path", (2,), POSITION, "vector to a point ahead on a short path to the goal, clear of walls"),
    PerceptField("path_length", (1,), LENGTH, "length of the shortest collision-free path to the goal"),
    PerceptField("path_walls", (NUM_WALLS, 2), POSITION, "vectors to the surfaces of the nearest obstacles, else 0"),
)
"""Fields of the channel ``path``."""
_TOUCH_M = 1e-3
"""Least distance [m], so that there is a direction; assumed."""


@compiled
def _straight(field: Float64, i: int, j: int, to_i: int, to_j: int) -> bool:
    """Whether the straight line from a cell to another meets no wall."""
    num = 2 * max(abs(to_i - i), abs(to_j - j))
    for k in range(1, num):
        if field[round(i + (to_i - i) * k / num), round(j + (to_j - j) * k / num)] == math.inf:
            return False
    return True


@compiled
def point_ahead(field: Float64, row: int, column: int) -> tuple[int, int]:
    """Row and column on the path down ``field``, up to ``AHEAD_M`` ahead and in a straight line from a cell.

    ``field``: remaining cost from each cell, shape (row, column); infinite on walls.
    """
    i, j, far = row, column, 0.0
    while far < AHEAD_M:
        to_i, to_j = i, j
        for a in range(max(i - 2, 0), min(i + 3, field.shape[0])):
            for b in range(max(j - 2, 0), min(j + 3, field.shape[1])):
                if abs(a - i) + abs(b - j) < 4 and field[a, b] < field[to_i, to_j]:
                    to_i, to_j = a, b
        if (to_i == i and to_j == j) or (far > 0.0 and not _straight(field, row, column, to_i, to_j)):
            break
        far += CELL_M * math.hypot(to_i - i, to_j - j)
        i, j = to_i, to_j
    return i, j


@compiled
def move_ahead(path_cost: Float64, row: Int64, column: Int64) -> None:
    """Replace rows and columns of vehicles' cells by those of their ``point_ahead``, shape (world, vehicle).

    ``path_cost``: remaining cost from each cell, high near walls, shape (world, row, column).
    """
    for w in range(row.shape[0]):
        for v in range(row.shape[1]):
            row[w, v], column[w, v] = point_ahead(path_cost[w], row[w, v], column[w, v])


@compiled
def nearest_walls(state: State, world_map: WorldMap, heading: Float64, walls: Float64) -> None:
    """Fill ``walls`` with vectors to the nearest surfaces in the body frame [m], nearest first; zero before.

    ``walls`` has shape (world, vehicle, wall, 2); ``heading``: cosine and sine, shape (world, vehicle, 2).
    """
    for w in range(walls.shape[0]):
        for v in range(walls.shape[1]):
            c, s, out, num_found = heading[w, v, 0], heading[w, v, 1], walls[w, v], 0
            for m in range(world_map.num_obstacles[w]):
                disc = world_map.obstacles[w, m]
                x, y = disc[0] - state.eta[w, v, 0], disc[1] - state.eta[w, v, 1]
                away = max(math.hypot(x, y), _TOUCH_M)
                gap = max(away - disc[2], _TOUCH_M)
                if num_found == out.shape[0] and gap >= math.hypot(out[num_found - 1, 0], out[num_found - 1, 1]):
                    continue
                num_found = min(num_found + 1, out.shape[0])
                k = num_found - 1
                while k > 0 and math.hypot(out[k - 1, 0], out[k - 1, 1]) > gap:
                    out[k, 0], out[k, 1] = out[k - 1, 0], out[k - 1, 1]
                    k -= 1
                out[k, 0], out[k, 1] = (c * x + s * y) * gap / away, (c * y - s * x) * gap / away


def in_axes(vectors: Float64, axes: Float64) -> Float64:
    """Vectors in axes that are turned by angles, given as cosine and sine, shape (..., 2) both."""
    (x, y), (c, s) = np.moveaxis(vectors, -1, 0), np.moveaxis(axes, -1, 0)
    return np.stack([c * x + s * y, c * y - s * x], axis=-1)


def path_terms(swarm: Swarm, ahead: Float64, length: Float64) -> Terms:
    """The values of ``PATH_FIELDS``.

    ``ahead``: vectors to points ahead, north and east [m], shape (world, vehicle, 2); ``length`` of the paths [m],
    shape (world, vehicle).
    """
    walls = np.zeros((*length.shape, NUM_WALLS, 2))
    nearest_walls(swarm.state, swarm.world_map, swarm.heading, walls)
    return {"path": in_axes(ahead, swarm.heading), "path_length": length[:, :, None], "path_walls": walls}
