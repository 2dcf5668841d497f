"""The sonar suite (Eq. 8-17): whom each vehicle hears, which obstacles echo, and the percept made of both.

A direction is given by its vector in the body frame, x forward and y starboard. A sub-sector holds the directions
clockwise of its lower edge up to and including its upper edge, so that an edge belongs to the lower index, and arrays
that tile the circle hear every direction once. Membership is decided by signs of cross products alone.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import Offsets
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.cells import Cells, Grid, place
from uuv_marl.sim.compiled import compiled, compiled_inline

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Box = tuple[float, float, float, float]
"""Northern, southern, eastern and western side [m]."""

_MAX_SPEED = 64.0
_TINY = 1e-300
_MIN_BINS = 1024
_REACH_CELLS = 5.0
"""Cells searched around a listener before its empty sub-sectors are followed one by one (perf/, docs/speed.md)."""


class Suite(NamedTuple):
    """The arrays as sub-sectors, whose edges are unit vectors, and the table that finds a direction's sub-sector."""

    lower: Float64
    """Lower edge of each sub-sector, shape (sector, 2)."""
    upper: Float64
    """Upper edge of each sub-sector, shape (sector, 2)."""
    squared_range: Float64
    """Squared range of each sub-sector [m2], and -1 for what no array hears, shape (sector + 1,)."""
    codes: Int64
    """Per layer and bin of direction: a sub-sector, or where the bin holds an edge, sector + 1 + that edge's index.
    Shape (layer, bin); the number of bins is a power of two."""
    edges: Float64
    """Edges between sub-sectors of a layer, shape (edge, 2)."""
    sides: Int64
    """Sub-sectors counter-clockwise and clockwise of each edge, shape (edge, 2)."""
    active: Int64
    """The active sub-sectors, shape (active,)."""
    active_range: Float64
    """Their ranges [m], shape (active,)."""
    reach: float
    """The longest of them [m], 0 for none."""
    reports_surface: bool
    """Whether an echo's position is the surface point heard, not the obstacle's centre."""
    obstacles_hide: bool
    """Whether an obstacle on the line of sight silences a vehicle."""


class Ear(NamedTuple):
    """Scratch for one listener: what it hears, shape (sector + 1,), and whom it listens to, shape (vehicle + 1,)."""

    heard: Int64
    """Index of the vehicle heard, -1 for none."""
    kept: Float64
    """Its squared distance, before the squared range [m2]."""
    kept_ahead: Float64
    kept_abeam: Float64
    """Its position in the listener's body frame [m], 0 for none."""
    nearest: Float64
    """Smallest squared distance in each sub-sector so far [m2]."""
    x: Float64
    y: Float64
    vehicle: Int64
    """Position [m] and index of those gathered from a box of cells."""
    squared: Float64
    ahead: Float64
    abeam: Float64
    """Squared distance [m2] and position in the body frame [m] of those listened to."""
    bin: Int32
    """Bin of their directions."""
    sector: Int64
    """Their sub-sectors."""
    some: Int32
    """Room for a choice of them."""


def suite(scenario: Scenario) -> Suite:
    """The scenario's sonar suite as numbers for the compiled functions. Eq. 12."""
    lower: list[tuple[float, float]] = []
    upper: list[tuple[float, float]] = []
    ranges: list[float] = []
    active: list[int] = []
    for array in scenario.sonar.arrays:
        edges = [
            _unit(array.mounting_deg + array.aperture_deg * (k / array.sub_sectors - 0.5))
            for k in range(array.sub_sectors + 1)
        ]
        if array.kind == "active":
            active += range(len(lower), len(lower) + array.sub_sectors)
        lower += edges[:-1]
        upper += edges[1:]
        ranges += [array.range_m] * array.sub_sectors
    codes, edges, sides = _table(lower, upper)
    return Suite(
        lower=np.array(lower),
        upper=np.array(upper),
        squared_range=np.array([*(range_m * range_m for range_m in ranges), -1.0]),
        codes=codes,
        edges=edges,
        sides=sides,
        active=np.array(active, np.int64),
        active_range=np.array([ranges[k] for k in active]),
        reach=max((ranges[k] for k in active), default=0.0),
        reports_surface=scenario.sonar.echo_reports == "surface",
        obstacles_hide=scenario.sonar.obstacles_hide_vehicles,
    )


def _unit(degrees: float) -> tuple[float, float]:
    """Unit vector of a direction; equal directions give equal bits, whatever turn they were counted in."""
    radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
    return math.cos(radians), math.sin(radians)


@compiled_inline
def cross(a_x: float, a_y: float, b_x: float, b_y: float) -> float:
    """Positive where b is clockwise of a, by less than half a turn."""
    return a_x * b_y - a_y * b_x


@compiled_inline
def diamond(b_x: float, b_y: float) -> float:
    """Direction of b on a scale from 0 (astern) clockwise over port, 2 (ahead), starboard to 4; 2 for no direction."""
    share = b_y / (abs(b_x) + abs(b_y) + _TINY)
    behind = 4.0 - share if b_y >= 0.0 else -share
    return 2.0 + share if b_x >= 0.0 else behind


def _table(lower: list[tuple[float, float]], upper: list[tuple[float, float]]) -> tuple[Int64, Float64, Int64]:
    """``Suite``'s codes, edges and sides.

    A layer holds sub-sectors that do not overlap, arrays that do fall into several. A bin is so narrow that it holds
    one edge of its layer at most, with room for rounding.
    """
    start = [diamond(*edge) for edge in lower]
    span = [(diamond(*b) - diamond(*a)) % 4.0 for a, b in zip(lower, upper, strict=True)]
    bins = max(_MIN_BINS, 2 ** math.ceil(math.log2(12.0 / min(span))))
    apart = 12.0 / bins

    def follows(b: int, a: int) -> bool:
        """Whether sub-sector b starts at or clear beyond the end of a."""
        return upper[a] == lower[b] or (start[b] - start[a]) % 4.0 >= span[a] + apart

    layers: list[list[int]] = []
    for k in range(len(lower)):
        layer = next((held for held in layers if all(follows(k, m) and follows(m, k) for m in held)), None)
        if layer is None:
            layers.append([k])
        else:
            layer.append(k)
    none = len(lower)
    codes = np.full((len(layers), bins), none, np.int64)
    edges: list[tuple[float, float]] = []
    sides: list[list[int]] = []
    for row, layer in zip(codes, layers, strict=True):
        middle = (np.arange(bins) + 0.5) * 4.0 / bins
        for k in layer:
            row[(middle - start[k]) % 4.0 < span[k]] = k
        for edge in dict.fromkeys([*(lower[k] for k in layer), *(upper[k] for k in layer)]):
            below = next((k for k in layer if upper[k] == edge), none)
            above = next((k for k in layer if lower[k] == edge), none)
            at = diamond(*edge) / 4.0 * bins
            row[[int((at + side) % bins) for side in (-1e-6, 1e-6)]] = none + 1 + len(edges)
            edges.append(edge)
            sides.append([below, above])
    return codes, np.array(edges), np.array(sides, np.int64)


@compiled
def hidden(x: float, y: float, dx: float, dy: float, w: int, obstacles: Float64, num_obstacles: int) -> bool:
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy)."""
    length2 = dx * dx + dy * dy
    for k in range(num_obstacles):
        o_x, o_y = obstacles[w, k, 0] - x, obstacles[w, k, 1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if math.hypot(o_x - share * dx, o_y - share * dy) < obstacles[w, k, 2]:
            return True
    return False


@compiled_inline
def locate(num: int, xs: Float64, ys: Float64, x: float, y: float, c: float, s: float, bins: int, ear: Ear) -> None:
    """Where the first ``num`` of the points (xs, ys) are for a listener at (x, y), heading (c, s); itself nowhere."""
    per_unit, last = 0.25 * bins, np.int32(bins - 1)
    for q in range(num):
        dx, dy = xs[q] - x, ys[q] - y
        squared = dx * dx + dy * dy
        b_x, b_y = c * dx + s * dy, c * dy - s * dx
        ear.squared[q] = squared if squared > 0.0 else math.inf
        ear.ahead[q], ear.abeam[q] = b_x, b_y
        ear.bin[q] = np.int32(diamond(b_x, b_y) * per_unit) & last  # astern is 4 and 0; no direction (NaN) is any bin


@compiled_inline
def choose_sectors(num: int, layer: int, suite: Suite, ear: Ear) -> None:
    """The sub-sector of a layer for each of those located. Eq. 12-13.

    No branch depends on the positions: a wrongly guessed branch costs more than all the arithmetic here.
    """
    none, num_edges = suite.lower.shape[0], 0
    for q in range(num):
        # Unsigned, since Numba spends longer on the sign of an index than on looking it up.
        code = suite.codes[layer, np.uintp(ear.bin[q])]
        ear.sector[q], ear.some[num_edges] = code, q
        num_edges += int(code > none)
    for t in range(num_edges):
        q = np.uintp(ear.some[t])
        edge = np.uintp(ear.sector[q] - none - 1)
        side = int(cross(suite.edges[edge, 0], suite.edges[edge, 1], ear.ahead[q], ear.abeam[q]) > 0.0)
        ear.sector[q] = suite.sides[edge, side]


@compiled_inline
def keep_nearest(num: int, vehicles: Int64, ear: Ear) -> None:
    """Of those located keep the nearest in each sub-sector, the lower index of equals. Eq. 14-15."""
    for q in range(num):
        k = np.uintp(ear.sector[q])
        ear.nearest[k] = ear.squared[q] if ear.squared[q] < ear.nearest[k] else ear.nearest[k]
    num_nearest = 0
    for q in range(num):
        ear.some[num_nearest] = q
        num_nearest += int(ear.squared[q] <= ear.nearest[np.uintp(ear.sector[q])])
    for t in range(num_nearest):
        q = np.uintp(ear.some[t])
        k = np.uintp(ear.sector[q])
        if ear.squared[q] < ear.kept[k] or (ear.squared[q] == ear.kept[k] and vehicles[q] < ear.heard[k]):
            ear.kept[k], ear.heard[k] = ear.squared[q], vehicles[q]
            ear.kept_ahead[k], ear.kept_abeam[k] = ear.ahead[q], ear.abeam[q]


@compiled_inline
def listen(
    num: int, xs: Float64, ys: Float64, vehicles: Int64, x: float, y: float, c: float, s: float, w: int,
    obstacles: Float64, hiding: int, suite: Suite, ear: Ear,
) -> None:  # fmt: skip
    """A listener at (x, y) hears the first ``num`` of these vehicles, unless one of ``hiding`` obstacles is between."""
    locate(num, xs, ys, x, y, c, s, suite.codes.shape[1], ear)
    if hiding > 0:
        for q in range(num):
            if hidden(x, y, xs[q] - x, ys[q] - y, w, obstacles, hiding):
                ear.squared[q] = math.inf
    for layer in range(suite.codes.shape[0]):
        choose_sectors(num, layer, suite, ear)
        keep_nearest(num, vehicles, ear)


@compiled
def gather(box: Box, cells: Cells, grid: Grid, ear: Ear) -> int:
    """Collect the entries of the cells that meet a rectangle of the world; how many."""
    north, south, east, west = box
    left, right = place(west, grid.y_min, grid.side, grid.columns), place(east, grid.y_min, grid.side, grid.columns)
    top, bottom = place(north, grid.x_min, grid.side, grid.rows), place(south, grid.x_min, grid.side, grid.rows)
    num = 0
    for row in range(bottom, top + 1):
        for q in range(cells.first[row * grid.columns + left], cells.first[row * grid.columns + right + 1]):
            ear.x[num], ear.y[num], ear.vehicle[num] = cells.x[q], cells.y[q], cells.vehicle[q]
            num += 1
    return num


@compiled_inline
def hear(
    p: int, w: int, obstacles: Float64, num_obstacles: int, cells: Cells, grid: Grid, suite: Suite, ear: Ear
) -> None:
    """Fill ``ear`` for entry p of ``cells``: from the cells around it, then farther out where a sub-sector is empty."""
    x, y, c, s = cells.x[p], cells.y[p], cells.cos[p], cells.sin[p]
    sectors, hiding = suite.lower.shape[0], num_obstacles if suite.obstacles_hide else 0
    for k in range(sectors + 1):
        ear.nearest[k] = ear.kept[k] = suite.squared_range[k]
        ear.kept_ahead[k] = ear.kept_abeam[k] = 0.0
        ear.heard[k] = -1
    if grid.rows * grid.columns == 1:
        listen(grid.living, cells.x, cells.y, cells.vehicle, x, y, c, s, w, obstacles, hiding, suite, ear)
        return
    reach = _REACH_CELLS * grid.side
    box = x + reach, x - reach, y + reach, y - reach
    # First all within reach; then sub-sector by sub-sector, farther and farther until nobody nearer can be missed.
    k, near = -1, 0.0
    while k < sectors:
        num = gather(box, cells, grid, ear)
        listen(num, ear.x, ear.y, ear.vehicle, x, y, c, s, w, obstacles, hiding, suite, ear)
        near *= 1.5
        while k < sectors and (k < 0 or near * near > ear.nearest[k]):
            k, near = k + 1, reach
        box = reached(min(k, sectors - 1), near, 1.5 * near, x, y, c, s, suite)


@compiled
def reached(k: int, near: float, far: float, x: float, y: float, c: float, s: float, suite: Suite) -> Box:
    """Rectangle around what sub-sector k of a listener at (x, y) hears between two distances [m]."""
    l_x, l_y, u_x, u_y = suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
    # The far edges are lengthened so that their chord clears the arc: by 1 / cos of half the width.
    far *= math.sqrt(2.0 / (1.0 + l_x * u_x + l_y * u_y))
    l_x, l_y, u_x, u_y = c * l_x - s * l_y, s * l_x + c * l_y, c * u_x - s * u_y, s * u_x + c * u_y
    room = 1e-9 * far  # for rounding
    return (
        x + max(near * l_x, far * l_x, near * u_x, far * u_x) + room,
        x + min(near * l_x, far * l_x, near * u_x, far * u_x) - room,
        y + max(near * l_y, far * l_y, near * u_y, far * u_y) + room,
        y + min(near * l_y, far * l_y, near * u_y, far * u_y) - room,
    )


@compiled
def echo(
    c_x: float, c_y: float, radius: float, l_x: float, l_y: float, u_x: float, u_y: float
) -> tuple[float, float, float]:
    """Range and nearest point, in the body frame, of a disc's surface within a beam; range infinite for none.

    The disc is centred on c, the beam lies between the unit vectors l and u. Inside the disc the range is 0.
    """
    distance = math.hypot(c_x, c_y)
    if distance <= radius:
        return 0.0, 0.0, 0.0
    if cross(l_x, l_y, c_x, c_y) > 0.0 and cross(u_x, u_y, c_x, c_y) <= 0.0:
        share = 1.0 - radius / distance
        return distance - radius, share * c_x, share * c_y
    best, p_x, p_y = math.inf, 0.0, 0.0
    for edge in range(2):
        e_x, e_y = (l_x, l_y) if edge == 0 else (u_x, u_y)
        along, off = e_x * c_x + e_y * c_y, cross(e_x, e_y, c_x, c_y)
        if along > 0.0 and abs(off) <= radius:
            reach = along - math.sqrt(radius * radius - off * off)
            if reach < best:
                best, p_x, p_y = reach, reach * e_x, reach * e_y
    return best, p_x, p_y


@compiled
def saturate(value: float, limit: float) -> float:
    """The nearest value within [-limit, limit]."""
    return min(max(value, -limit), limit)


@compiled_inline
def write_percept(
    p: int,
    w: int,
    nu: Float64,
    reference: Float64,
    obstacles: Float64,
    num_obstacles: int,
    cells: Cells,
    suite: Suite,
    ear: Ear,
    at: Offsets,
    out: Float32,
) -> None:
    """What entry p of ``cells`` knows in world w, as a flat vector in physical units. Eq. 11, 14-17."""
    i = cells.vehicle[p]
    x, y, c, s = cells.x[p], cells.y[p], cells.cos[p], cells.sin[p]
    for k in range(out.shape[2]):
        out[w, i, k] = 0.0
    out[w, i, at.velocity] = saturate(nu[w, i, 0], _MAX_SPEED)
    out[w, i, at.velocity + 1] = saturate(nu[w, i, 1], _MAX_SPEED)
    out[w, i, at.yaw_rate] = saturate(nu[w, i, 2], _MAX_SPEED)
    dx, dy = reference[w, 0] - x, reference[w, 1] - y
    v_x, v_y = reference[w, 2], reference[w, 3]
    far = max(math.sqrt(dx * dx + dy * dy) / MAX_RANGE_M, 1.0)
    out[w, i, at.reference] = saturate((c * dx + s * dy) / far, MAX_RANGE_M)
    out[w, i, at.reference + 1] = saturate((c * dy - s * dx) / far, MAX_RANGE_M)
    out[w, i, at.reference_velocity] = saturate(c * v_x + s * v_y, _MAX_SPEED)
    out[w, i, at.reference_velocity + 1] = saturate(c * v_y - s * v_x, _MAX_SPEED)
    for k in range(suite.lower.shape[0]):
        j = ear.heard[k]
        out[w, i, at.heard + k] = 1.0 if j >= 0 else 0.0
        out[w, i, at.neighbour + 2 * k] = ear.kept_ahead[k]
        out[w, i, at.neighbour + 2 * k + 1] = ear.kept_abeam[k]
        if at.link_identity >= 0 and j >= 0:
            c_j, s_j = cells.cos[cells.entry[j]], cells.sin[cells.entry[j]]
            v_x, v_y = c_j * nu[w, j, 0] - s_j * nu[w, j, 1], s_j * nu[w, j, 0] + c_j * nu[w, j, 1]
            out[w, i, at.link_identity + k] = j + 1
            out[w, i, at.link_velocity + 2 * k] = saturate(c * v_x + s * v_y, _MAX_SPEED)
            out[w, i, at.link_velocity + 2 * k + 1] = saturate(c * v_y - s * v_x, _MAX_SPEED)
    if at.compass >= 0:
        out[w, i, at.compass], out[w, i, at.compass + 1] = c, s
    for m in range(num_obstacles):
        dx, dy = obstacles[w, m, 0] - x, obstacles[w, m, 1] - y
        if math.sqrt(dx * dx + dy * dy) - obstacles[w, m, 2] < suite.reach:
            write_echoes(i, w, x, y, c, s, obstacles, num_obstacles, suite, at, out)
            break


@compiled
def write_echoes(
    i: int, w: int, x: float, y: float, c: float, s: float, obstacles: Float64, num_obstacles: int, suite: Suite,
    at: Offsets, out: Float32,
) -> None:  # fmt: skip
    """What vehicle i hears of obstacles: per active sub-sector the nearest surface. Eq. 11, 16-17."""
    for a in range(suite.active.shape[0]):
        k = suite.active[a]
        best = suite.active_range[a]
        for m in range(num_obstacles):
            dx, dy, radius = obstacles[w, m, 0] - x, obstacles[w, m, 1] - y, obstacles[w, m, 2]
            if math.sqrt(dx * dx + dy * dy) - radius >= best:
                continue
            c_x, c_y = c * dx + s * dy, c * dy - s * dx
            reach, p_x, p_y = echo(
                c_x, c_y, radius, suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
            )
            if reach < best:
                best = reach
                if not suite.reports_surface:
                    p_x, p_y = c_x, c_y
                out[w, i, at.echo + a] = 1.0
                out[w, i, at.echo_range + a] = reach
                out[w, i, at.echo_position + 2 * a] = saturate(p_x, MAX_RANGE_M)
                out[w, i, at.echo_position + 2 * a + 1] = saturate(p_y, MAX_RANGE_M)
