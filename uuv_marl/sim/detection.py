"""Detections of vehicles (Eq. 8-9, 12-15): the nearest in each sub-sector, unless an obstacle hides it."""

import math

import numpy as np

from uuv_marl.sim.arrays import WorldMap
from uuv_marl.sim.cells import Box, Grid, covered
from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.sonar import SonarSuite, cross, diamond
from uuv_marl.sim.workspace import Cells, Listener, Workspace
from uuv_marl.types import Float64, Int64

Points = tuple[Float64, Float64, Int64]
"""North and east [m] and index of vehicles, shape (vehicle,) each."""
Pose = tuple[float, float, float, float]
"""North and east [m], cosine and sine of the heading."""

_REACH_CELLS = 5.0
"""Cells searched around a listener before its empty sub-sectors one by one; the fastest of 2.5, 3.5 and 5."""


@compiled_inner
def hidden(x: float, y: float, dx: float, dy: float, w: int, world_map: WorldMap) -> bool:
    """Whether an obstacle intersects the segment from (x, y) to (x + dx, y + dy) [m]."""
    obstacles, length2 = world_map.obstacles, dx * dx + dy * dy
    for k in range(world_map.num_obstacles[w]):
        o_x, o_y = obstacles[w, k, 0] - x, obstacles[w, k, 1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if math.hypot(o_x - share * dx, o_y - share * dy) < obstacles[w, k, 2]:
            return True
    return False


@compiled_inline
def locate(num: int, points: Points, pose: Pose, bins: int, listener: Listener) -> None:
    """Write squared distances, body-frame positions and bins of points, for a listener; its own distance is infinite.

    ``bins``: number of bins of the full circle of directions, a power of two.
    """
    (xs, ys, _), (x, y, c, s) = points, pose
    per_unit, last = 0.25 * bins, np.int32(bins - 1)
    for q in range(num):
        dx, dy = xs[q] - x, ys[q] - y
        squared = dx * dx + dy * dy
        b_x, b_y = c * dx + s * dy, c * dy - s * dx
        listener.squared[q] = squared if squared > 0.0 else math.inf
        listener.ahead[q], listener.abeam[q] = b_x, b_y
        # Astern is 4 and 0; NaN may give any bin.
        listener.bin[q] = np.int32(diamond(b_x, b_y) * per_unit) & last


@compiled_inline
def choose_sectors(num: int, layer: int, suite: SonarSuite, listener: Listener) -> None:
    """Find each located point's sub-sector in a layer, a row of ``suite.codes``; outside all, their number. Eq. 12-13.

    No branch depends on the positions, since a mispredicted branch costs more than the arithmetic here.
    """
    none, num_edges = suite.lower.shape[0], 0
    for q in range(num):
        # Unsigned, since Numba checks the sign of an index, which takes longer than the look-up.
        code = suite.codes[layer, np.uintp(listener.bin[q])]
        listener.sector[q], listener.some[num_edges] = code, q
        num_edges += int(code > none)
    for t in range(num_edges):
        q = np.uintp(listener.some[t])
        edge = np.uintp(listener.sector[q] - none - 1)
        side = int(cross(suite.edges[edge, 0], suite.edges[edge, 1], listener.ahead[q], listener.abeam[q]) > 0.0)
        listener.sector[q] = suite.sides[edge, side]


@compiled_inline
def keep_nearest(num: int, vehicles: Int64, listener: Listener) -> None:
    """Keep the nearest located point of each sub-sector, the lower index of equal ones. Eq. 14-15."""
    for q in range(num):
        k = np.uintp(listener.sector[q])
        listener.nearest[k] = listener.squared[q] if listener.squared[q] < listener.nearest[k] else listener.nearest[k]
    num_nearest = 0
    for q in range(num):
        listener.some[num_nearest] = q
        num_nearest += int(listener.squared[q] <= listener.nearest[np.uintp(listener.sector[q])])
    for t in range(num_nearest):
        q = np.uintp(listener.some[t])
        k = np.uintp(listener.sector[q])
        if listener.squared[q] < listener.detected_squared[k] or (
            listener.squared[q] == listener.detected_squared[k] and vehicles[q] < listener.detected_index[k]
        ):
            listener.detected_squared[k], listener.detected_index[k] = listener.squared[q], vehicles[q]
            listener.detected_ahead[k], listener.detected_abeam[k] = listener.ahead[q], listener.abeam[q]


@compiled_inline
def detect_among(
    num: int, points: Points, pose: Pose, w: int, world_map: WorldMap, suite: SonarSuite, listener: Listener
) -> None:
    """Update a listener's detections with the first ``num`` of some vehicles, except those that an obstacle hides."""
    locate(num, points, pose, suite.codes.shape[1], listener)
    xs, ys, vehicles = points
    if suite.obstacles_hide and world_map.num_obstacles[w] > 0:
        for q in range(num):
            if hidden(pose[0], pose[1], xs[q] - pose[0], ys[q] - pose[1], w, world_map):
                listener.squared[q] = math.inf
    for layer in range(suite.codes.shape[0]):
        choose_sectors(num, layer, suite, listener)
        keep_nearest(num, vehicles, listener)


@compiled_inner
def gather(box: Box, cells: Cells, grid: Grid, listener: Listener) -> int:
    """Collect the entries of the cells that meet a rectangle; return how many."""
    bottom, top, left, right = covered(box, grid)
    num = 0
    for row in range(bottom, top + 1):
        for q in range(cells.first[row * grid.columns + left], cells.first[row * grid.columns + right + 1]):
            listener.x[num], listener.y[num], listener.vehicle[num] = cells.x[q], cells.y[q], cells.vehicle[q]
            num += 1
    return num


@compiled_inline
def detect(p: int, w: int, world_map: WorldMap, suite: SonarSuite, workspace: Workspace, grid: Grid) -> None:
    """Detect vehicles for entry p: around it, then farther out where a sub-sector is empty. Eq. 8-9, 12-15."""
    cells, listener, sectors = workspace.cells, workspace.listener, suite.lower.shape[0]
    pose = cells.x[p], cells.y[p], cells.cos[p], cells.sin[p]
    for k in range(sectors + 1):
        listener.nearest[k] = listener.detected_squared[k] = suite.squared_range[k]
        listener.detected_ahead[k] = listener.detected_abeam[k] = 0.0
        listener.detected_index[k] = -1
    if grid.rows * grid.columns == 1:
        detect_among(grid.living, (cells.x, cells.y, cells.vehicle), pose, w, world_map, suite, listener)
        return
    reach = _REACH_CELLS * grid.side
    around = pose[0] + reach, pose[0] - reach, pose[1] + reach, pose[1] - reach
    detect_within(around, pose, w, world_map, suite, workspace, grid)
    for k in range(sectors):  # outward, until no nearer vehicle can be missed
        near = reach
        while near * near <= listener.nearest[k]:
            detect_within(sector_box(k, near, 1.5 * near, pose, suite), pose, w, world_map, suite, workspace, grid)
            near *= 1.5


@compiled_inner
def detect_within(
    box: Box, pose: Pose, w: int, world_map: WorldMap, suite: SonarSuite, workspace: Workspace, grid: Grid
) -> None:
    """Update a listener's detections with the vehicles in a rectangle."""
    listener = workspace.listener
    num = gather(box, workspace.cells, grid, listener)
    detect_among(num, (listener.x, listener.y, listener.vehicle), pose, w, world_map, suite, listener)


@compiled_inner
def sector_box(k: int, near: float, far: float, pose: Pose, suite: SonarSuite) -> Box:
    """Bounding rectangle of a sub-sector between two distances, ``near`` and ``far`` [m]."""
    x, y, c, s = pose
    l_x, l_y, u_x, u_y = suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
    # Lengthened by 1 / cos of half the width, so that the chord between the far edges lies beyond the arc.
    far *= math.sqrt(2.0 / (1.0 + l_x * u_x + l_y * u_y))
    l_x, l_y, u_x, u_y = c * l_x - s * l_y, s * l_x + c * l_y, c * u_x - s * u_y, s * u_x + c * u_y
    margin = 1e-9 * far  # for rounding
    return (
        x + max(near * l_x, far * l_x, near * u_x, far * u_x) + margin,
        x + min(near * l_x, far * l_x, near * u_x, far * u_x) - margin,
        y + max(near * l_y, far * l_y, near * u_y, far * u_y) + margin,
        y + min(near * l_y, far * l_y, near * u_y, far * u_y) - margin,
    )
