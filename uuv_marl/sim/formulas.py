"""The paper's formulas of frames and motion in plain Python, for a vehicle at a time; ``engine="plain"`` uses them.

Symbols are those of ``uuv_marl.sim.vehicle``: eta = (x north, y east, psi clockwise from north), nu = (u surge, v sway,
r yaw rate) in the body frame, x forward, y starboard; SI units and radians. Equation numbers are the paper's.
"""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

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
    """An angle [rad] brought into [-pi, pi)."""
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


def reference(t: float, waypoints: Rows, times: Row, passes: bool) -> tuple[float, float, float, float]:
    """Position and velocity of l(t): constant speed from waypoint to waypoint, then at rest at the last, or on. Eq. 5.

    Args:
        t: time since the reset [s].
        waypoints: corners of the trajectory, north and east [m].
        times: when l(t) passes them [s].
        passes: whether it goes on along the last leg beyond the end.
    """
    for k, (start, end) in enumerate(itertools.pairwise(waypoints)):
        if t < times[k + 1] or (passes and k == len(waypoints) - 2):
            v_x, v_y = ((end[axis] - start[axis]) / (times[k + 1] - times[k]) for axis in range(2))
            return start[0] + v_x * (t - times[k]), start[1] + v_y * (t - times[k]), v_x, v_y
    return waypoints[-1][0], waypoints[-1][1], 0.0, 0.0


def passed(x: float, y: float, waypoints: Rows) -> tuple[float, float, bool]:
    """The point of the last leg, prolonged, that is nearest to a point [m], and whether it lies beyond the end."""
    (start_x, start_y), (end_x, end_y) = waypoints[-2:]
    leg_x, leg_y = end_x - start_x, end_y - start_y
    along = ((x - end_x) * leg_x + (y - end_y) * leg_y) / (leg_x * leg_x + leg_y * leg_y)
    return end_x + along * leg_x, end_y + along * leg_y, along >= 0.0
