"""The plain kernel: the physics as the paper's formulas say it, one vehicle and one pair at a time.

It is slow and stays so: whatever makes the package fast is compared with it.
"""

import math

import numba
import numpy as np

# --- Motion (Eq. 1-4, 22-24) ---


def derivative(state, tau_u, tau_r, p):
    """Rate of (x, y, psi, u, v, r). Eq. 1-2, 4."""
    _, _, psi, u, v, r = state
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    f_u = tau_u - -a * r - (p.X_u + p.X_uu * abs(u)) * u
    f_v = -b * r - ((p.Y_v + p.Y_vv * abs(v)) * v - (p.Y_r + p.Y_rr * abs(r)) * r)
    f_r = tau_r - (a * u - b * v) - (-(p.N_v + p.N_rv * abs(r)) * v + (p.N_r + p.N_rr * abs(r)) * r)
    return (
        math.cos(psi) * u - math.sin(psi) * v,
        math.sin(psi) * u + math.cos(psi) * v,
        r,
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


def advance(state, tau_u, tau_r, h, p):
    """The classical fourth-order Runge-Kutta method. Eq. 23-24."""

    def after(rate, seconds):
        return [value + seconds * change for value, change in zip(state, rate, strict=True)]

    k_1 = derivative(state, tau_u, tau_r, p)
    k_2 = derivative(after(k_1, 0.5 * h), tau_u, tau_r, p)
    k_3 = derivative(after(k_2, 0.5 * h), tau_u, tau_r, p)
    k_4 = derivative(after(k_3, h), tau_u, tau_r, p)
    return after([a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k_1, k_2, k_3, k_4, strict=True)], h / 6.0)


def project(a_x, a_y):
    """The nearest action on the unit disc."""
    norm = math.hypot(a_x, a_y)
    return (a_x / norm, a_y / norm) if norm > 1.0 else (a_x, a_y)


def decide(eta, nu, action, p, holds, steps, step_s):
    """Pose, velocity and mean squared action of one vehicle a decision period later; the force keeps its direction.

    Eq. 22.
    """
    state, decided, effort = [*eta, *nu], eta[2], 0.0
    a = project(*action)
    for hold in range(holds):
        a_x, a_y = a
        if hold > 0:
            f_x, f_y = a_x * p.max_force, a_y * p.max_torque / p.lever_arm
            c, s = math.cos(state[2] - decided), math.sin(state[2] - decided)
            a_x, a_y = project((c * f_x + s * f_y) / p.max_force, (c * f_y - s * f_x) * p.lever_arm / p.max_torque)
        tau_r = p.max_torque * a_y - p.yaw_damping * state[5]
        tau_r = min(max(tau_r, -p.max_torque), p.max_torque)
        for _ in range(steps):
            state = advance(state, p.max_force * a_x, tau_r, step_s, p)
        state[2] -= 2.0 * math.pi * math.floor((state[2] + math.pi) / (2.0 * math.pi))
        effort += (a_x * a_x + a_y * a_y) / holds
    return state[:3], state[3:], effort


# --- Sonar (Eq. 8-15) ---


def sub_sectors(arrays):
    """Lower and upper edge, as unit vectors, and range [m] of every sub-sector. Eq. 12."""

    def unit(degrees):
        radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
        return math.cos(radians), math.sin(radians)

    lower, upper, ranges = [], [], []
    for array in arrays:
        for k in range(array.sub_sectors):
            lower.append(unit(array.mounting_deg + array.aperture_deg * (k / array.sub_sectors - 0.5)))
            upper.append(unit(array.mounting_deg + array.aperture_deg * ((k + 1) / array.sub_sectors - 0.5)))
            ranges.append(array.range_m)
    return np.array(lower), np.array(upper), np.array(ranges)


@numba.njit
def hidden(x, y, dx, dy, discs):
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy)."""
    length2 = dx * dx + dy * dy
    for k in range(len(discs)):
        o_x, o_y = discs[k, 0] - x, discs[k, 1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if math.hypot(o_x - share * dx, o_y - share * dy) < discs[k, 2]:
            return True
    return False


@numba.njit
def hear(eta, heading, alive, lower, upper, ranges, discs):
    """Index of the nearest vehicle in each sub-sector, -1 for none, the lower index of equals; ``discs`` hide.

    ``heading`` holds cos psi and sin psi: where a bearing lies on an edge, their last bit decides.
    """
    n, sectors = len(eta), len(ranges)
    heard = np.full((n, sectors), -1)
    for i in range(n):
        nearest = ranges * ranges
        for j in range(n):
            if i == j or not alive[i] or not alive[j]:
                continue
            dx, dy = eta[j, 0] - eta[i, 0], eta[j, 1] - eta[i, 1]
            squared = dx * dx + dy * dy
            b_x = heading[i, 0] * dx + heading[i, 1] * dy
            b_y = heading[i, 0] * dy - heading[i, 1] * dx
            for k in range(sectors):
                if (
                    squared < nearest[k]
                    and lower[k, 0] * b_y - lower[k, 1] * b_x > 0.0
                    and upper[k, 0] * b_y - upper[k, 1] * b_x <= 0.0
                    and not hidden(eta[i, 0], eta[i, 1], dx, dy, discs)
                ):
                    nearest[k], heard[i, k] = squared, j
    return heard


# --- Distances and contacts ---


@numba.njit
def measure_vehicles(eta, before, alive, hull):
    """Each vehicle's distance to the nearest other, the largest of all distances, and who came into contact."""
    n = len(eta)
    spacing, largest, contacts = np.full(n, math.inf), -math.inf, np.zeros(n, np.int64)
    for i in range(n):
        for j in range(n):
            if i == j or not alive[i] or not alive[j]:
                continue
            distance = math.hypot(eta[j, 0] - eta[i, 0], eta[j, 1] - eta[i, 1])
            was = math.hypot(before[j, 0] - before[i, 0], before[j, 1] - before[i, 1])
            spacing[i] = min(spacing[i], distance)
            largest = max(largest, distance)
            contacts[i] += distance < 2.0 * hull and was >= 2.0 * hull
    return spacing, largest if largest >= 0.0 else math.inf, contacts


@numba.njit
def measure_obstacles(eta, before, alive, hull, discs):
    """Each vehicle's distance to the nearest surface, each obstacle's to the nearest vehicle, and who touched one."""
    n = len(eta)
    clearance, reached, contacts = np.full(n, math.inf), np.full(len(discs), math.inf), np.zeros(n, np.int64)
    for i in range(n):
        for k in range(len(discs)):
            if not alive[i]:
                continue
            gap = math.hypot(discs[k, 0] - eta[i, 0], discs[k, 1] - eta[i, 1]) - discs[k, 2]
            was = math.hypot(discs[k, 0] - before[i, 0], discs[k, 1] - before[i, 1]) - discs[k, 2]
            clearance[i] = min(clearance[i], gap)
            reached[k] = min(reached[k], gap)
            contacts[i] += gap < hull and was >= hull
    return clearance, reached, contacts
