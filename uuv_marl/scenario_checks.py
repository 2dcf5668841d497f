"""What one field of a scenario demands of another, and what the physics demands of both.

Every message names the field, its value and the remedy.
"""

import logging
import math
from functools import cache, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from uuv_marl.scenario import Actuators, Scenario, SonarArray, Vehicle

Float64 = NDArray[np.float64]
MIN_SECTOR_DEG, MAX_SECTOR_DEG = 0.01, 120.0
"""Widths of sub-sectors that the sonar's table of directions is made for."""
MAX_STEPS = 10_000
"""Most integration steps in a decision; compiled code can't be interrupted."""
RK4_LIMIT = 2.78
"""Classical Runge-Kutta is stable on the negative real axis up to this product of rate and step."""
TRIAL_STEPS, RUNS = 600, 128
"""A vehicle is tried for so many integration steps, a minute at the paper's step."""
RUNAWAY = 1e8
"""A speed [m/s, rad/s] beyond which a trial has diverged; none comes near it that does not."""
SAMPLED_LIMIT = 2.0
"""A sampled damping loop overshoots without end above this product of rate and hold."""


def check_sub_sectors(array: "SonarArray") -> None:
    """An array's sub-sectors are neither too wide nor too narrow."""
    width = array.aperture_deg / array.sub_sectors
    if width > MAX_SECTOR_DEG:
        raise ValueError(
            f"sonar.arrays.{array.name}.sub_sectors must leave sub-sectors of at most {MAX_SECTOR_DEG:g} deg, "
            f"got {width:g} deg; use at least {math.ceil(array.aperture_deg / MAX_SECTOR_DEG)}"
        )
    if width < MIN_SECTOR_DEG:
        raise ValueError(
            f"sonar.arrays.{array.name}.sub_sectors must leave sub-sectors of at least {MIN_SECTOR_DEG:g} deg, "
            f"got {width:g} deg; lower it or raise aperture_deg"
        )


def check_start(scenario: "Scenario") -> None:
    """The vehicles fit into the start area at their spacing."""
    start, n = scenario.start, scenario.swarm.num_vehicles
    if start.speed_min_mps > start.speed_max_mps:
        raise ValueError(
            f"start.speed_min_mps must not exceed start.speed_max_mps = {start.speed_max_mps:g}, "
            f"got {start.speed_min_mps:g}"
        )
    if start.spacing_m < 2 * scenario.contact.hull_radius_m:
        raise ValueError(
            f"start.spacing_m must be at least two hull radii = {2 * scenario.contact.hull_radius_m:g}, "
            f"got {start.spacing_m:g}; raise it or lower contact.hull_radius_m"
        )
    if start.gap_m < start.spacing_m and n > 1:
        raise ValueError(
            f"start.gap_m must be at least start.spacing_m = {start.spacing_m:g}, so that the two groups keep it from "
            f"each other, got {start.gap_m:g}"
        )
    columns, rows, _ = start.lattice(n)
    needed = math.ceil(n / 2)
    if columns * rows < needed:
        raise ValueError(
            f"start.spacing_m = {start.spacing_m:g} leaves room for {columns * rows} vehicles in each start rectangle, "
            f"but {needed} are needed; lower it, or raise start.length_m or start.width_m"
        )


def check_course(scenario: "Scenario") -> None:
    """One trajectory, and no obstacle on its start or end."""
    points = scenario.trajectory.waypoints_m
    if (points is None) == (scenario.random_field is None):
        raise ValueError(
            "trajectory.waypoints_m is needed, unless random_field draws the trajectory; "
            f"got {'neither' if points is None else 'both'}"
        )
    if points is None:
        if scenario.obstacles:
            raise ValueError("obstacles must be empty where random_field draws them")
        return
    for k, (a, b) in enumerate(pairwise(points)):
        if math.dist(a, b) < 1e-6:
            raise ValueError(f"trajectory.waypoints_m must differ from one to the next, got {list(a)} twice at {k}")
    for k, obstacle in enumerate(scenario.obstacles):
        where = f"obstacles.{k} at {list(obstacle.centre_m)} m, radius {obstacle.radius_m:g} m,"
        clear = scenario.constraints.s_o_m
        if start_distance(scenario, points[0], points[1], obstacle.centre_m) < obstacle.radius_m + clear:
            raise ValueError(f"{where} lies on the start; keep {clear:g} m from the two start rectangles")
        if math.dist(obstacle.centre_m, points[-1]) < obstacle.radius_m + clear:
            raise ValueError(f"{where} lies on the trajectory's end; keep {clear:g} m from it")


def start_distance(
    scenario: "Scenario", first: tuple[float, float], second: tuple[float, float], point: tuple[float, float]
) -> float:
    """Distance [m] of a point from the rectangle that holds both start rectangles; 0 inside."""
    length, width = scenario.start.sides(scenario.swarm.num_vehicles)
    leg = math.dist(first, second)
    ahead = ((second[0] - first[0]) / leg, (second[1] - first[1]) / leg)
    offset = (point[0] - first[0], point[1] - first[1])
    along = offset[0] * ahead[0] + offset[1] * ahead[1]
    across = abs(-offset[0] * ahead[1] + offset[1] * ahead[0])
    return math.hypot(max(along, -length - along, 0.0), max(across - width - scenario.start.gap_m / 2, 0.0))


def check_losses(scenario: "Scenario") -> None:
    """Losses in order, and somebody left."""
    times, n = scenario.disturbance.loss_times_s, scenario.swarm.num_vehicles
    if list(times) != sorted(times):
        raise ValueError(f"disturbance.loss_times_s must not fall, got {list(times)}; sort them")
    if len(times) >= n:
        raise ValueError(
            f"disturbance.loss_times_s loses {len(times)} of {n} vehicles; "
            "at least one must remain: shorten it or raise swarm.num_vehicles"
        )


def check_times(scenario: "Scenario") -> None:
    """Decisions that an episode has room for, and that are soon computed."""
    timing, limit, field = scenario.timing, scenario.time_limit, scenario.random_field
    duration = scenario.trajectory.duration_s
    if field is not None:
        duration = field.legs[0] * field.leg_length_m[0] / scenario.trajectory.speed_mps
    shortest = limit.factor * duration + limit.extra_s
    period, steps = timing.decision_period_s, timing.holds_per_decision * timing.steps_per_hold
    if period > shortest:
        raise ValueError(
            f"timing.decision_period_s must be at most the shortest time limit = {shortest:g}, got {period:g}; "
            "lower it, or raise time_limit.factor or time_limit.extra_s"
        )
    if steps > MAX_STEPS:
        raise ValueError(
            f"timing.decision_period_s = {period:g} takes {steps:,} steps of timing.integration_step_s = "
            f"{timing.integration_step_s:g}; at most {MAX_STEPS:,} are possible: lower it or raise the step"
        )


@cache
def warn_of_speed(speed_mps: float) -> None:
    """Say once that no vehicle can follow l(t)."""
    text = (
        "trajectory.speed_mps = %g is more than a vehicle holds at full force (actuators.max_force_n): none can follow"
    )
    logging.getLogger("uuv_marl").warning(text, speed_mps)


def check_vehicle(scenario: "Scenario") -> None:
    """Inertia positive, damping dissipative, and no motion too fast for its time step."""
    p, limits, timing = scenario.vehicle, scenario.actuators, scenario.timing
    inertia = _inertia(p)
    if np.linalg.eigvalsh(inertia)[0] <= 0:
        raise ValueError(
            f"vehicle.x_G_m = {p.x_G_m:g} and vehicle.Y_rdot_kgm = {p.Y_rdot_kgm:g} couple sway and yaw so strongly "
            "that the inertia matrix is not positive definite; lower them"
        )
    _check_dissipation(scenario)
    for linear, quadratic in (("X_u", "X_uu"), ("N_r", "N_rr")):
        if max(getattr(p, linear), getattr(p, quadratic)) == 0:
            raise ValueError(
                f"vehicle.{linear} and vehicle.{quadratic} must not both be 0: nothing would bound the speed; raise one"
            )
    if scenario.trajectory.speed_mps > _terminal(p.X_u, p.X_uu, limits.max_force_n):
        warn_of_speed(scenario.trajectory.speed_mps)
    top, rate = scenario.start.speed_max_mps, _damping_rate(p, limits, scenario.start.speed_max_mps)

    def fails(step_s: float) -> bool:
        return not rate * step_s < RK4_LIMIT or diverges(p, limits, top, step_s)  # pyright: ignore[reportArgumentType] - frozen models have a hash

    h = timing.integration_step_s
    if fails(h):
        shorter = (timing.control_hold_s / 2**k for k in range(1, 16))
        remedy = next((f"use at most {step:.3g}, or " for step in shorter if step < h and not fails(step)), "")
        raise ValueError(
            f"timing.integration_step_s = {h:g} is too long for this vehicle, so that Runge-Kutta diverges "
            f"under actuators.max_force_n = {limits.max_force_n:g} and max_torque_nm = {limits.max_torque_nm:g}; "
            f"{remedy}lower these limits, the vehicle's resistances or its added masses"
        )
    yaw = limits.yaw_damping_nms / inertia[2, 2]
    if not yaw * timing.control_hold_s < SAMPLED_LIMIT:
        raise ValueError(
            f"actuators.yaw_damping_nms = {limits.yaw_damping_nms:g} is unstable when held for "
            f"timing.control_hold_s = {timing.control_hold_s:g}; use less than "
            f"{SAMPLED_LIMIT * inertia[2, 2] / timing.control_hold_s:.4g}"
        )


def _damping_rate(p: "Vehicle", limits: "Actuators", speed_mps: float) -> float:
    """How fast [1/s] damping acts at the largest speeds that full force and torque can hold, or at the start."""
    u = max(_terminal(p.X_u, p.X_uu, limits.max_force_n), speed_mps)
    r = _terminal(p.N_r, p.N_rr, limits.max_torque_nm)
    sway, yaw = [p.Y_v + 2 * p.Y_vv * u, -p.Y_r - 2 * p.Y_rr * r], [-p.N_v - p.N_rv * r, p.N_r + 2 * p.N_rr * r]
    sway_yaw = float(np.abs(np.linalg.eigvals(np.linalg.solve(_inertia(p)[1:, 1:], [sway, yaw]))).max())
    return max(sway_yaw, (p.X_u + 2 * p.X_uu * u) / (p.m_kg - p.X_udot_kg))


@lru_cache(maxsize=1024)
def diverges(p: "Vehicle", limits: "Actuators", speed_mps: float, step_s: float) -> bool:
    """Whether Runge-Kutta at this step runs away somewhere: a trial of Eq. 2 at full action, held and switched.

    C(nu) nu + D(nu) nu is a matrix times the products of (u, v, r) with (1, u, v, r, |u|, |v|, |r|).
    """
    inertia = _inertia(p)
    m_11, m_22, m_23 = inertia[0, 0], inertia[1, 1], inertia[1, 2]
    force = np.zeros((3, 3, 7))
    force[0, 0, [0, 4]], force[0, 1, 3], force[0, 2, 3] = (-p.X_u, -p.X_uu), m_22, m_23
    force[1, 0, 3], force[1, 1, [0, 5]], force[1, 2, [0, 6]] = -m_11, (-p.Y_v, -p.Y_vv), (p.Y_r, p.Y_rr)
    force[2, 0, [2, 3]], force[2, 1, [0, 6]], force[2, 2, [0, 6]] = (
        (m_11 - m_22, -m_23),
        (p.N_v, p.N_rv),
        (-p.N_r, -p.N_rr),
    )
    inverse = np.linalg.inv(inertia)
    motion = inverse @ force.reshape(3, 21)
    # Sixteen directions of the action held, the others drawn anew after 1 to 100 steps.
    runs, every = np.arange(RUNS), np.resize([1, 2, 5, 20, 100], RUNS)
    every[:16] = TRIAL_STEPS
    drawn = np.random.default_rng(0).integers(0, 16, (TRIAL_STEPS, RUNS))
    drawn[0, :16] = runs[:16]
    angle = drawn[np.arange(TRIAL_STEPS)[:, None] // every, runs] * math.pi / 8
    push = np.stack([limits.max_force_n * np.cos(angle), limits.max_torque_nm * np.sin(angle)], axis=1)
    push = inverse[:, ::2] @ push
    # Half of them start at the speeds that an action holds alone, so that short steps need no time to reach them.
    nu = np.zeros((3, RUNS))
    nu[0] = speed_mps
    held = np.array([[math.cos(k), math.sin(k)] for k in range(RUNS // 2)]).T
    nu[0, ::2] = [_terminal(p.X_u, p.X_uu, limits.max_force_n * share) for share in held[0]]
    nu[2, ::2] = [_terminal(p.N_r, p.N_rr, limits.max_torque_nm * share) for share in held[1]]
    factor = np.ones((7, RUNS))

    def rate(nu: Float64, push: Float64) -> Float64:
        factor[1:4], factor[4:] = nu, np.abs(nu)
        return push + motion @ (nu[:, None] * factor).reshape(21, RUNS)

    with np.errstate(all="ignore"):
        for k in range(TRIAL_STEPS):
            a = rate(nu, push[k])
            b = rate(nu + step_s / 2 * a, push[k])
            c = rate(nu + step_s / 2 * b, push[k])
            d = rate(nu + step_s * c, push[k])
            nu += step_s / 6 * (a + 2 * (b + c) + d)
            if k % 50 == 49 and not (np.abs(nu) < RUNAWAY).all():
                return True
    return False


def _inertia(p: "Vehicle") -> Float64:
    """The inertia matrix M of Eq. 2, added mass included."""
    m_23 = p.m_kg * p.x_G_m - p.Y_rdot_kgm
    return np.array(
        [[p.m_kg - p.X_udot_kg, 0, 0], [0, p.m_kg - p.Y_vdot_kg, m_23], [0, m_23, p.I_z_kgm2 - p.N_rdot_kgm2]]
    )


def _check_dissipation(scenario: "Scenario") -> None:
    """Nu . D(nu) nu >= 0 for every nu, linear and non-linear part each."""
    p = scenario.vehicle
    if (p.Y_r + p.N_v) ** 2 > 4 * p.Y_v * p.N_r:
        raise ValueError(
            f"vehicle.Y_r + vehicle.N_v = {p.Y_r + p.N_v:g} lets linear damping add energy; "
            f"keep its size within 2 sqrt(Y_v N_r) = {2 * math.sqrt(p.Y_v * p.N_r):g}"
        )
    coupling = abs(p.Y_rr + p.N_rv)
    # Y_vv s^3 - c s + N_rr >= 0 for all s = |v / r| >= 0; the minimum lies at s = sqrt(c / (3 Y_vv)).
    bound = 3 * (p.Y_vv * p.N_rr**2 / 4) ** (1 / 3)
    if coupling > bound:
        raise ValueError(
            f"vehicle.Y_rr + vehicle.N_rv = {p.Y_rr + p.N_rv:g} lets quadratic damping add energy; "
            f"keep its size within {bound:g}"
        )


def _terminal(linear: float, quadratic: float, force: float) -> float:
    """Speed at which linear plus quadratic resistance equals the force, with its sign."""
    return 2 * force / (linear + math.sqrt(linear**2 + 4 * quadratic * abs(force)))
