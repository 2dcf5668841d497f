"""One under-actuated vehicle in three degrees of freedom: Eq. 1-4, actuators (Eq. 22) and Runge-Kutta (Eq. 23-24).

Scalar functions of one vehicle, in SI units and radians. eta = (x north, y east, psi clockwise from north);
nu = (u surge, v sway, r yaw rate) in the body frame, x forward, y starboard. Resistances (X_u, ...) are positive.
Forces tau = (tau_u, tau_r): thrust [N], and torque [N m]; with a rudder the second is its angle [rad], which turns
the vehicle to starboard where positive.
"""

import math
from typing import NamedTuple

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.trigonometry import cos_sin

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
State6 = tuple[float, float, float, float, float, float]
"""A vehicle's joint state (x, y, psi, u, v, r); u and v are relative to the water."""

STILL: Vector2 = (0.0, 0.0)
"""Still water, as a flow."""


class Plant(NamedTuple):
    """Parameters of Eq. 3-4 with the inertia matrix inverted, and the actuators' limits. SI units."""

    m: float
    x_G: float
    X_udot: float
    Y_vdot: float
    Y_rdot: float
    """Added masses are here those that count in C(nu), 0 without the Munk moment; the inertia has them always."""
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
    """The scenario's vehicle and actuators as numbers for the compiled functions."""
    vehicle, actuators = scenario.vehicle, scenario.actuators
    m_11, m_22, m_23, m_33 = vehicle.inertia
    determinant = m_22 * m_33 - m_23 * m_23
    turns = 1.0 if vehicle.munk_moment else 0.0
    has_rudder = actuators.kind == "rudder"
    y_uud, n_uud = actuators.rudder
    return Plant(
        m=vehicle.m_kg,
        x_G=vehicle.x_G_m,
        X_udot=turns * vehicle.X_udot_kg,
        Y_vdot=turns * vehicle.Y_vdot_kg,
        Y_rdot=turns * vehicle.Y_rdot_kgm,
        X_u=vehicle.X_u,
        Y_v=vehicle.Y_v,
        Y_r=vehicle.Y_r,
        N_v=vehicle.N_v,
        N_r=vehicle.N_r,
        X_uu=vehicle.X_uu,
        Y_vv=vehicle.Y_vv,
        Y_rr=vehicle.Y_rr,
        N_rv=vehicle.N_rv,
        N_rr=vehicle.N_rr,
        N_vv=vehicle.N_vv,
        Y_uv=vehicle.Y_uv,
        Y_ur=vehicle.Y_ur,
        N_uv=vehicle.N_uv,
        N_ur=vehicle.N_ur,
        inverse_11=1.0 / m_11,
        inverse_22=m_33 / determinant,
        inverse_23=-m_23 / determinant,
        inverse_33=m_22 / determinant,
        max_force=actuators.max_force_n,
        max_astern=actuators.astern_n,
        max_torque=math.radians(actuators.rudder_max_deg) if has_rudder else actuators.max_torque_nm,
        lever_arm=actuators.lever_arm_m,
        yaw_damping=actuators.yaw_damping_nms,
        direct=0.0 if has_rudder else 1.0,
        Y_uud=y_uud,
        N_uud=n_uud,
    )


@compiled_inline
def coriolis(nu: Vector3, p: Plant) -> Vector3:
    """C(nu) nu = (C_RB + C_A) nu [N, N, N m]. Eq. 4. Does no work: nu . C nu = 0."""
    u, v, r = nu
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    return -a * r, b * r, a * u - b * v


@compiled_inline
def damping(nu: Vector3, p: Plant) -> Vector3:
    """Drag, D(nu) nu = (D_l + D_nl) nu [N, N, N m], less the lift of body and fins. Eq. 4.

    The paper has no lift. Its form, bilinear in the speed ahead and in sway or yaw, is that of Prestero (Verification
    of a six-degree of freedom simulation model for the REMUS autonomous underwater vehicle, MIT, 2001).
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
    """Sway force [N] and yaw moment [N m] of a torque [N m], or of a rudder's angle [rad] in the flow from ahead.

    ``steer``: the torque or the angle, positive to starboard.
    """
    pressure = max(u, 0.0) * max(u, 0.0)
    return p.Y_uud * pressure * steer, (p.direct + p.N_uud * pressure) * steer


@compiled_inline
def acceleration(nu: Vector3, tau: Vector2, p: Plant) -> Vector3:
    """Nu' = M^-1 (tau - C(nu) nu - D(nu) nu) [m/s2, m/s2, rad/s2], tau as the module has it. Eq. 2."""
    c_u, c_v, c_r = coriolis(nu, p)
    d_u, d_v, d_r = damping(nu, p)
    side, moment = steering(nu[0], tau[1], p)
    # 0 less it: without a rudder that is +0, which taken away leaves every bit as it is, the sign of a zero included.
    f_u, f_v, f_r = tau[0] - c_u - d_u, -c_v - d_v - (0.0 - side), moment - c_r - d_r
    return (
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


@compiled_inline
def derivative(state: State6, tau: Vector2, flow: Vector2, p: Plant) -> State6:
    """Rate of the joint state (eta, nu). Eq. 1-2; R(psi) takes body to north-east.

    Args:
        state: pose and velocity relative to the water.
        tau: thrust [N] and torque [N m], or the rudder's angle [rad].
        flow: velocity of the water, north and east [m/s]. It carries the vehicle along. The equations of motion hold
            relative to the water: exactly where it is uniform and steady (Fossen, Handbook of Marine Craft
            Hydrodynamics and Motion Control, 2021, chapter 10), else to first order.
        p: the vehicle.
    """
    _, _, psi, u, v, r = state
    c, s = cos_sin(psi)
    du, dv, dr = acceleration((u, v, r), tau, p)
    return c * u - s * v + flow[0], s * u + c * v + flow[1], r, du, dv, dr


@compiled_inline
def ahead(state: State6, h: float, rate: State6) -> State6:
    """The joint state h [s] later at a constant rate."""
    x, y, psi, u, v, r = state
    return (
        x + h * rate[0], y + h * rate[1], psi + h * rate[2], u + h * rate[3], v + h * rate[4], r + h * rate[5]
    )  # fmt: skip


@compiled_inline
def advance_lagging(
    state: State6, tau: Vector2, tau_half: Vector2, tau_end: Vector2, flow: Vector2, h: float, p: Plant
) -> State6:
    """The joint state h [s] later: the classical fourth-order Runge-Kutta method (Eq. 23-24).

    ``tau``, ``tau_half`` and ``tau_end`` act at its start, in the middle, and h later; ``flow`` is held.
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
    """The joint state one step later, forces and water held: the classical fourth-order Runge-Kutta method (Eq. 23-24).

    ``tau``: thrust [N] and torque [N m], or the rudder's angle [rad].
    """
    return advance_lagging(state, tau, tau, tau, flow, h, p)


@compiled_inline
def wrap(angle: float) -> float:
    """An angle [rad] brought into [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@compiled_inline
def project(a_x: float, a_y: float) -> tuple[float, float]:
    """The nearest action on the unit disc, direction kept."""
    norm = math.sqrt(a_x * a_x + a_y * a_y)
    if norm > 1.0:
        return a_x / norm, a_y / norm
    return a_x, a_y


@compiled_inline
def limited(a_x: float, a_y: float, p: Plant) -> tuple[float, float]:
    """The nearest action that the actuators take: on the unit disc, or with a rudder in the box around it."""
    if p.direct > 0.0:
        return project(a_x, a_y)
    return min(max(a_x, -1.0), 1.0), min(max(a_y, -1.0), 1.0)


@compiled_inline
def most_thrust(direction: float, p: Plant) -> float:
    """Full thrust [N] ahead, or astern where the direction is negative."""
    return p.max_force if direction >= 0.0 else p.max_astern


@compiled_inline
def held(a_x: float, a_y: float, angle: float, p: Plant) -> tuple[float, float]:
    """An action some control holds later: its force keeps its direction in the world; thrust and a rudder stay.

    ``angle``: by which the vehicle has turned, clockwise [rad].
    """
    if p.direct > 0.0:
        b_x, b_y = turned(a_x, a_y, angle, p)
        return project(b_x, b_y)
    return a_x, a_y


@compiled_inline
def effort(a_x: float, a_y: float, p: Plant) -> float:
    """What an action demands, 1 at most: its squared length; with a rudder the larger of the two numbers' squares."""
    if p.direct > 0.0:
        return a_x * a_x + a_y * a_y
    return max(a_x * a_x, a_y * a_y)


@compiled_inline
def turned(a_x: float, a_y: float, angle: float, p: Plant) -> tuple[float, float]:
    """The action that keeps the same horizontal force in the world after the vehicle has turned.

    ``angle``: by which it has turned, clockwise [rad].
    """
    f_x, f_y = a_x * most_thrust(a_x, p), a_y * p.max_torque / p.lever_arm
    c, s = cos_sin(angle)
    thrust = c * f_x + s * f_y
    most = most_thrust(thrust, p)
    return thrust / most if most > 0.0 else 0.0, (c * f_y - s * f_x) * p.lever_arm / p.max_torque


@compiled_inline
def actuators(a_x: float, a_y: float, r: float, p: Plant) -> tuple[float, float]:
    """Forces of a body-frame action, as the module has them, with the inner yaw-damping loop. Eq. 22.

    Args:
        a_x: share of full thrust; the action is ``limited``.
        a_y: share of full torque, or of the rudder's limit.
        r: yaw rate [rad/s].
        p: the vehicle.
    """
    torque = p.max_torque * a_y - p.yaw_damping * r
    return most_thrust(a_x, p) * a_x, min(max(torque, -p.max_torque), p.max_torque)
