"""Optimal reciprocal collision avoidance (ORCA): van den Berg, Guy, Lin and Manocha, ISRR 2009 (Springer 2011).

Of two vehicles that would collide within a horizon, each makes half of the smallest change of their relative velocity
that avoids the collision; for an obstacle, the vehicle makes the whole change. Each constraint is a half-plane of
velocities. The vehicle takes the velocity nearest to the desired one that meets all constraints; if none does, those of
obstacles have priority.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.avoidance import obstacle_at
from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.paper.bio_inspired import counts_once
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.safety.halfplanes import nearest_velocity
from uuv_marl.baselines.steering import full_speed, steer
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32, Float64

_SHARE = 0.5  # share of a change that a vehicle makes; its neighbour makes the other half. Definition of ORCA^tau_A|B.


class OrcaGains(NamedTuple):
    """Free parameters, found by tuning."""

    radius: float  # half the distance that two vehicles keep [m]
    clearance: float  # kept from obstacles' surfaces [m]
    horizon: float  # tau: time ahead in which collisions with neighbours are avoided [s]
    obstacle_horizon: float  # time ahead in which collisions with obstacles are avoided [s]
    pull: float  # desired velocity per distance to l(t), added to the reference's velocity [1/s]


class OrcaInformed(Controller):
    """Reciprocal velocity obstacles: half-planes of velocity from neighbours' velocities and from echoes.

    ``tuned_for`` is ``two_swarms``, or "" for the paper's scenarios; ``gains`` replace the tuned ones.
    """

    requirements = PolicyRequirements(("link",), yaw_damping_nms=600.0, outputs_force=True)
    Gains = OrcaGains
    tuned_as = "orca_informed"

    def _write(self, percept: Percept, action: Float32) -> None:
        flat, period, sonar = self.flat(percept), self.scenario.timing.decision_period_s, self.scenario.sonar
        planes = np.zeros((sonar.num_sectors + sonar.num_active_sectors, 3))
        _act(flat, self.at, self.gains, self.limits, self._gain, period, self._centres, planes, action)


@compiled
def escape(
    p_x: float, p_y: float, radius: float, v_x: float, v_y: float, horizon: float, period: float
) -> tuple[float, float, float, float]:
    """The smallest change u of a relative velocity to the edge of a velocity obstacle, and the normal there.

    The velocity obstacle holds the velocities that reach the disc within the horizon: a cone, cut off by a disc
    ``horizon`` times smaller. From inside the disc, it holds those still inside after a decision period. The normal
    points outwards. Head-on, starboard counts as the shorter side. p is the disc's centre [m], v the velocity relative
    to it [m/s], ``radius`` the sum of both radii [m]. Returns u_x, u_y [m/s], n_x, n_y.
    """
    squared = p_x * p_x + p_y * p_y
    inside = squared <= radius * radius
    time = period if inside else horizon
    w_x, w_y = v_x - p_x / time, v_y - p_y / time  # from the centre of the disc that cuts the cone off
    along, length = w_x * p_x + w_y * p_y, math.hypot(w_x, w_y)
    if inside or (along < 0.0 and along * along > radius * radius * length * length):
        if length > 0.0:
            n_x, n_y = w_x / length, w_y / length
        else:
            n_x, n_y = (-p_x / math.sqrt(squared), -p_y / math.sqrt(squared)) if squared > 0.0 else (-1.0, 0.0)
        gap = radius / time - length
        return gap * n_x, gap * n_y, n_x, n_y
    leg, side = math.sqrt(squared - radius * radius), 1.0 if p_x * w_y - p_y * w_x >= 0.0 else -1.0
    d_x, d_y = (p_x * leg - side * p_y * radius) / squared, (p_y * leg + side * p_x * radius) / squared
    reach = v_x * d_x + v_y * d_y
    return reach * d_x - v_x, reach * d_y - v_y, -side * d_y, side * d_x


@compiled
def _add(planes: Float64, num: int, u: float, v: float, demand: tuple[float, float, float, float], share: float) -> int:
    """Write the half-plane of a share of a velocity's change; returns the number of planes.

    u and v are the vehicle's velocity [m/s], ``demand`` is the result of ``escape``.
    """
    u_x, u_y, n_x, n_y = demand
    planes[num, 0], planes[num, 1] = -n_x, -n_y
    planes[num, 2] = -(n_x * (u + share * u_x) + n_y * (v + share * u_y))
    return num + 1


@compiled
def _act(
    flat: Float32, at: Starts, g: OrcaGains, limits: Limits, gain: float, period: float, centres: bool, planes: Float64,
    action: Float32,
) -> None:  # fmt: skip
    """Write every vehicle's action."""
    see, speed = fields(flat, at), full_speed(limits)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            u, v = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
            firm = _obstacles(w, i, see, g, period, centres, planes)
            num = _neighbours(w, i, see, g, period, planes, firm)
            w_x = float(see.reference_velocity[w, i, 0]) + g.pull * float(see.reference[w, i, 0])
            w_y = float(see.reference_velocity[w, i, 1]) + g.pull * float(see.reference[w, i, 1])
            far = max(math.hypot(w_x, w_y) / speed, 1.0)
            w_x, w_y, _ = nearest_velocity(w_x / far, w_y / far, planes, num, firm, speed)
            steer(w_x, w_y, u, v, gain, limits, action[w, i])


@compiled
def _obstacles(w: int, i: int, see: Fields, g: OrcaGains, period: float, centres: bool, planes: Float64) -> int:
    """Write the half-planes of obstacles, each once, for the whole change; returns their number."""
    u, v, num = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1]), 0
    for a in range(see.echo.shape[2]):
        if see.echo[w, i, a] > 0.0 and counts_once(w, i, a, see, centres):
            n_x, n_y, reach, radius = obstacle_at(w, i, a, see, centres)
            distance = reach + radius
            demand = escape(distance * n_x, distance * n_y, radius + g.clearance, u, v, g.obstacle_horizon, period)
            num = _add(planes, num, u, v, demand, 1.0)
    return num


@compiled
def _neighbours(w: int, i: int, see: Fields, g: OrcaGains, period: float, planes: Float64, num: int) -> int:
    """Write the half-planes of neighbours from row ``num`` on; returns the number of planes.

    A neighbour whose velocity is unknown (``modem``) is assumed to move like the reference point.
    """
    u, v = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
    for k in range(see.detected.shape[2]):
        if see.detected[w, i, k] == 0.0:
            continue
        v_x, v_y = float(see.reference_velocity[w, i, 0]), float(see.reference_velocity[w, i, 1])
        if see.link_identity[w, i, k] >= 1.0:
            v_x, v_y = float(see.link_velocity[w, i, k, 0]), float(see.link_velocity[w, i, k, 1])
        p_x, p_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        demand = escape(p_x, p_y, 2.0 * g.radius, u - v_x, v - v_y, g.horizon, period)
        num = _add(planes, num, u, v, demand, _SHARE)
    return num
