"""The sonar suite (Eq. 8-17), and spacing, clearance and contacts from the same pass over pairs.

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
from uuv_marl.sim.compiled import compiled, compiled_inline

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

_MAX_SPEED = 64.0


class Suite(NamedTuple):
    """The arrays as fans of less than 180 degrees, each a run of sub-sectors. Edges are unit vectors."""

    lower: Float64
    """Lower edge of each sub-sector, shape (sector, 2)."""
    upper: Float64
    """Upper edge of each sub-sector, shape (sector, 2)."""
    fan_first: Int64
    """First sub-sector of each fan, and the number of sub-sectors, shape (fan + 1,)."""
    fan_range: Float64
    """Range of each fan [m], shape (fan,)."""
    active: Int64
    """The active sub-sectors, shape (active,)."""
    active_range: Float64
    """Their ranges [m], shape (active,)."""
    reports_surface: bool
    """Whether an echo's position is the surface point heard, not the obstacle's centre."""
    obstacles_hide: bool
    """Whether an obstacle on the line of sight silences a vehicle."""


class Survey(NamedTuple):
    """What one pass over the pairs of a world finds. Distances in m, infinite where there is nothing to measure."""

    heading: Float64
    """Cosine and sine of psi, shape (vehicle, 2)."""
    nearest: Float64
    """Squared distance of the vehicle heard in each sub-sector, shape (vehicle, sector)."""
    heard: Int32
    """Its index, -1 for none, shape (vehicle, sector)."""
    spacing: Float64
    """Smallest distance to another vehicle, shape (vehicle,)."""
    clearance: Float64
    """Smallest distance to an obstacle's surface, shape (vehicle,)."""
    obstacle_clearance: Float64
    """Smallest surface distance of any vehicle to each obstacle, shape (obstacle,)."""
    contacts: Int64
    """Contact episodes that began, counted for each vehicle in them, shape (vehicle,)."""
    extremes: Float64
    """Smallest spacing, largest spacing, contact episodes that began, shape (3,)."""


def suite(scenario: Scenario) -> Suite:
    """The scenario's sonar suite as numbers for the compiled functions. Eq. 12."""
    lower: list[tuple[float, float]] = []
    upper: list[tuple[float, float]] = []
    fan_first: list[int] = []
    fan_range: list[float] = []
    active: list[int] = []
    active_range: list[float] = []
    for array in scenario.sonar.arrays:
        width = array.aperture_deg / array.sub_sectors
        per_fan = max(1, math.ceil(180.0 / width) - 1)
        edges = [
            _unit(array.mounting_deg + array.aperture_deg * (k / array.sub_sectors - 0.5))
            for k in range(array.sub_sectors + 1)
        ]
        for k in range(array.sub_sectors):
            if k % per_fan == 0:
                fan_first.append(len(lower))
                fan_range.append(array.range_m)
            if array.kind == "active":
                active.append(len(lower))
                active_range.append(array.range_m)
            lower.append(edges[k])
            upper.append(edges[k + 1])
    return Suite(
        lower=np.array(lower),
        upper=np.array(upper),
        fan_first=np.array([*fan_first, len(lower)], np.int64),
        fan_range=np.array(fan_range),
        active=np.array(active, np.int64),
        active_range=np.array(active_range),
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
def hear(
    i: int,
    j: int,
    b_x: float,
    b_y: float,
    squared: float,
    lower: Float64,
    upper: Float64,
    fan_first: Int64,
    fan_range: Float64,
    nearest: Float64,
    heard: Int32,
) -> None:
    """Vehicle i keeps vehicle j, at body position b, where j is the nearest of its sub-sector. Eq. 8-9, 13-15.

    Arrays one by one, whole and not by row: a tuple of them, or a slice, costs more than the arithmetic.
    """
    for fan in range(fan_range.shape[0]):
        first, end = fan_first[fan], fan_first[fan + 1]
        if (
            squared < fan_range[fan] * fan_range[fan]
            and cross(lower[first, 0], lower[first, 1], b_x, b_y) > 0.0
            and cross(upper[end - 1, 0], upper[end - 1, 1], b_x, b_y) <= 0.0
        ):
            k = first
            for inner in range(first, end - 1):
                k += int(cross(upper[inner, 0], upper[inner, 1], b_x, b_y) > 0.0)
            if squared < nearest[i, k]:
                nearest[i, k] = squared
                heard[i, k] = j


@compiled
def hidden(x: float, y: float, dx: float, dy: float, obstacles: Float64, num_obstacles: int) -> bool:
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy)."""
    length2 = dx * dx + dy * dy
    for k in range(num_obstacles):
        o_x, o_y = obstacles[k, 0] - x, obstacles[k, 1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if math.hypot(o_x - share * dx, o_y - share * dy) < obstacles[k, 2]:
            return True
    return False


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
def survey_obstacles(
    i: int, x: float, y: float, before: Float64, obstacles: Float64, num_obstacles: int, hull: float, found: Survey
) -> float:
    """Clearances of vehicle i at (x, y); how many contact episodes with obstacles began."""
    began = 0.0
    for k in range(num_obstacles):
        gap = math.hypot(obstacles[k, 0] - x, obstacles[k, 1] - y) - obstacles[k, 2]
        found.clearance[i] = min(found.clearance[i], gap)
        found.obstacle_clearance[k] = min(found.obstacle_clearance[k], gap)
        if gap < hull:
            was = math.hypot(obstacles[k, 0] - before[i, 0], obstacles[k, 1] - before[i, 1]) - obstacles[k, 2]
            if was >= hull:
                found.contacts[i] += 1
                began += 1.0
    return began


@compiled
def survey_world(
    eta: Float64,
    before: Float64,
    alive: Bool,
    obstacles: Float64,
    num_obstacles: int,
    hull: float,
    listens: bool,
    suite: Suite,
    found: Survey,
) -> None:
    """One pass over all pairs, and over vehicles and obstacles; fills ``found``.

    A contact episode begins where two hulls, or a hull and an obstacle, overlap at ``eta`` and did not at ``before``.
    """
    n = eta.shape[0]
    found.nearest[:] = math.inf
    found.heard[:] = -1
    found.spacing[:] = math.inf
    found.clearance[:] = math.inf
    found.obstacle_clearance[:] = math.inf
    found.contacts[:] = 0
    for i in range(n):
        found.heading[i, 0], found.heading[i, 1] = math.cos(eta[i, 2]), math.sin(eta[i, 2])
    least, most, began = math.inf, -math.inf, 0.0
    touch = 4.0 * hull * hull
    for i in range(n):
        if not alive[i]:
            continue
        x, y = eta[i, 0], eta[i, 1]
        c_i, s_i = found.heading[i, 0], found.heading[i, 1]
        for j in range(i):
            if not alive[j]:
                continue
            dx, dy = eta[j, 0] - x, eta[j, 1] - y
            squared = dx * dx + dy * dy
            found.spacing[i] = min(found.spacing[i], squared)
            found.spacing[j] = min(found.spacing[j], squared)
            most = max(most, squared)
            if squared < touch:
                was_x, was_y = before[j, 0] - before[i, 0], before[j, 1] - before[i, 1]
                if was_x * was_x + was_y * was_y >= touch:
                    found.contacts[i] += 1
                    found.contacts[j] += 1
                    began += 1.0
            if listens and not (suite.obstacles_hide and hidden(x, y, dx, dy, obstacles, num_obstacles)):
                hear(
                    i, j, c_i * dx + s_i * dy, c_i * dy - s_i * dx, squared,
                    suite.lower, suite.upper, suite.fan_first, suite.fan_range, found.nearest, found.heard,
                )  # fmt: skip
                c_j, s_j = found.heading[j, 0], found.heading[j, 1]
                hear(
                    j, i, -c_j * dx - s_j * dy, s_j * dx - c_j * dy, squared,
                    suite.lower, suite.upper, suite.fan_first, suite.fan_range, found.nearest, found.heard,
                )  # fmt: skip
        began += survey_obstacles(i, x, y, before, obstacles, num_obstacles, hull, found)
    for i in range(n):
        found.spacing[i] = math.sqrt(found.spacing[i])
        least = min(least, found.spacing[i])
    found.extremes[0] = least
    found.extremes[1] = math.sqrt(most) if most >= 0.0 else math.inf
    found.extremes[2] = began


@compiled
def saturate(value: float, limit: float) -> float:
    """The nearest value within [-limit, limit]."""
    return min(max(value, -limit), limit)


@compiled
def write_percept(
    i: int,
    eta: Float64,
    nu: Float64,
    heading: Float64,
    heard: Int32,
    reference: tuple[float, float, float, float],
    obstacles: Float64,
    num_obstacles: int,
    suite: Suite,
    at: Offsets,
    out: Float32,
) -> None:
    """The percept of vehicle i as a flat vector in physical units. Eq. 11, 14-17."""
    out[:] = 0.0
    x, y = eta[i, 0], eta[i, 1]
    c, s = heading[i, 0], heading[i, 1]
    out[at.velocity] = saturate(nu[i, 0], _MAX_SPEED)
    out[at.velocity + 1] = saturate(nu[i, 1], _MAX_SPEED)
    out[at.yaw_rate] = saturate(nu[i, 2], _MAX_SPEED)
    l_x, l_y, l_vx, l_vy = reference
    dx, dy = l_x - x, l_y - y
    far = max(math.hypot(dx, dy) / MAX_RANGE_M, 1.0)
    out[at.reference] = saturate((c * dx + s * dy) / far, MAX_RANGE_M)
    out[at.reference + 1] = saturate((c * dy - s * dx) / far, MAX_RANGE_M)
    out[at.reference_velocity] = saturate(c * l_vx + s * l_vy, _MAX_SPEED)
    out[at.reference_velocity + 1] = saturate(c * l_vy - s * l_vx, _MAX_SPEED)
    for k in range(heard.shape[0]):
        j = heard[k]
        if j < 0:
            continue
        dx, dy = eta[j, 0] - x, eta[j, 1] - y
        out[at.heard + k] = 1.0
        out[at.neighbour + 2 * k] = c * dx + s * dy
        out[at.neighbour + 2 * k + 1] = c * dy - s * dx
        if at.link_identity >= 0:
            c_j, s_j = heading[j, 0], heading[j, 1]
            v_x, v_y = c_j * nu[j, 0] - s_j * nu[j, 1], s_j * nu[j, 0] + c_j * nu[j, 1]
            out[at.link_identity + k] = j + 1
            out[at.link_velocity + 2 * k] = saturate(c * v_x + s * v_y, _MAX_SPEED)
            out[at.link_velocity + 2 * k + 1] = saturate(c * v_y - s * v_x, _MAX_SPEED)
    if at.compass >= 0:
        out[at.compass], out[at.compass + 1] = c, s
    for a in range(suite.active.shape[0]):
        k = suite.active[a]
        best = suite.active_range[a]
        for m in range(num_obstacles):
            dx, dy = obstacles[m, 0] - x, obstacles[m, 1] - y
            if math.hypot(dx, dy) - obstacles[m, 2] >= best:
                continue
            c_x, c_y = c * dx + s * dy, c * dy - s * dx
            reach, p_x, p_y = echo(
                c_x, c_y, obstacles[m, 2], suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
            )
            if reach < best:
                best = reach
                if not suite.reports_surface:
                    p_x, p_y = c_x, c_y
                out[at.echo + a] = 1.0
                out[at.echo_range + a] = reach
                out[at.echo_position + 2 * a] = saturate(p_x, MAX_RANGE_M)
                out[at.echo_position + 2 * a + 1] = saturate(p_y, MAX_RANGE_M)
