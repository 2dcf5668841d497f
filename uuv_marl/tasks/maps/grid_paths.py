"""Collision-free paths through a map, on a grid: whether there is one, and its length.

Whether a cell is free takes products and sums alone, so that every processor accepts the same maps. Lengths serve
reference times, time limits, critics, the reward ``geodesic`` and the channel ``path``.
"""

import functools
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import label
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float64, Int32, Int64

CELL_M = 2.5
"""Side of a cell [m]. Assumed: fine enough for gaps of 10 m, and quick."""
_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Steps to neighbours; with a knight's moves a length is at most 2.8 % too long (1 / cos 13.3 deg)."""


class MapGrid(NamedTuple):
    """Cells in the frame of a map (``walls.py``)."""

    x: float
    """Centre of the first cell [m]."""
    y: float
    rows: int
    """Along x."""
    columns: int

    def cell(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Row and column of the cell nearest to a place [m], or, for arrays of places, arrays of them."""
        row, column = np.rint((x - self.x) / CELL_M), np.rint((y - self.y) / CELL_M)
        return np.clip(row, 0, self.rows - 1).astype(np.int64), np.clip(column, 0, self.columns - 1).astype(np.int64)


def free_cells(discs: Float64, grid: MapGrid, clearance: float) -> Bool:
    """Cells whose centres keep a clearance [m] from all discs, shape (row, column)."""
    free = np.ones((grid.rows, grid.columns), np.bool_)
    _stamp(discs, grid.x, grid.y, clearance, free)
    return free


def reached(free: Bool, row: int, column: int) -> Bool:
    """Free cells connected to one of them by their sides, shape (row, column); none if that one is not free."""
    parts: Any = label(free)[0]
    return free & (parts == parts[row, column])


def distances(free: Bool, row: int, column: int, price: Float64 | None = None) -> Float64:
    """Length of the shortest collision-free path [m] from each cell to one, shape (row, column); infinite if none.

    ``price``: factor of the length in each cell, shape (row, column); None for 1.
    """
    first, second, length, indptr = _edges(*free.shape)
    flat = free.ravel()
    weights = np.where(flat[first] & flat[second], length, np.inf)
    if price is not None:
        weights *= 0.5 * (price.ravel()[first] + price.ravel()[second])
    graph = csr_array((weights, second, indptr), shape=(free.size, free.size))
    shortest: Any = dijkstra
    lengths: Float64 = shortest(graph, directed=True, indices=row * free.shape[1] + column)
    return np.where(free, lengths.reshape(free.shape), np.inf)


@functools.cache
def _edges(rows: int, columns: int) -> tuple[Int64, Int32, Float64, Int32]:
    """All steps on a grid: from, to, length [m], and the index of each cell's first."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    first, second, length = [], [], []
    for d_r, d_c in (*_STEPS, *((-a, -b) for a, b in _STEPS)):
        inside = (row + d_r >= 0) & (row + d_r < rows) & (column + d_c >= 0) & (column + d_c < columns)
        at = np.flatnonzero(inside)
        first.append(at)
        second.append(at + d_r * columns + d_c)
        length.append(np.full(len(at), CELL_M * np.sqrt(d_r * d_r + d_c * d_c)))
    one, other, far = map(np.concatenate, (first, second, length))
    order = np.lexsort((other, one))
    indptr = np.concatenate([[0], np.cumsum(np.bincount(one, minlength=rows * columns))])
    return one[order], other[order].astype(np.int32), far[order], indptr.astype(np.int32)


@compiled
def _stamp(discs: Float64, x: float, y: float, clearance: float, free: Bool) -> None:
    """Clear the cells of ``free`` (row, column) that are nearer than ``clearance`` [m] to a disc (disc, 3)."""
    rows, columns = free.shape
    for m in range(discs.shape[0]):
        near = discs[m, 2] + clearance
        top, bottom = int((discs[m, 0] - near - x) / CELL_M) - 1, int((discs[m, 0] + near - x) / CELL_M) + 2
        left, right = int((discs[m, 1] - near - y) / CELL_M) - 1, int((discs[m, 1] + near - y) / CELL_M) + 2
        for i in range(max(top, 0), min(bottom, rows)):
            for j in range(max(left, 0), min(right, columns)):
                dx, dy = x + i * CELL_M - discs[m, 0], y + j * CELL_M - discs[m, 1]
                if dx * dx + dy * dy < near * near:
                    free[i, j] = False
