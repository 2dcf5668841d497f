"""The fields of the channel ``path``: a point ahead on a shortest path, and the nearest walls."""

import math

from uuv_marl.percept import LENGTH, POSITION, PerceptField
from uuv_marl.sim.arrays import State, WorldMap
from uuv_marl.sim.compiled import compiled
from uuv_marl.tasks.maps.grid_paths import CELL_M, MapGrid
from uuv_marl.types import Float64

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
def nearest_walls(pose: Float64, c: float, s: float, discs: Float64, out: Float64) -> None:
    """Fill ``out`` with vectors to the nearest surfaces in the body frame [m], nearest first, shape (wall, 2).

    ``pose``: north, east [m], shape (at least 2,); c, s: cosine and sine of the heading; ``discs``: north, east and
    radius [m], shape (disc, 3).
    """
    num_found, out[:] = 0, 0.0
    for m in range(discs.shape[0]):
        x, y = discs[m, 0] - pose[0], discs[m, 1] - pose[1]
        away = max(math.hypot(x, y), _TOUCH_M)
        gap = max(away - discs[m, 2], _TOUCH_M)
        if num_found == out.shape[0] and gap >= math.hypot(out[num_found - 1, 0], out[num_found - 1, 1]):
            continue
        num_found = min(num_found + 1, out.shape[0])
        k = num_found - 1
        while k > 0 and math.hypot(out[k - 1, 0], out[k - 1, 1]) > gap:
            out[k, 0], out[k, 1] = out[k - 1, 0], out[k - 1, 1]
            k -= 1
        out[k, 0], out[k, 1] = (c * x + s * y) * gap / away, (c * y - s * x) * gap / away


@compiled
def write_path(
    state: State, world_map: WorldMap, heading: Float64, turn: Float64, path_cost: Float64, grid: MapGrid,
    path: Float64, walls: Float64,
) -> None:  # fmt: skip
    """Fill ``path`` (world, vehicle, 2) and ``walls`` (world, vehicle, wall, 2), body frame [m].

    ``heading`` (world, vehicle, 2) and ``turn`` of the map (world, 2) are cosine and sine; ``path_cost``: remaining
    cost from each cell, high near walls, shape (world, row, column).
    """
    for w in range(path.shape[0]):
        turn_c, turn_s, discs = turn[w, 0], turn[w, 1], world_map.obstacles[w, : world_map.num_obstacles[w]]
        for v in range(path.shape[1]):
            pose, c, s = state.eta[w, v], heading[w, v, 0], heading[w, v, 1]
            x, y = turn_c * pose[0] + turn_s * pose[1], turn_c * pose[1] - turn_s * pose[0]
            row, column = round((x - grid.x) / CELL_M), round((y - grid.y) / CELL_M)
            i, j = point_ahead(path_cost[w], min(max(row, 0), grid.rows - 1), min(max(column, 0), grid.columns - 1))
            x, y = grid.x + i * CELL_M - x, grid.y + j * CELL_M - y
            x, y = turn_c * x - turn_s * y, turn_s * x + turn_c * y
            path[w, v, 0], path[w, v, 1] = c * x + s * y, c * y - s * x
            nearest_walls(pose, c, s, discs, walls[w, v])


@compiled
def write_walls(state: State, world_map: WorldMap, heading: Float64, walls: Float64) -> None:
    """Fill ``walls`` alone; arguments as in ``write_path``."""
    for w in range(walls.shape[0]):
        for v in range(walls.shape[1]):
            c, s, discs = heading[w, v, 0], heading[w, v, 1], world_map.obstacles[w, : world_map.num_obstacles[w]]
            nearest_walls(state.eta[w, v], c, s, discs, walls[w, v])
