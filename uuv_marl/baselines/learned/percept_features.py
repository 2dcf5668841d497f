"""The features of a percept that a learned policy's actor sees, and the fixed short-range barrier beside it."""

import numpy as np

from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains, neighbour_force, obstacle_force
from uuv_marl.baselines.policy import Limits
from uuv_marl.percept import PerceptLayout, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32, Int64

BARRIER = BioInspiredGains(zeta_l=0.0, zeta_n=0.8, delta_n=35.0, zeta_o=0.3, delta_o=140.0)
"""Eq. 20-21 at short range, without the pull to l(t): half the paper's delta_n, and weaker but steeper at obstacles."""
MOST_BARRIER = 8.0
"""The barrier is bounded here [full force]; the action is bounded by 1 after the sum."""

SURGE, SWAY, YAW, LED_X, LED_Y, L_X, L_Y, TO_X, TO_Y = range(9)
"""Features of a vehicle's own motion, of l(t)'s velocity and place, and of the direction to it, shorter where near."""
_OWN, _PUT = 9, 4
"""How many features a vehicle's own are, and those of a neighbour (``put``)."""
_CLOSE, _RANGE, _TOWARDS_X, _TOWARDS_Y, _ECHO = range(5)
"""Features of an echo, and how many: nearness, range, direction, longer where near."""


def num_features(sectors: int, active_sectors: int) -> int:
    """Entries that ``Features`` has for so many sub-sectors, ``active_sectors`` of them with echoes."""
    return _OWN + _PUT * sectors + _ECHO * active_sectors + 2


class Features:
    """Bounded features of a percept, the same in training and in use, and the barrier's force.

    Args:
        scenario: gives the percept's layout and the vehicle's limits.
        gains: of the barrier.
    """

    def __init__(self, scenario: Scenario, gains: BioInspiredGains) -> None:
        self._at = PerceptLayout.of(scenario).offsets
        self._gains = gains
        self._limits = Limits.of(scenario)
        self.size = num_features(scenario.sonar.num_sectors, scenario.sonar.num_active_sectors)

    def look(self, flat: Float32, features: Float32, barrier: Float32, clamps: Int64) -> None:
        """Fill features and barrier from flat percepts.

        Args:
            flat: percepts in physical units, shape (world, vehicle, entry).
            features: filled, shape (world, vehicle, size).
            barrier: filled with the force [full force], shape (world, vehicle, 2).
            clamps: numerical bounds that bound, counted per world, shape (world,); added to.
        """
        _look(flat, self._at, self._gains, self._limits, features, barrier, clamps)


@compiled
def put(p_x: float, p_y: float, near: float, out: Float32, k: int) -> None:
    """A position [m] as four features: its direction, longer the nearer than about ``near`` it is, and itself.

    At ``near`` [m] the direction has a length of about two thirds. Four features are filled, ``k`` is the first.
    """
    length = np.sqrt(p_x * p_x + p_y * p_y)
    weight = near / ((length + 0.5 * near) * max(length, 1e-3))
    far = 1.0 / max(64.0, 0.5 * length)
    out[k], out[k + 1], out[k + 2], out[k + 3] = weight * p_x, weight * p_y, far * p_x, far * p_y


@compiled
def _look(
    flat: Float32, at: Starts, gains: BioInspiredGains, limits: Limits, features: Float32, barrier: Float32,
    clamps: Int64,
) -> None:  # fmt: skip
    """``Features.look``. Every feature is bounded: by about 2, velocities by what the vehicle can do.

    ``barrier`` is filled with the force [full force], shape (world, vehicle, 2).
    """
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            out = features[w, i]
            out[:] = 0.0
            out[SURGE], out[SWAY] = see.velocity[w, i, 0] / 4.0, see.velocity[w, i, 1]
            out[YAW] = see.yaw_rate[w, i, 0]
            out[LED_X], out[LED_Y] = see.reference_velocity[w, i, 0] / 4.0, see.reference_velocity[w, i, 1] / 4.0
            l_x, l_y = see.reference[w, i, 0], see.reference[w, i, 1]
            length = np.sqrt(l_x * l_x + l_y * l_y)
            out[L_X], out[L_Y] = l_x / max(64.0, 0.5 * length), l_y / max(64.0, 0.5 * length)
            out[TO_X], out[TO_Y] = l_x / (length + 8.0), l_y / (length + 8.0)
            f_x, f_y, k = 0.0, 0.0, _OWN
            for s in range(see.heard.shape[2]):
                if see.heard[w, i, s] > 0.0:
                    p_x, p_y = see.neighbour[w, i, s, 0], see.neighbour[w, i, s, 1]
                    put(p_x, p_y, 10.0, out, k)
                    d_x, d_y, clamped = neighbour_force(p_x, p_y, gains)
                    f_x, f_y, clamps[w] = f_x + d_x, f_y + d_y, clamps[w] + clamped
                k += _PUT
            for a in range(see.echo.shape[2]):
                if see.echo[w, i, a] > 0.0:
                    p_x, p_y = see.echo_position[w, i, a, 0], see.echo_position[w, i, a, 1]
                    reach = see.echo_range[w, i, a]
                    away = max(np.sqrt(p_x * p_x + p_y * p_y), 1e-3)
                    out[k + _CLOSE], out[k + _RANGE] = 20.0 / (reach + 10.0), reach / 64.0
                    out[k + _TOWARDS_X] = out[k + _CLOSE] * p_x / away
                    out[k + _TOWARDS_Y] = out[k + _CLOSE] * p_y / away
                    d_x, d_y, clamped = obstacle_force(p_x, p_y, gains)
                    f_x, f_y, clamps[w] = f_x + d_x, f_y + d_y, clamps[w] + clamped
                k += _ECHO
            f_x, f_y = f_x / limits.max_force, f_y * limits.lever_arm / limits.max_torque
            shrink = min(1.0, MOST_BARRIER / max(np.sqrt(f_x * f_x + f_y * f_y), 1e-9))
            barrier[w, i, 0], barrier[w, i, 1] = shrink * f_x, shrink * f_y
            away = 1.0 + np.sqrt(barrier[w, i, 0] ** 2 + barrier[w, i, 1] ** 2)
            out[k], out[k + 1] = barrier[w, i, 0] / away, barrier[w, i, 1] / away
