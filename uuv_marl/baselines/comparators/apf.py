"""Artificial potential field (APF): Khatib 1986, with the obstacle repulsion of Ge and Cui 2000.

O. Khatib, Real-time obstacle avoidance for manipulators and mobile robots, Int. J. Robotics Research 5(1), 90-98: a
quadratic well at the goal, and a repulsion of finite range, here also among neighbours. S. S. Ge and Y. J. Cui, New
potential functions for mobile robot path planning, IEEE Trans. Robotics and Automation 16(5), 615-620: the repulsion by
obstacles is weighted with the squared distance to the goal, so that a goal near an obstacle remains reachable. The goal
is l(t).
"""

import math
from typing import NamedTuple

from uuv_marl.baselines.avoidance import obstacle_at
from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.paper.bio_inspired import MIN_DISTANCE_M, counts_once
from uuv_marl.baselines.policy import Limits, write_action
from uuv_marl.percept import Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32, Int64


class ApfGains(NamedTuple):
    """Free parameters, found by tuning."""

    attraction: float  # xi: pull to l(t) per distance [N/m]
    obstacle: float  # eta: repulsion by obstacles, with Ge and Cui's n = 2 [N m]
    obstacle_range: float  # rho_0: distance to a surface at which it ends [m]
    neighbour: float  # eta of neighbours [N m^3]
    neighbour_range: float  # rho_0 of neighbours [m]


class Apf(Controller):
    """Artificial potential field: a well at l(t), hills at neighbours and obstacles, those weighted by l(t)'s distance.

    ``tuned_for`` is ``two_swarms``, or "" for the paper's scenarios; ``gains`` replace the tuned ones.
    """

    Gains = ApfGains
    tuned_as = "apf"

    def _write(self, percept: Percept, action: Float32) -> None:
        _act(self.flat(percept), self.layout.offsets, self.gains, self.limits, self._centres, action, self.clamps)


@compiled
def apf_obstacle_force(
    n_x: float, n_y: float, rho: float, l_x: float, l_y: float, g: ApfGains
) -> tuple[float, float, int]:
    """Force [N] from an obstacle: the negative gradient of eta / 2 (1 / rho - 1 / rho_0)^2 rho_goal^2 within rho_0.

    Ge and Cui 2000, with n = 2: one part points away from the obstacle, one to the goal. n is a unit vector to the
    nearest surface point, ``rho`` its distance [m], l the vector to the goal [m]. Returns the force, forward and to
    starboard, and 1 if the bound on the distance is active.
    """
    near = max(rho, MIN_DISTANCE_M)
    if near >= g.obstacle_range:
        return 0.0, 0.0, 0
    gap = 1.0 / near - 1.0 / g.obstacle_range
    away = g.obstacle * gap * (l_x * l_x + l_y * l_y) / (near * near)
    to_goal = g.obstacle * gap * gap
    return to_goal * l_x - away * n_x, to_goal * l_y - away * n_y, int(rho < MIN_DISTANCE_M)


@compiled
def apf_neighbour_force(p_x: float, p_y: float, g: ApfGains) -> tuple[float, float, int]:
    """Force [N] from a neighbour at p [m]: the negative gradient of eta / 2 (1 / rho - 1 / rho_0)^2. Khatib 1986."""
    rho = math.hypot(p_x, p_y)
    near = max(rho, MIN_DISTANCE_M)
    if near >= g.neighbour_range:
        return 0.0, 0.0, 0
    weight = -g.neighbour * (1.0 / near - 1.0 / g.neighbour_range) / (near * near * near)
    return weight * p_x, weight * p_y, int(rho < MIN_DISTANCE_M)


@compiled
def _act(flat: Float32, at: Starts, g: ApfGains, limits: Limits, centres: bool, action: Float32, clamps: Int64) -> None:
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            l_x, l_y = float(see.reference[w, i, 0]), float(see.reference[w, i, 1])
            f_x, f_y = g.attraction * l_x, g.attraction * l_y
            for k in range(see.detected.shape[2]):
                if see.detected[w, i, k] > 0.0:
                    d_x, d_y, bound = apf_neighbour_force(see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1], g)
                    f_x, f_y = f_x + d_x, f_y + d_y
                    clamps[w] += bound
            for a in range(see.echo.shape[2]):
                if see.echo[w, i, a] > 0.0 and counts_once(w, i, a, see, centres):
                    n_x, n_y, reach, _ = obstacle_at(w, i, a, see, centres)
                    d_x, d_y, bound = apf_obstacle_force(n_x, n_y, reach, l_x, l_y, g)
                    f_x, f_y = f_x + d_x, f_y + d_y
                    clamps[w] += bound
            write_action(f_x, f_y, limits, action[w, i])
