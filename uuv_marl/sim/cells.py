"""Cell lists: the living vehicles of a world sorted by square cells, so that near ones are contiguous in memory.

Small swarms have one cell, and every pair is examined. Large ones have a grid over their bounding box, and a search
visits boxes of cells.
"""

import math
from typing import NamedTuple

from uuv_marl.sim.compiled import compiled, compiled_inline, compiled_inner
from uuv_marl.sim.workspace import Cells, Columns
from uuv_marl.types import Bool

ONE_CELL_UP_TO = 250
"""Number of vehicles up to which examining every pair is faster than a grid (perf/, docs/speed.md)."""
_CELLS_PER_VEHICLE = 4
_CROWDED = 0.85
"""Side of a cell over the mean spacing, for swarms so dense that cells are made smaller."""
Box = tuple[float, float, float, float]
"""Northern, southern, eastern and western side of a rectangle [m]."""


class Grid(NamedTuple):
    """Geometry of the cells."""

    living: int
    x_min: float
    y_min: float
    side: float  # side of a cell [m]; infinite for one cell
    columns: int  # cells along y
    rows: int  # cells along x


@compiled
def max_cells(num_vehicles: int) -> int:
    """Largest number of cells that ``sort`` makes."""
    return 1 if num_vehicles <= ONE_CELL_UP_TO else _CELLS_PER_VEHICLE * num_vehicles


@compiled
def fit(w: int, alive: Bool, side: float, now: Columns) -> Grid:
    """Fit a grid over the living of world w; ``side`` is that of a cell [m] unless the swarm is dense or too wide."""
    x, y = now.x, now.y
    living, x_min, x_max, y_min, y_max = 0, math.inf, -math.inf, math.inf, -math.inf
    for i in range(alive.shape[1]):
        if alive[w, i]:
            living += 1
            x_min, x_max = min(x_min, x[i]), max(x_max, x[i])
            y_min, y_max = min(y_min, y[i]), max(y_max, y[i])
    most = max_cells(alive.shape[1])
    if most == 1 or not math.isfinite((x_max - x_min) * (y_max - y_min)):
        return Grid(living, 0.0, 0.0, math.inf, 1, 1)
    crowded = _CROWDED * math.sqrt((x_max - x_min) * (y_max - y_min) / living)
    side = min(side, max(crowded, side / 16.0))
    rows, columns = math.floor((x_max - x_min) / side) + 1.0, math.floor((y_max - y_min) / side) + 1.0
    while rows * columns > most:
        side *= 1.25
        rows, columns = math.floor((x_max - x_min) / side) + 1.0, math.floor((y_max - y_min) / side) + 1.0
    return Grid(living, x_min, y_min, side, int(columns), int(rows))


@compiled
def place(value: float, low: float, side: float, num: int) -> int:
    """Index of the row or column that contains a coordinate, clipped to the grid; 0 for NaN.

    ``low``: lower side of the first one [m]; ``side``: of a cell [m]; ``num``: number of rows or columns.
    """
    cell = (value - low) / side
    return int(min(cell, num - 1.0)) if cell > 0.0 else 0


@compiled_inline
def covered(box: Box, grid: Grid) -> tuple[int, int, int, int]:
    """First and last row, then first and last column, of the cells that meet a rectangle."""
    north, south, east, west = box
    bottom, top = place(south, grid.x_min, grid.side, grid.rows), place(north, grid.x_min, grid.side, grid.rows)
    left, right = place(west, grid.y_min, grid.side, grid.columns), place(east, grid.y_min, grid.side, grid.columns)
    return bottom, top, left, right


@compiled_inner
def sort(w: int, alive: Bool, side: float, now: Columns, cells: Cells) -> Grid:
    """Sort the living of world w into ``cells`` by cell, then by index, and return the grid; ``side`` as in ``fit``."""
    grid, x, y, c, s = fit(w, alive, side, now), now.x, now.y, now.cos, now.sin
    num = grid.rows * grid.columns
    cells.first[: num + 1] = 0
    for i in range(alive.shape[1]):
        if alive[w, i]:
            cell = 0
            if num > 1:
                row = place(x[i], grid.x_min, grid.side, grid.rows)
                cell = row * grid.columns + place(y[i], grid.y_min, grid.side, grid.columns)
            cells.entry[i] = cell
            cells.first[cell] += 1
        else:
            cells.entry[i] = -1
    end = 0
    for cell in range(num):
        end += cells.first[cell]
        cells.first[cell] = end
    cells.first[num] = end
    for i in range(alive.shape[1] - 1, -1, -1):
        if alive[w, i]:
            cells.first[cells.entry[i]] -= 1
            p = cells.first[cells.entry[i]]
            cells.entry[i] = p
            cells.x[p], cells.y[p], cells.cos[p], cells.sin[p], cells.vehicle[p] = x[i], y[i], c[i], s[i], i
    return grid
