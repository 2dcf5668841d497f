"""Who is where: the living vehicles of a world in the order of square cells, so that near ones lie side by side.

Small swarms have one cell, and every vehicle looks at every other. Large ones have a grid over their bounding box, and
a search visits boxes of cells: in each row of a box the vehicles are neighbours in memory.
"""

import math
from typing import NamedTuple

from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.workspace import Cells, Columns
from uuv_marl.types import Bool

ONE_CELL_UP_TO = 250
"""Vehicles up to which a look at every pair is faster than a grid (perf/, docs/speed.md)."""
_CELLS_PER_VEHICLE = 4
_CROWDED = 0.85
"""Side of a cell over the mean distance in a swarm so crowded that its cells are made smaller."""


class Grid(NamedTuple):
    """Where the cells lie."""

    living: int
    x_min: float
    y_min: float
    side: float
    """Edge of a cell [m]; infinite for one cell."""
    columns: int
    """Cells along y."""
    rows: int
    """Cells along x."""


@compiled
def max_cells(num_vehicles: int) -> int:
    """The most cells that ``sort`` makes."""
    return 1 if num_vehicles <= ONE_CELL_UP_TO else _CELLS_PER_VEHICLE * num_vehicles


@compiled
def fit(w: int, alive: Bool, side: float, now: Columns) -> Grid:
    """A grid over the living of a world: cells as wide as asked, smaller in a crowd, wider where there were too many.

    ``side`` is the edge of a cell that is asked for [m].
    """
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
    """Row or column that holds a coordinate; the first or last for one beyond the grid, the first for none (NaN).

    ``low``: where the first row or column begins [m]; ``side``: edge of a cell [m]; ``num``: how many there are.
    """
    cell = (value - low) / side
    return int(min(cell, num - 1.0)) if cell > 0.0 else 0


@compiled_inner
def sort(w: int, alive: Bool, side: float, now: Columns, cells: Cells) -> Grid:
    """Fill ``cells`` with the living of a world, by cell and within a cell by index; where the cells lie.

    ``side`` is that of ``fit``.
    """
    grid, x, y, c, s = fit(w, alive, side, now), now.x, now.y, now.cos, now.sin
    num = grid.rows * grid.columns
    cells.first[: num + 1] = 0
    for i in range(alive.shape[1]):
        if alive[w, i]:
            cell = 0
            if num > 1:
                row, column = (
                    place(x[i], grid.x_min, grid.side, grid.rows),
                    place(y[i], grid.y_min, grid.side, grid.columns),
                )
                cell = row * grid.columns + column
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
