"""Checks that a vehicle is physical: positive inertia, dissipative damping and lift, motion that can be integrated.

Every message names the field, its value and the remedy.
"""

import math
from functools import lru_cache

import numpy as np

from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.sections import Timing
from uuv_marl.types import Float64

RK4_LIMIT = 2.78  # classical Runge-Kutta is stable on the negative real axis up to this product of rate and step
TRIAL_STEPS, RUNS = 600, 128  # integration steps of a trial, a minute at the paper's step, and parallel runs
RUNAWAY = 1e8  # speed [m/s, rad/s] beyond which a trial has diverged, never reached otherwise
SAMPLED_LIMIT = 2.0  # a sampled damping loop diverges above this product of rate and control step


def check_vehicle(vehicle: Vehicle, actuators: Actuators, timing: Timing, speed_mps: float) -> None:
    """Raise ValueError for a vehicle that is not passive or that the simulation can't follow.

    ``speed_mps``: the highest initial surge speed.
    """
    inertia = inertia_matrix(vehicle)
    if np.linalg.eigvalsh(inertia)[0] <= 0:
        raise ValueError(
            f"vehicle.x_G_m = {vehicle.x_G_m:g} and vehicle.Y_rdot_kgm = {vehicle.Y_rdot_kgm:g} couple sway and yaw so "
            "strongly that the inertia matrix is not positive definite; lower them"
        )
    _check_damping(vehicle)
    _check_lift(vehicle)
    _check_step(vehicle, actuators, timing, speed_mps)
    damping, control_step_s = actuators.yaw_damping_nms, timing.control_step_s
    if not damping / inertia[2, 2] * control_step_s < SAMPLED_LIMIT:
        raise ValueError(
            f"actuators.yaw_damping_nms = {damping:g} is unstable with timing.control_step_s = {control_step_s:g}; "
            f"use less than {SAMPLED_LIMIT * inertia[2, 2] / control_step_s:.4g}"
        )


def top_speed(vehicle: Vehicle, actuators: Actuators) -> float:
    """Surge speed [m/s] of a vehicle at full force."""
    return _terminal(vehicle.X_u, vehicle.X_uu, actuators.max_force_n)


def _terminal(linear: float, quadratic: float, force: float) -> float:
    """Signed speed at which linear plus quadratic resistance equals the force."""
    return 2 * force / (linear + math.sqrt(linear**2 + 4 * quadratic * abs(force))) if force else 0.0


def inertia_matrix(p: Vehicle) -> Float64:
    """The inertia matrix M of Eq. 2, added mass included."""
    m_11, m_22, m_23, m_33 = p.inertia
    return np.array([[m_11, 0, 0], [0, m_22, m_23], [0, m_23, m_33]])


def _check_damping(p: Vehicle) -> None:
    """Damping is dissipative, its linear and non-linear part each; surge and yaw rate are bounded."""
    if (p.Y_r + p.N_v) ** 2 > 4 * p.Y_v * p.N_r:
        raise ValueError(
            f"vehicle.Y_r + vehicle.N_v = {p.Y_r + p.N_v:g} lets linear damping add energy; "
            f"keep its size within 2 sqrt(Y_v N_r) = {2 * math.sqrt(p.Y_v * p.N_r):g}"
        )
    if _least_power(p) < -1e-12 * max(p.Y_vv, p.N_rr):
        raise ValueError(
            f"vehicle.Y_rr + vehicle.N_rv = {p.Y_rr + p.N_rv:g} and vehicle.N_vv = {p.N_vv:g} let quadratic damping "
            f"add energy; lower their sizes, or raise vehicle.Y_vv = {p.Y_vv:g} or vehicle.N_rr = {p.N_rr:g}"
        )
    for linear, quadratic in (("X_u", "X_uu"), ("N_r", "N_rr")):
        if max(getattr(p, linear), getattr(p, quadratic)) == 0:
            raise ValueError(
                f"vehicle.{linear} and vehicle.{quadratic} must not both be 0: nothing would bound the speed; raise one"
            )


def _least_power(p: Vehicle) -> float:
    """Least power of quadratic sway and yaw damping, over |r|^3, for all ratios v / r; -inf without a bound."""
    coupling = p.Y_rr + p.N_rv
    if p.Y_vv == 0.0 and (coupling or p.N_vv):
        return -math.inf  # for some sign of v and large s = |v / r|
    least = p.N_rr
    for sign in (1.0, -1.0):
        power = np.polynomial.Polynomial([p.N_rr, -sign * coupling, -sign * p.N_vv, p.Y_vv])
        lowest = [s.real for s in power.deriv().roots() if s.imag == 0.0 and s.real > 0.0]
        least = min([least, *(float(power(s)) for s in lowest)])
    return least


def _check_lift(p: Vehicle) -> None:
    """Lift of body and fins is dissipative: -(Y_uv v^2 + (Y_ur + N_uv) v r + N_ur r^2) u >= 0.

    A fin's lift is, wherever the fin is. Where C(nu) omits the added masses, the coefficients may contain their part.
    """

    def takes(y_uv: float, y_ur: float, n_uv: float, n_ur: float) -> bool:
        return max(y_uv, n_ur) <= 0.0 and (y_ur + n_uv) ** 2 <= 4.0 * y_uv * n_ur * (1.0 + 1e-9)

    if takes(p.Y_uv, p.Y_ur, p.N_uv, p.N_ur):
        return
    without = p.Y_uv, p.Y_ur - p.X_udot_kg, p.N_uv + p.X_udot_kg - p.Y_vdot_kg, p.N_ur - p.Y_rdot_kgm
    if not p.munk_moment and takes(*without):
        return
    raise ValueError(
        f"vehicle.Y_uv = {p.Y_uv:g}, Y_ur = {p.Y_ur:g}, N_uv = {p.N_uv:g} and N_ur = {p.N_ur:g} are a lift that adds "
        "energy to sway and yaw; keep Y_uv and N_ur at most 0, and (Y_ur + N_uv)^2 at most 4 Y_uv N_ur. Of a source's "
        "sums with the added masses' Coriolis terms give the lift's part alone, or set vehicle.munk_moment = false"
    )


def _check_step(p: Vehicle, limits: Actuators, timing: Timing, speed_mps: float) -> None:
    """Raise ValueError for an integration step too long for the fastest motion, by its damping rate and a trial."""
    h = timing.integration_step_s
    if not can_follow(p, limits, speed_mps, h):
        shorter = [step for k in range(1, 16) if (step := timing.control_step_s / 2**k) < h]
        remedy = next(
            (f"use at most {step:.3g}, or " for step in shorter if can_follow(p, limits, speed_mps, step)), ""
        )
        steers = f"max_torque_nm = {limits.max_torque_nm:g}"
        if limits.kind == "rudder":
            steers = f"rudder_max_deg = {limits.rudder_max_deg:g}"
        raise ValueError(
            f"timing.integration_step_s = {h:g} is too long for this vehicle, so that Runge-Kutta diverges "
            f"under actuators.max_force_n = {limits.max_force_n:g} and {steers}; "
            f"{remedy}lower these limits, the vehicle's resistances or its added masses"
        )


def can_follow(p: Vehicle, limits: Actuators, speed_mps: float, step_s: float) -> bool:
    """Whether Runge-Kutta can follow the fastest motion with a step [s]. Arguments as for ``check_vehicle``."""
    if not _damping_rate(p, limits, speed_mps) * step_s < RK4_LIMIT:
        return False
    return not _diverges(p, limits, speed_mps, step_s)  # pyright: ignore[reportArgumentType] - frozen models have a hash


def _damping_rate(p: Vehicle, limits: Actuators, speed_mps: float) -> float:
    """Damping rate [1/s] at the largest speeds under full force and torque, or at the start."""
    u = max(top_speed(p, limits), speed_mps)
    r = _terminal(p.N_r, p.N_rr, _most_moment(limits, u))
    sway = [p.Y_v + 2 * p.Y_vv * u - p.Y_uv * u, -p.Y_r - 2 * p.Y_rr * r - p.Y_ur * u]
    yaw = [-p.N_v - p.N_rv * r - 2 * p.N_vv * u - p.N_uv * u, p.N_r + 2 * p.N_rr * r - p.N_ur * u]
    sway_yaw = float(np.abs(np.linalg.eigvals(np.linalg.solve(inertia_matrix(p)[1:, 1:], [sway, yaw]))).max())
    return max(sway_yaw, (p.X_u + 2 * p.X_uu * u) / (p.m_kg - p.X_udot_kg))


def _most_moment(limits: Actuators, speed_mps: float) -> float:
    """Largest steering yaw moment [N m] at a speed ahead [m/s]."""
    if limits.kind == "force_torque":
        return limits.max_torque_nm
    return limits.rudder[1] * math.radians(limits.rudder_max_deg) * speed_mps**2


@lru_cache(maxsize=1024)
def _diverges(p: Vehicle, limits: Actuators, speed_mps: float, step_s: float) -> bool:
    """Whether Runge-Kutta diverges in a trial of Eq. 2 at full action, constant and switched."""
    inverse = np.linalg.inv(inertia_matrix(p))
    motion = inverse @ resistance(p)
    thrust, steer = _pushes(limits)
    fin = np.outer(inverse[:, 1:] @ limits.rudder, np.ones(RUNS))
    push = inverse[:, :1] * thrust[:, None]
    if limits.kind == "force_torque":
        push += inverse[:, 2:] * steer[:, None]
    # Half of them start at the speeds that an action holds alone, so that short steps need no time to reach them.
    nu = np.zeros((3, RUNS))
    nu[0] = speed_mps
    held = np.array([[math.cos(k), math.sin(k)] for k in range(RUNS // 2)]).T
    nu[0, ::2] = [_terminal(p.X_u, p.X_uu, limits.max_force_n * share) for share in held[0]]
    most = _most_moment(limits, max(top_speed(p, limits), speed_mps))
    nu[2, ::2] = [_terminal(p.N_r, p.N_rr, most * share) for share in held[1]]
    factor = np.ones((7, RUNS))

    def rate(nu: Float64, k: int) -> Float64:
        factor[1:4], factor[4:] = nu, np.abs(nu)
        total = push[k] + motion @ (nu[:, None] * factor).reshape(21, RUNS)
        return total + fin * (np.maximum(nu[0], 0.0) ** 2 * steer[k]) if limits.kind == "rudder" else total

    with np.errstate(all="ignore"):
        for k in range(TRIAL_STEPS):
            a = rate(nu, k)
            b = rate(nu + step_s / 2 * a, k)
            c = rate(nu + step_s / 2 * b, k)
            d = rate(nu + step_s * c, k)
            nu += step_s / 6 * (a + 2 * (b + c) + d)
            if k % 50 == 49 and not (np.abs(nu) < RUNAWAY).all():
                return True
    return False


def resistance(p: Vehicle) -> Float64:
    """-C(nu) nu - D(nu) nu of Eq. 2: a matrix times the products of (u, v, r) with ``(1, u, v, r, |u|, |v|, |r|)``."""
    m_11, m_22, m_23 = p.inertia[:3] if p.munk_moment else (p.m_kg, p.m_kg, p.m_kg * p.x_G_m)
    force = np.zeros((3, 3, 7))
    force[0, 0, [0, 4]], force[0, 1, 3], force[0, 2, 3] = (-p.X_u, -p.X_uu), m_22, m_23
    force[1, 0, 3], force[1, 1, [0, 5]], force[1, 2, [0, 6]] = -m_11, (-p.Y_v, -p.Y_vv), (p.Y_r, p.Y_rr)
    force[2, 0, [2, 3]] = m_11 - m_22, -m_23
    force[2, 1, [0, 5, 6]], force[2, 2, [0, 6]] = (p.N_v, p.N_vv, p.N_rv), (-p.N_r, -p.N_rr)
    lift = np.array([[p.Y_uv, p.Y_ur], [p.N_uv, p.N_ur]])
    force[1:, 1:, [1, 4]] += lift[:, :, None] / 2  # max(u, 0) = (u + |u|) / 2
    return force.reshape(3, 21)


def _pushes(limits: Actuators) -> tuple[Float64, Float64]:
    """Thrust, and torque or rudder, of all trials, shape (step, run); 16 constant, others for 1 to 100 steps."""
    runs, every = np.arange(RUNS), np.resize([1, 2, 5, 20, 100], RUNS)
    every[:16] = TRIAL_STEPS
    drawn = np.random.default_rng(0).integers(0, 16, (TRIAL_STEPS, RUNS))
    drawn[0, :16] = runs[:16]
    angle = drawn[np.arange(TRIAL_STEPS)[:, None] // every, runs] * math.pi / 8
    a_x, a_y = np.cos(angle), np.sin(angle)
    most = limits.max_torque_nm
    if limits.kind == "rudder":  # a box, in place of the disc
        a_x, a_y = (share / np.maximum(np.abs(a_x), np.abs(a_y)) for share in (a_x, a_y))
        most = math.radians(limits.rudder_max_deg)
    return np.where(a_x < 0.0, limits.astern_n, limits.max_force_n) * a_x, most * a_y
