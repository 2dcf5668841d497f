"""Motion: Eq. 1-4 in matrices, as the paper prints them, Eq. 22, and Runge-Kutta (Eq. 23-24)."""

import math

import numpy as np


def matrices(scenario, nu):
    """M, C and D of Eq. 3-4; D less the lift of body and fins."""
    p, (u, v, r) = scenario.vehicle, nu
    m, x_g = p.m_kg, p.x_G_m
    on = 1.0 if p.munk_moment else 0.0
    m_rb = np.array([[m, 0, 0], [0, m, m * x_g], [0, m * x_g, p.I_z_kgm2]])
    m_a = -np.array([[p.X_udot_kg, 0, 0], [0, p.Y_vdot_kg, p.Y_rdot_kgm], [0, p.Y_rdot_kgm, p.N_rdot_kgm2]])
    a, b = m * (x_g * r + v), m * u
    c_rb = np.array([[0, 0, -a], [0, 0, b], [a, -b, 0]])
    a, b = p.Y_vdot_kg * v + p.Y_rdot_kgm * r, p.X_udot_kg * u
    c_a = np.array([[0, 0, a], [0, 0, -b], [-a, b, 0]])
    d_l = np.array([[p.X_u, 0, 0], [0, p.Y_v, -p.Y_r], [0, -p.N_v, p.N_r]])
    d_nl = np.array([
        [p.X_uu * abs(u), 0, 0],
        [0, p.Y_vv * abs(v), -p.Y_rr * abs(r)],
        [0, -p.N_rv * abs(r) - p.N_vv * abs(v), p.N_rr * abs(r)],
    ])  # fmt: skip
    lift = max(u, 0.0) * np.array([[0, 0, 0], [0, p.Y_uv, p.Y_ur], [0, p.N_uv, p.N_ur]])
    return m_rb + m_a, c_rb + on * c_a, d_l + d_nl - lift


def rotation(psi):
    """R(psi): from the body frame to north and east."""
    return np.array([[math.cos(psi), -math.sin(psi)], [math.sin(psi), math.cos(psi)]])


def rate(state, tau, flow, scenario):
    """Eq. 1-2: rates of (x, y, psi, u, v, r), under thrust [N] and torque [N m] or Fossen's rudder angle [rad]."""
    act, nu = scenario.actuators, state[3:]
    m, c, d = matrices(scenario, nu)
    force = np.array([tau[0], 0.0, tau[1]])
    if act.kind == "rudder":
        force = np.array([tau[0], *(np.array([act.Y_uud, act.N_uud]) * max(nu[0], 0.0) ** 2 * tau[1])])
    return np.concatenate([rotation(state[2]) @ nu[:2] + flow, nu[2:], np.linalg.solve(m, force - c @ nu - d @ nu)])


def advance(state, taus, flow, h, scenario):
    """The state h later; ``taus`` are the forces now, h / 2 and h later."""
    a = rate(state, taus[0], flow, scenario)
    b = rate(state + h / 2 * a, taus[1], flow, scenario)
    c = rate(state + h / 2 * b, taus[1], flow, scenario)
    d = rate(state + h * c, taus[2], flow, scenario)
    return state + h / 6 * (a + 2 * b + 2 * c + d)


def limited(a, scenario):
    """The nearest action that the actuators take: on the disc, or with a rudder in the box."""
    return np.clip(a, -1, 1) if scenario.actuators.kind == "rudder" else a / max(1.0, np.hypot(*a))


def forces(a, scenario):
    """Thrust [N], and torque [N m] or Fossen's rudder angle [rad], of an action. Eq. 22."""
    act = scenario.actuators
    side = math.copysign(math.radians(act.rudder_max_deg), act.N_uud) if act.kind == "rudder" else act.max_torque_nm
    return np.array([a[0] * (act.astern_n if a[0] < 0 else act.max_force_n), a[1] * side])


def held(a, turned, scenario):
    """The action whose horizontal force has the direction in the world that it had before the vehicle turned."""
    act = scenario.actuators
    if act.kind == "rudder":
        return a
    thrust, torque = forces(a, scenario)
    thrust, side = rotation(turned).T @ [thrust, torque / act.lever_arm_m]
    most = act.astern_n if thrust < 0 else act.max_force_n
    return limited(np.array([thrust / most if most else 0.0, side * act.lever_arm_m / act.max_torque_nm]), scenario)


def decide(state, action, scenario, given=(0.0, 0.0), flow=(0.0, 0.0)):
    """State and forces in the water after a decision period, and the mean demand of the action.

    Forces lag, from those that are ``given``: each falls behind what is asked by e^(-t / lag).
    """
    act, timing, first, demand = scenario.actuators, scenario.timing, state[2], 0.0
    lags, h = (act.thrust_lag_s, act.yaw_lag_s), timing.integration_step_s
    action = limited(action, scenario)
    for hold in range(timing.control_steps_per_decision):
        a = held(action, state[2] - first, scenario) if hold else action
        asked = forces(a, scenario)
        if act.kind != "rudder":
            asked[1] = np.clip(asked[1] - act.yaw_damping_nms * state[5], -act.max_torque_nm, act.max_torque_nm)
        demand += (max(a**2) if act.kind == "rudder" else sum(a**2)) / timing.control_steps_per_decision
        asked[1] *= act.yaw_authority
        for _ in range(timing.integration_steps_per_control_step):
            left = np.array([[math.exp(-s * h / lag) if lag else 0.0 for lag in lags] for s in (0.0, 0.5, 1.0)])
            taus = asked + (np.array(given) - asked) * left
            state, given = advance(state, taus, np.array(flow), h, scenario), taus[2]
        state[2] = math.remainder(state[2], 2 * math.pi)
    return state, given, demand
