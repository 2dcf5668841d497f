"""One under-actuated vehicle in three degrees of freedom: Eq. 1-4, actuators (Eq. 22) and Runge-Kutta (Eq. 23-24).

Scalar functions of one vehicle, in SI units and radians. eta = (x north, y east, psi clockwise from north);
nu = (u surge, v sway, r yaw rate) in the body frame, x forward, y starboard. Resistances (X_u, ...) are positive.
"""

import math
from typing import NamedTuple

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.trigonometry import cos_sin

Vector3 = tuple[float, float, float]
State6 = tuple[float, float, float, float, float, float]


class Plant(NamedTuple):
    """Parameters of Eq. 3-4 with the inertia matrix inverted, and the actuators' limits. SI units."""

    m: float
    x_G: float
    X_udot: float
    Y_vdot: float
    Y_rdot: float
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
    inverse_11: float
    inverse_22: float
    inverse_23: float
    inverse_33: float
    max_force: float
    max_torque: float
    lever_arm: float
    yaw_damping: float


def plant(scenario: Scenario) -> Plant:
    """The scenario's vehicle and actuators as numbers for the compiled functions."""
    vehicle, actuators = scenario.vehicle, scenario.actuators
    m_22 = vehicle.m_kg - vehicle.Y_vdot_kg
    m_23 = vehicle.m_kg * vehicle.x_G_m - vehicle.Y_rdot_kgm
    m_33 = vehicle.I_z_kgm2 - vehicle.N_rdot_kgm2
    determinant = m_22 * m_33 - m_23 * m_23
    return Plant(
        m=vehicle.m_kg,
        x_G=vehicle.x_G_m,
        X_udot=vehicle.X_udot_kg,
        Y_vdot=vehicle.Y_vdot_kg,
        Y_rdot=vehicle.Y_rdot_kgm,
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
        inverse_11=1.0 / (vehicle.m_kg - vehicle.X_udot_kg),
        inverse_22=m_33 / determinant,
        inverse_23=-m_23 / determinant,
        inverse_33=m_22 / determinant,
        max_force=actuators.max_force_n,
        max_torque=actuators.max_torque_nm,
        lever_arm=actuators.lever_arm_m,
        yaw_damping=actuators.yaw_damping_nms,
    )


@compiled_inline
def coriolis(u: float, v: float, r: float, p: Plant) -> Vector3:
    """C(nu) nu = (C_RB + C_A) nu [N, N, N m]. Eq. 4. Does no work: nu . C nu = 0."""
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    return -a * r, b * r, a * u - b * v


@compiled_inline
def damping(u: float, v: float, r: float, p: Plant) -> Vector3:
    """D(nu) nu = (D_l + D_nl) nu [N, N, N m]. Eq. 4."""
    return (
        (p.X_u + p.X_uu * abs(u)) * u,
        (p.Y_v + p.Y_vv * abs(v)) * v - (p.Y_r + p.Y_rr * abs(r)) * r,
        -(p.N_v + p.N_rv * abs(r)) * v + (p.N_r + p.N_rr * abs(r)) * r,
    )


@compiled_inline
def acceleration(u: float, v: float, r: float, tau_u: float, tau_r: float, p: Plant) -> Vector3:
    """Nu' = M^-1 (tau - C(nu) nu - D(nu) nu) [m/s2, m/s2, rad/s2]. Eq. 2."""
    c_u, c_v, c_r = coriolis(u, v, r, p)
    d_u, d_v, d_r = damping(u, v, r, p)
    f_u, f_v, f_r = tau_u - c_u - d_u, -c_v - d_v, tau_r - c_r - d_r
    return (
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


@compiled_inline
def derivative(psi: float, u: float, v: float, r: float, tau_u: float, tau_r: float, p: Plant) -> State6:
    """Rate of the joint state (eta, nu). Eq. 1-2; R(psi) takes body to north-east."""
    c, s = cos_sin(psi)
    du, dv, dr = acceleration(u, v, r, tau_u, tau_r, p)
    return c * u - s * v, s * u + c * v, r, du, dv, dr


@compiled_inline
def advance(
    x: float, y: float, psi: float, u: float, v: float, r: float, tau_u: float, tau_r: float, h: float, p: Plant
) -> State6:
    """The joint state one step of h [s] later, tau held: the classical fourth-order Runge-Kutta method (Eq. 23-24)."""
    a0, a1, a2, a3, a4, a5 = derivative(psi, u, v, r, tau_u, tau_r, p)
    g = 0.5 * h
    b0, b1, b2, b3, b4, b5 = derivative(psi + g * a2, u + g * a3, v + g * a4, r + g * a5, tau_u, tau_r, p)
    c0, c1, c2, c3, c4, c5 = derivative(psi + g * b2, u + g * b3, v + g * b4, r + g * b5, tau_u, tau_r, p)
    d0, d1, d2, d3, d4, d5 = derivative(psi + h * c2, u + h * c3, v + h * c4, r + h * c5, tau_u, tau_r, p)
    w = h / 6.0
    return (
        x + w * (a0 + 2.0 * b0 + 2.0 * c0 + d0),
        y + w * (a1 + 2.0 * b1 + 2.0 * c1 + d1),
        psi + w * (a2 + 2.0 * b2 + 2.0 * c2 + d2),
        u + w * (a3 + 2.0 * b3 + 2.0 * c3 + d3),
        v + w * (a4 + 2.0 * b4 + 2.0 * c4 + d4),
        r + w * (a5 + 2.0 * b5 + 2.0 * c5 + d5),
    )


@compiled_inline
def wrap(angle: float) -> float:
    """The same angle [rad] in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@compiled_inline
def project(a_x: float, a_y: float) -> tuple[float, float]:
    """The nearest action on the unit disc, direction kept."""
    norm = math.sqrt(a_x * a_x + a_y * a_y)
    if norm > 1.0:
        return a_x / norm, a_y / norm
    return a_x, a_y


@compiled_inline
def turned(a_x: float, a_y: float, angle: float, p: Plant) -> tuple[float, float]:
    """The action that keeps the same horizontal force in the world after the vehicle has turned by an angle [rad]."""
    f_x, f_y = a_x * p.max_force, a_y * p.max_torque / p.lever_arm
    c, s = cos_sin(angle)
    return (c * f_x + s * f_y) / p.max_force, (c * f_y - s * f_x) * p.lever_arm / p.max_torque


@compiled_inline
def actuators(a_x: float, a_y: float, r: float, p: Plant) -> tuple[float, float]:
    """Thrust [N] and torque [N m] of a body-frame action on the unit disc, with the inner yaw-damping loop. Eq. 22."""
    torque = p.max_torque * a_y - p.yaw_damping * r
    return p.max_force * a_x, min(max(torque, -p.max_torque), p.max_torque)
