"""Dynamics of an under-actuated vehicle in three degrees of freedom: Eq. 1-4, actuators (22), Runge-Kutta (23-24).

Scalar functions in SI units and radians. eta = (x north, y east, psi clockwise from north); nu = (u surge, v sway,
r yaw rate) in the body frame, x forward, y starboard. Damping coefficients (X_u, ...) are positive.
Forces tau = (tau_u, tau_r): thrust [N] and torque [N m]; with a rudder the second is its angle [rad], positive for a
turn to starboard.
"""

import math
from typing import NamedTuple

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.trigonometry import cos_sin

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
State6 = tuple[float, float, float, float, float, float]
"""A vehicle's state (x, y, psi, u, v, r); u and v are relative to the water."""

STILL: Vector2 = (0.0, 0.0)
"""Still water, as a flow."""


class Plant(NamedTuple):
    """Parameters of Eq. 3-4 with the inverse inertia matrix, and the actuators' limits. SI units."""

    m: float
    x_G: float
    X_udot: float
    Y_vdot: float
    Y_rdot: float
    """These added masses are those in C(nu), 0 without the Munk moment; the inertia always includes them."""
    X_u: float
    Y_v: float
    Y_r: float
    N_v: float
    N_r: float
    X_uu: float
    Y_vv: float
    Y_rr: float
    N_rv: float
    N_rr: float
    N_vv: float
    Y_uv: float
    Y_ur: float
    N_uv: float
    N_ur: float
    inverse_11: float
    inverse_22: float
    inverse_23: float
    inverse_33: float
    max_force: float
    max_astern: float
    max_torque: float
    """The largest second force: torque [N m], or the rudder's angle [rad]."""
    lever_arm: float
    yaw_damping: float
    direct: float
    """1 where the second force is a torque, 0 where it is a rudder's angle."""
    Y_uud: float
    """Lift of the rudder; 0 without one."""
    N_uud: float


def plant(scenario: Scenario) -> Plant:
    """Constants of the scenario's vehicle and actuators for the compiled functions."""
    vehicle, actuators = scenario.vehicle, scenario.actuators
    m_11, m_22, m_23, m_33 = vehicle.inertia
    determinant = m_22 * m_33 - m_23 * m_23
    turns = 1.0 if vehicle.munk_moment else 0.0
    has_rudder = actuators.kind == "rudder"
    y_uud, n_uud = actuators.rudder
    return Plant(
        m=vehicle.m_kg, x_G=vehicle.x_G_m,
        X_udot=turns * vehicle.X_udot_kg, Y_vdot=turns * vehicle.Y_vdot_kg, Y_rdot=turns * vehicle.Y_rdot_kgm,
        X_u=vehicle.X_u, Y_v=vehicle.Y_v, Y_r=vehicle.Y_r, N_v=vehicle.N_v, N_r=vehicle.N_r,
        X_uu=vehicle.X_uu, Y_vv=vehicle.Y_vv, Y_rr=vehicle.Y_rr,
        N_rv=vehicle.N_rv, N_rr=vehicle.N_rr, N_vv=vehicle.N_vv,
        Y_uv=vehicle.Y_uv, Y_ur=vehicle.Y_ur, N_uv=vehicle.N_uv, N_ur=vehicle.N_ur,
        inverse_11=1.0 / m_11, inverse_22=m_33 / determinant,
        inverse_23=-m_23 / determinant, inverse_33=m_22 / determinant,
        max_force=actuators.max_force_n, max_astern=actuators.astern_n,
        max_torque=math.radians(actuators.rudder_max_deg) if has_rudder else actuators.max_torque_nm,
        lever_arm=actuators.lever_arm_m, yaw_damping=actuators.yaw_damping_nms,
        direct=0.0 if has_rudder else 1.0, Y_uud=y_uud, N_uud=n_uud,
    )  # fmt: skip


@compiled_inline
def coriolis(nu: Vector3, p: Plant) -> Vector3:
    """C(nu) nu = (C_RB + C_A) nu [N, N, N m]. Eq. 4. Does no work: nu . C nu = 0."""
    u, v, r = nu
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    return -a * r, b * r, a * u - b * v


@compiled_inline
def damping(nu: Vector3, p: Plant) -> Vector3:
    """Damping D(nu) nu = (D_l + D_nl) nu [N, N, N m] less the lift of body and fins. Eq. 4.

    The lift, 0 in the paper, is bilinear in surge and sway or yaw as in Prestero (Verification of a six-degree of
    freedom simulation model for the REMUS autonomous underwater vehicle, MIT, 2001).
    """
    u, v, r = nu
    flow = max(u, 0.0)
    return (
        (p.X_u + p.X_uu * abs(u)) * u,
        (p.Y_v + p.Y_vv * abs(v) - p.Y_uv * flow) * v - (p.Y_r + p.Y_rr * abs(r) + p.Y_ur * flow) * r,
        -(p.N_v + p.N_rv * abs(r) + p.N_vv * abs(v) + p.N_uv * flow) * v
        + (p.N_r + p.N_rr * abs(r) - p.N_ur * flow) * r,
    )


@compiled_inline
def steering(u: float, steer: float, p: Plant) -> Vector2:
    """Sway force [N] and yaw moment [N m] of ``steer``: a torque [N m], or a rudder's angle [rad] at surge u [m/s]."""
    pressure = max(u, 0.0) * max(u, 0.0)
    return p.Y_uud * pressure * steer, (p.direct + p.N_uud * pressure) * steer


@compiled_inline
def acceleration(nu: Vector3, tau: Vector2, p: Plant) -> Vector3:
    """Nu' = M^-1 (tau - C(nu) nu - D(nu) nu) [m/s2, m/s2, rad/s2]. Eq. 2."""
    c_u, c_v, c_r = coriolis(nu, p)
    d_u, d_v, d_r = damping(nu, p)
    side, moment = steering(nu[0], tau[1], p)
    # 0.0 - side is +0 without a rudder; subtracting it leaves all bits unchanged, the sign of a zero included.
    f_u, f_v, f_r = tau[0] - c_u - d_u, -c_v - d_v - (0.0 - side), moment - c_r - d_r
    return (
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


@compiled_inline
def derivative(state: State6, tau: Vector2, flow: Vector2, p: Plant) -> State6:
    """Time derivative of the state (eta, nu). Eq. 1-2; R(psi) rotates from the body frame to north and east.

    Args:
        state: pose and velocity relative to the water.
        tau: thrust [N] and torque [N m], or the rudder's angle [rad].
        flow: velocity of the water, north and east [m/s], added to the vehicle's. The equations of motion relative to
            the water are exact in uniform, steady flow (Fossen, Handbook of Marine Craft Hydrodynamics and Motion
            Control, 2021, chapter 10), else of first order.
        p: parameters of the vehicle.
    """
    _, _, psi, u, v, r = state
    c, s = cos_sin(psi)
    du, dv, dr = acceleration((u, v, r), tau, p)
    return c * u - s * v + flow[0], s * u + c * v + flow[1], r, du, dv, dr


@compiled_inline
def ahead(state: State6, h: float, rate: State6) -> State6:
    """The state after h [s] at a constant rate."""
    x, y, psi, u, v, r = state
    return (
        x + h * rate[0], y + h * rate[1], psi + h * rate[2], u + h * rate[3], v + h * rate[4], r + h * rate[5]
    )  # fmt: skip


@compiled_inline
def advance_lagging(
    state: State6, tau: Vector2, tau_half: Vector2, tau_end: Vector2, flow: Vector2, h: float, p: Plant
) -> State6:
    """The state after a step of h [s] by the classical fourth-order Runge-Kutta method. Eq. 23-24.

    ``tau``, ``tau_half`` and ``tau_end`` act at the start, in the middle and at the end; ``flow`` is constant.
    """
    a = derivative(state, tau, flow, p)
    b = derivative(ahead(state, 0.5 * h, a), tau_half, flow, p)
    c = derivative(ahead(state, 0.5 * h, b), tau_half, flow, p)
    d = derivative(ahead(state, h, c), tau_end, flow, p)
    x, y, psi, u, v, r = state
    w = h / 6.0
    return (
        x + w * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]),
        y + w * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]),
        psi + w * (a[2] + 2.0 * b[2] + 2.0 * c[2] + d[2]),
        u + w * (a[3] + 2.0 * b[3] + 2.0 * c[3] + d[3]),
        v + w * (a[4] + 2.0 * b[4] + 2.0 * c[4] + d[4]),
        r + w * (a[5] + 2.0 * b[5] + 2.0 * c[5] + d[5]),
    )


@compiled_inline
def advance(state: State6, tau: Vector2, flow: Vector2, h: float, p: Plant) -> State6:
    """``advance_lagging`` under constant forces."""
    return advance_lagging(state, tau, tau, tau, flow, h, p)


@compiled_inline
def wrap(angle: float) -> float:
    """An angle [rad] modulo 2 pi, in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@compiled_inline
def project(a_x: float, a_y: float) -> tuple[float, float]:
    """Projection of an action onto the unit disc."""
    norm = math.sqrt(a_x * a_x + a_y * a_y)
    if norm > 1.0:
        return a_x / norm, a_y / norm
    return a_x, a_y


@compiled_inline
def limited(a_x: float, a_y: float, p: Plant) -> tuple[float, float]:
    """Projection of an action onto the actuators' range: the unit disc, or with a rudder the box around it."""
    if p.direct > 0.0:
        return project(a_x, a_y)
    return min(max(a_x, -1.0), 1.0), min(max(a_y, -1.0), 1.0)


@compiled_inline
def most_thrust(direction: float, p: Plant) -> float:
    """Largest thrust [N], ahead or for a negative direction astern."""
    return p.max_force if direction >= 0.0 else p.max_astern


@compiled_inline
def held(a_x: float, a_y: float, angle: float, p: Plant) -> tuple[float, float]:
    """An action at a later control step: its force keeps its direction in the world; with a rudder it is unchanged.

    ``angle``: turn of the vehicle since the decision, clockwise [rad].
    """
    if p.direct > 0.0:
        b_x, b_y = turned(a_x, a_y, angle, p)
        return project(b_x, b_y)
    return a_x, a_y


@compiled_inline
def effort(a_x: float, a_y: float, p: Plant) -> float:
    """Effort of an action, at most 1: its squared length; with a rudder the larger of the two squares."""
    if p.direct > 0.0:
        return a_x * a_x + a_y * a_y
    return max(a_x * a_x, a_y * a_y)


@compiled_inline
def turned(a_x: float, a_y: float, angle: float, p: Plant) -> tuple[float, float]:
    """The action that keeps the horizontal force in the world after the vehicle has turned by ``angle`` [rad]."""
    f_x, f_y = a_x * most_thrust(a_x, p), a_y * p.max_torque / p.lever_arm
    c, s = cos_sin(angle)
    thrust = c * f_x + s * f_y
    most = most_thrust(thrust, p)
    return thrust / most if most > 0.0 else 0.0, (c * f_y - s * f_x) * p.lever_arm / p.max_torque


@compiled_inline
def actuators(a_x: float, a_y: float, r: float, p: Plant) -> tuple[float, float]:
    """Forces tau of a ``limited`` action (a_x, a_y), with the yaw-damping loop on the yaw rate r [rad/s]. Eq. 22."""
    torque = p.max_torque * a_y - p.yaw_damping * r
    return most_thrust(a_x, p) * a_x, min(max(torque, -p.max_torque), p.max_torque)
