"""Flocking by Olfati-Saber: algorithm 3 of "Flocking for multi-agent dynamic systems: algorithms and theory".

R. Olfati-Saber, IEEE Trans. Automatic Control 51(3), 401-420, 2006. Vehicles are alpha-agents that attract and repel
each other towards a lattice; the nearest point of an obstacle's surface is a beta-agent that repels and brakes; the
reference point is the gamma-agent. The source's lengths have no unit; here ``unit`` metres stand for 1. Forces stand
for the source's accelerations. Its agents move without resistance, so vehicles compensate theirs at the reference's
velocity.

A vehicle that does not perceive l(t) has no gamma-agent and compensates its resistance at its own velocity. With
alignment that is the extension by Su, Wang and Lin, Flocking of multi-agents with a virtual leader, ibid. 54(2),
293-307, 2009.
"""

import math
from typing import NamedTuple

from uuv_marl.baselines.avoidance import bump, obstacle_at
from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.paper.bio_inspired import counts_once
from uuv_marl.baselines.policy import Limits, surge_resistance, write_action
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32

EPSILON = 0.1  # parameter of the sigma-norm, as in the source's simulations [1]
_H_ALPHA = 0.2  # share of the reach within which neighbours have full weight, as in the source's simulations [1]
_H_BETA = 0.9  # the same share for obstacles [1]


class OlfatiSaberGains(NamedTuple):
    """Free parameters, found by tuning; the source's symbols in brackets."""

    unit: float  # length that stands for 1 of the source, over which forces change by about 1 [m]
    spacing: float  # spacing of the lattice (d) [m]
    reach: float  # range of neighbours' forces, by the spacing (r / d; 1.2 in the source) [1]
    attraction: float  # scale of attraction beyond the spacing (c_1 a), which is about 3 times this [N]
    repulsion: float  # scale of repulsion within the spacing (c_1 b) [N]
    obstacle: float  # scale of repulsion by an obstacle (c_1 of beta), which is up to 6 times this [N]
    obstacle_range: float  # distance to a surface at which it ends (d') [m]
    obstacle_damping: float  # of the velocity relative to an obstacle's nearest point (c_2 of beta) [N s/m]
    pull: float  # largest pull to l(t) (c_1 of gamma) [N]
    pull_length: float  # distance at which it is 0.7 of that; 1 in the source [m]
    reference_velocity: float  # damping towards the reference's velocity (c_2 of gamma) [N s/m]
    alignment: float = 0.0  # damping towards each neighbour's velocity (c_2 of alpha) [N s/m]; 0 without ``link``


class OlfatiSaber(Controller):
    """Olfati-Saber's flocking without alignment: lattice, obstacles and navigation, from positions alone."""

    Gains = OlfatiSaberGains
    tuned_as = "olfati_saber"

    def _write(self, percept: Percept, action: Float32) -> None:
        _act(self.flat(percept), self.at, self.gains, self.limits, self._centres, action)


class OlfatiSaberInformed(OlfatiSaber):
    """``OlfatiSaber`` with alignment: every vehicle also follows its neighbours' velocities."""

    requirements = OlfatiSaber.requirements._replace(channels=("link",))
    tuned_as = "olfati_saber_informed"


@compiled
def sigma_norm(distance: float) -> float:
    """The source's norm, smooth at zero, of a distance in its lengths [1]."""
    return (math.sqrt(1.0 + EPSILON * distance * distance) - 1.0) / EPSILON


@compiled
def slope(distance: float) -> float:
    """Derivative of ``sigma_norm`` [1]: the length of the source's n_ij."""
    return distance / math.sqrt(1.0 + EPSILON * distance * distance)


@compiled
def sigma_1(z: float) -> float:
    """The source's sigma_1, between -1 and 1: z / sqrt(1 + z^2)."""
    return z / math.sqrt(1.0 + z * z)


@compiled
def rho_h(z: float, h: float) -> float:
    """1 up to h, falling smoothly to 0 at 1."""
    return bump((z - h) / (1.0 - h))


@compiled
def phi_alpha(z: float, g: OlfatiSaberGains) -> float:
    """Attraction [N] at a sigma-norm z of a neighbour's distance, 0 at the spacing; negative repels."""
    a, b = g.attraction, g.repulsion
    c = abs(a - b) / math.sqrt(4.0 * a * b)
    # Zero at the spacing also where attraction is the stronger, which the source excludes.
    shifted = z - sigma_norm(g.spacing / g.unit) + math.copysign(c, b - a)
    return alpha_weight(z, g) * 0.5 * ((a + b) * sigma_1(shifted) + (a - b))


@compiled
def alpha_weight(z: float, g: OlfatiSaberGains) -> float:
    """Weight of a neighbour at a sigma-norm z of its distance, from 1 to 0 [1]. a_ij of the source."""
    return rho_h(z / sigma_norm(g.reach * g.spacing / g.unit), _H_ALPHA)


@compiled
def neighbour_attraction(distance: float, g: OlfatiSaberGains) -> float:
    """Attraction [N] by a neighbour at a distance [m]: the slope of the lattice's potential, per ``unit``."""
    return phi_alpha(sigma_norm(distance / g.unit), g) * slope(distance / g.unit)


@compiled
def beta_weight(reach: float, g: OlfatiSaberGains) -> float:
    """Weight of an obstacle at a distance to its surface [m], from 1 to 0 [1]. b_ik of the source."""
    return rho_h(sigma_norm(reach / g.unit) / sigma_norm(g.obstacle_range / g.unit), _H_BETA)


@compiled
def obstacle_repulsion(reach: float, g: OlfatiSaberGains) -> float:
    """Repulsion [N] by an obstacle at a distance to its surface [m]. Minus phi_beta n_ik of the source."""
    gap = sigma_norm(reach / g.unit) - sigma_norm(g.obstacle_range / g.unit)
    return g.obstacle * beta_weight(reach, g) * (1.0 - sigma_1(gap)) * slope(reach / g.unit)


@compiled
def _act(flat: Float32, at: Starts, g: OlfatiSaberGains, limits: Limits, centres: bool, action: Float32) -> None:
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            u, v = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
            l_x, l_y = float(see.reference[w, i, 0]), float(see.reference[w, i, 1])
            r_x, r_y = float(see.reference_velocity[w, i, 0]), float(see.reference_velocity[w, i, 1])
            if l_x == 0.0 and l_y == 0.0 and r_x == 0.0 and r_y == 0.0:  # not perceived
                r_x, r_y = u, v
            pull = g.pull / math.sqrt(g.pull_length * g.pull_length + l_x * l_x + l_y * l_y)
            drag = surge_resistance(math.hypot(r_x, r_y), limits)
            f_x, f_y = pull * l_x + drag * r_x, pull * l_y + drag * r_y
            f_x, f_y = f_x + g.reference_velocity * (r_x - u), f_y + g.reference_velocity * (r_y - v)
            d_x, d_y = _alpha(w, i, see, g)
            o_x, o_y = _beta(w, i, see, g, centres)
            write_action(f_x + d_x + o_x, f_y + d_y + o_y, limits, action[w, i])


@compiled
def _alpha(w: int, i: int, see: Fields, g: OlfatiSaberGains) -> tuple[float, float]:
    """Force [N] from neighbours: the lattice, and alignment where their velocities are known."""
    u, v, f_x, f_y = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1]), 0.0, 0.0
    for k in range(see.detected.shape[2]):
        if see.detected[w, i, k] == 0.0:
            continue
        p_x, p_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        distance = max(math.hypot(p_x, p_y), 1e-6)
        force = neighbour_attraction(distance, g) / distance
        f_x, f_y = f_x + force * p_x, f_y + force * p_y
        if see.link_identity.shape[2] > 0 and see.link_identity[w, i, k] >= 1.0:
            weight = g.alignment * alpha_weight(sigma_norm(distance / g.unit), g)
            f_x += weight * (see.link_velocity[w, i, k, 0] - u)
            f_y += weight * (see.link_velocity[w, i, k, 1] - v)
    return f_x, f_y


@compiled
def _beta(w: int, i: int, see: Fields, g: OlfatiSaberGains, centres: bool) -> tuple[float, float]:
    """Force [N] from obstacles: away from each one's nearest point, and against the velocity relative to it.

    That point moves along the surface at radius / distance of the vehicle's velocity across. It stands still where
    echoes are points of surfaces, whose radius is unknown.
    """
    u, v, f_x, f_y = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1]), 0.0, 0.0
    for a in range(see.echo.shape[2]):
        if see.echo[w, i, a] > 0.0 and counts_once(w, i, a, see, centres):
            n_x, n_y, reach, radius = obstacle_at(w, i, a, see, centres)
            away, damping = obstacle_repulsion(reach, g), g.obstacle_damping * beta_weight(reach, g)
            towards, shadow = u * n_x + v * n_y, radius / max(radius + reach, 1e-6)
            f_x += damping * (shadow * (u - towards * n_x) - u) - away * n_x
            f_y += damping * (shadow * (v - towards * n_y) - v) - away * n_y
    return f_x, f_y
