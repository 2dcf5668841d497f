"""The paper's formulas in plain Python, for a vehicle, a pair, a sub-sector at a time; ``engine="plain"`` uses them.

Symbols are those of ``uuv_marl.sim.vehicle``: eta = (x north, y east, psi clockwise from north), nu = (u surge, v sway,
r yaw rate) in the body frame, x forward, y starboard; SI units and radians. Equation numbers are the paper's.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.scenario.hardware import SonarArray
from uuv_marl.sim.trigonometry import cos_sin as compiled_cos_sin
from uuv_marl.sim.vehicle import Plant

Row = Sequence[float]
Rows = Sequence[Row]
"""One row for each vehicle, obstacle (centre north and east, radius [m]), waypoint or sub-sector."""
Pair = tuple[float, float]

_cos_sin: Callable[[float], Pair] = getattr(compiled_cos_sin, "py_func", compiled_cos_sin)


# --- Frames ---


def cos_sin(angle: float) -> Pair:
    """Cosine and sine [rad]: the package's own (``uuv_marl.sim.trigonometry``), whose bits no C library decides."""
    return _cos_sin(angle) if math.isfinite(angle) else (math.nan, math.nan)


def wrap(angle: float) -> float:
    """The same angle [rad] in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


def to_world(ahead: float, abeam: float, heading: Row) -> Pair:
    """R(psi): a vector's north and east from the body frame. ``heading`` holds cos psi and sin psi. Eq. 1."""
    return heading[0] * ahead - heading[1] * abeam, heading[1] * ahead + heading[0] * abeam


def to_body(north: float, east: float, heading: Row) -> Pair:
    """R(psi) transposed: how far a vector points ahead and abeam, from the world frame."""
    return heading[0] * north + heading[1] * east, heading[0] * east - heading[1] * north


def cross(a: Row, b: Row) -> float:
    """Positive where b is clockwise of a, by less than half a turn."""
    return a[0] * b[1] - a[1] * b[0]


def hypot(x: float, y: float) -> float:
    """Length of a vector, by the C library's function, as in compiled code; Python's own rounds otherwise."""
    return float(np.hypot(x, y))


def cut(limit: float, *values: float) -> list[float]:
    """The nearest values within [-limit, limit]."""
    return [min(max(value, -limit), limit) for value in values]


# --- Motion ---


def project(a_x: float, a_y: float) -> Pair:
    """The nearest action on the unit disc, direction kept."""
    norm = math.sqrt(a_x * a_x + a_y * a_y)
    return (a_x / norm, a_y / norm) if norm > 1.0 else (a_x, a_y)


def limited(a: Row, p: Plant) -> Pair:
    """The nearest action that the actuators take: on the unit disc, or with a rudder in the box around it."""
    if p.direct > 0.0:
        return project(*a)
    a_x, a_y = cut(1.0, *a)
    return a_x, a_y


def most_thrust(direction: float, p: Plant) -> float:
    """Full thrust [N] ahead, or astern where the direction is negative."""
    return p.max_force if direction >= 0.0 else p.max_astern


def held(a: Row, angle: float, p: Plant) -> Pair:
    """The action that keeps the same horizontal force in the world after the vehicle has turned by an angle [rad].

    A rudder holds its angle, and its vehicle the thrust.
    """
    if not p.direct > 0.0:
        return a[0], a[1]
    f_x, f_y = to_body(a[0] * most_thrust(a[0], p), a[1] * p.max_torque / p.lever_arm, cos_sin(angle))
    most = most_thrust(f_x, p)
    return project(f_x / most if most > 0.0 else 0.0, f_y * p.lever_arm / p.max_torque)


def effort(a: Row, p: Plant) -> float:
    """What an action demands, 1 at most: its squared length; with a rudder the larger of the two numbers' squares."""
    if p.direct > 0.0:
        return a[0] * a[0] + a[1] * a[1]
    return max(a[0] * a[0], a[1] * a[1])


def actuators(a: Row, r: float, p: Plant) -> Pair:
    """Thrust [N] and torque [N m] (or the rudder's angle [rad]) of an action; an inner loop damps yaw. Eq. 22."""
    return most_thrust(a[0], p) * a[0], cut(p.max_torque, p.max_torque * a[1] - p.yaw_damping * r)[0]


def lagging(asked: float, given: float, half: float, whole: float) -> tuple[float, float, float]:
    """A force now, half a step and a step later: asked + (given - asked) e^(-t / lag), whose shares are given.

    Args:
        asked: thrust [N] or torque [N m] that is asked for.
        given: what reaches the water now, in the same unit.
        half: e^(-t / lag) after half a step.
        whole: e^(-t / lag) after a step; 0 without a lag.
    """
    if whole == 0.0:
        return asked, asked, asked
    return given, asked + (given - asked) * half, asked + (given - asked) * whole


def derivative(now: Row, tau: Row, flow: Row, p: Plant) -> Row:
    """Rates of (x, y, psi, u, v, r): eta' = R(psi) nu + flow, nu' = M^-1 (tau - C(nu) nu - D(nu) nu). Eq. 1-2, 4.

    D holds the lift of body and fins too, which grows with the speed ahead; the paper has none.

    Args:
        now: (x, y, psi, u, v, r), velocities relative to the water.
        tau: thrust [N] and torque [N m], or the rudder's angle [rad].
        flow: velocity of the water, north and east [m/s].
        p: the vehicle.
    """
    _, _, psi, u, v, r = now
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    ahead = max(u, 0.0)
    d_v = (p.Y_v + p.Y_vv * abs(v) - p.Y_uv * ahead) * v - (p.Y_r + p.Y_rr * abs(r) + p.Y_ur * ahead) * r
    n_v = p.N_v + p.N_rv * abs(r) + p.N_vv * abs(v) + p.N_uv * ahead
    n_r = p.N_r + p.N_rr * abs(r) - p.N_ur * ahead
    rudder = p.Y_uud * (ahead * ahead) * tau[1]
    f_u = tau[0] - -a * r - (p.X_u + p.X_uu * abs(u)) * u
    f_v = -b * r - d_v - (0.0 - rudder)
    f_r = (p.direct + p.N_uud * (ahead * ahead)) * tau[1] - (a * u - b * v) - (-n_v * v + n_r * r)
    north, east = to_world(u, v, cos_sin(psi))
    return (
        north + flow[0],
        east + flow[1],
        r,
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


def advance(now: Row, tau: Rows, flow: Row, h: float, p: Plant) -> Row:
    """The state one step of h [s] later: the classical fourth-order Runge-Kutta method. Eq. 23-24.

    Args:
        now: the state, velocities relative to the water.
        tau: thrust [N] and torque [N m] now, half a step and a step later.
        flow: velocity of the water, north and east [m/s].
        h: the step [s].
        p: the vehicle.
    """

    def after(rate: Row, seconds: float) -> Row:
        return [value + seconds * change for value, change in zip(now, rate, strict=True)]

    k_1 = derivative(now, tau[0], flow, p)
    k_2 = derivative(after(k_1, 0.5 * h), tau[1], flow, p)
    k_3 = derivative(after(k_2, 0.5 * h), tau[1], flow, p)
    k_4 = derivative(after(k_3, h), tau[2], flow, p)
    return after([a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k_1, k_2, k_3, k_4, strict=True)], h / 6.0)


def reference(t: float, waypoints: Rows, times: Row) -> tuple[float, float, float, float]:
    """Position and velocity of l(t): constant speed from waypoint to waypoint, then at rest at the last. Eq. 5."""
    for k, (start, end) in enumerate(itertools.pairwise(waypoints)):
        if t < times[k + 1]:
            v_x, v_y = ((end[axis] - start[axis]) / (times[k + 1] - times[k]) for axis in range(2))
            return start[0] + v_x * (t - times[k]), start[1] + v_y * (t - times[k]), v_x, v_y
    return waypoints[-1][0], waypoints[-1][1], 0.0, 0.0


# --- Distances and contacts ---


def middle(places: Sequence[Pair]) -> Pair:
    """The mean place, summed in order: Python's own ``sum`` rounds otherwise."""
    x, y = 0.0, 0.0
    for north, east in places:
        x, y = x + north, y + east
    return x / len(places), y / len(places)


def squared_distance(a: Row, b: Row) -> float:
    """Of two points [m2]."""
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])


def between_vehicles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float
) -> tuple[list[float], float, list[int]]:
    """Each vehicle's distance to the nearest other [m], the largest distance [m], and each one's contacts that begin.

    A contact begins where two hulls overlap and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
    """
    n, touch, largest = len(now), 2.0 * hull, -math.inf
    spacing, contacts = [math.inf] * n, [0] * n
    for i in range(n):
        for j in range(n):
            if i == j or not alive[i] or not alive[j]:
                continue
            squared = squared_distance(now[i], now[j])
            spacing[i] = min(spacing[i], math.sqrt(squared))
            largest = max(largest, math.sqrt(squared))
            if squared < touch * touch and squared_distance(before[i], before[j]) >= touch * touch:
                contacts[i] += 1
    return spacing, largest if largest >= 0.0 else math.inf, contacts


def to_obstacles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float, discs: Rows
) -> tuple[list[float], list[float], list[int]]:
    """Each vehicle's distance to the nearest surface, each obstacle's to the nearest vehicle, and contacts that begin.

    Distances are in m. A contact begins where a hull meets an obstacle and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
    """
    clearance, reached, contacts = [math.inf] * len(now), [math.inf] * len(discs), [0] * len(now)
    for i in range(len(now)):
        for k in range(len(discs)):
            if not alive[i]:
                continue
            gap = math.sqrt(squared_distance(discs[k], now[i])) - discs[k][2]
            clearance[i], reached[k] = min(clearance[i], gap), min(reached[k], gap)
            if gap < hull and math.sqrt(squared_distance(discs[k], before[i])) - discs[k][2] >= hull:
                contacts[i] += 1
    return clearance, reached, contacts


# --- Sonar ---


class Sectors(NamedTuple):
    """Sub-sectors: the directions clockwise of the lower edge, up to and including the upper one."""

    lower: Rows
    """Unit vectors, body frame."""
    upper: Rows
    range_m: Row
    active: Sequence[int]
    """Those that hear obstacles."""


def sub_sectors(arrays: Sequence[SonarArray]) -> Sectors:
    """The sub-sectors of all arrays in order, those of an array of equal width. Eq. 12."""

    def unit(degrees: float) -> Pair:
        radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
        return math.cos(radians), math.sin(radians)

    parts = [(array, k) for array in arrays for k in range(array.sub_sectors)]
    edges = [
        [unit(array.mounting_deg + array.aperture_deg * ((k + side) / array.sub_sectors - 0.5)) for side in (0, 1)]
        for array, k in parts
    ]
    return Sectors(
        lower=[lower for lower, _ in edges],
        upper=[upper for _, upper in edges],
        range_m=[array.range_m for array, _ in parts],
        active=[k for k, (array, _) in enumerate(parts) if array.kind == "active"],
    )


def hear(i: int, eta: Rows, heading: Rows, alive: Sequence[bool], sectors: Sectors, discs: Rows) -> list[int]:
    """Whom a vehicle hears in each sub-sector: the nearest, the lower index of equals, -1 for nobody. Eq. 8-9, 13-15.

    Args:
        i: index of the vehicle.
        eta: poses: north and east [m], heading [rad], a row for each vehicle.
        heading: cosine and sine of the heading, a row for each vehicle.
        alive: False for lost vehicles.
        sectors: the sonar's sub-sectors.
        discs: obstacles that silence whom they hide: centre north and east, radius [m], a row each.
    """
    nearest = [range_m * range_m for range_m in sectors.range_m]
    heard = [-1] * len(nearest)
    for j in range(len(eta)):
        if j == i or not alive[j]:
            continue
        dx, dy = eta[j][0] - eta[i][0], eta[j][1] - eta[i][1]
        squared, there = dx * dx + dy * dy, to_body(dx, dy, heading[i])
        for k in range(len(nearest)):
            inside = cross(sectors.lower[k], there) > 0.0 and cross(sectors.upper[k], there) <= 0.0
            if squared < nearest[k] and inside and not hidden(eta[i][0], eta[i][1], dx, dy, discs):
                nearest[k], heard[k] = squared, j
    return heard


def hidden(x: float, y: float, dx: float, dy: float, discs: Rows) -> bool:
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy).

    Args:
        x: start of the segment, north [m].
        y: start of the segment, east [m].
        dx: how far north of it the segment ends [m].
        dy: how far east of it the segment ends [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
    """
    length2 = dx * dx + dy * dy
    for k in range(len(discs)):
        o_x, o_y = discs[k][0] - x, discs[k][1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if hypot(o_x - share * dx, o_y - share * dy) < discs[k][2]:
            return True
    return False


def echo(centre: Pair, radius: float, lower: Row, upper: Row) -> tuple[float, Pair]:
    """Range [m] and place, body frame, of the point of a disc within a sub-sector that is nearest. Eq. 11, 16-17.

    That lies towards the centre, or on an edge where the centre is outside; at range 0 for a vehicle inside the disc.

    Args:
        centre: of the disc, ahead and to starboard [m].
        radius: of the disc [m].
        lower: lower edge of the sub-sector, a unit vector in the body frame.
        upper: upper edge, likewise.
    """
    distance = hypot(*centre)
    if distance <= radius:
        return 0.0, (0.0, 0.0)
    if cross(lower, centre) > 0.0 and cross(upper, centre) <= 0.0:
        share = 1.0 - radius / distance
        return distance - radius, (share * centre[0], share * centre[1])
    nearest, point = math.inf, (0.0, 0.0)
    for edge in (lower, upper):
        along, off = edge[0] * centre[0] + edge[1] * centre[1], cross(edge, centre)
        if along > 0.0 and abs(off) <= radius:
            reach = along - math.sqrt(radius * radius - off * off)
            if reach < nearest:
                nearest, point = reach, (reach * edge[0], reach * edge[1])
    return nearest, point
