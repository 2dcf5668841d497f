"""Changes to the paper's controller that may let a swarm come to rest: smooth neighbours, surge damping."""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.paper.bio_inspired import MAX_EXPONENT, MIN_DISTANCE_M, BioInspired, BioInspiredGains
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Float32, Float64


class Softening(NamedTuple):
    """Changes to the paper's controller, each off by default."""

    near_m: float = math.inf
    """Distance up to which neighbours count in full [m]."""
    far_m: float = math.inf
    """Distance from which they do not count [m], with a smooth step between."""
    surge_damping: float = 0.0
    """Thrust against surge relative to the reference's velocity [N s/m]."""


PAPER = Softening()
"""The unchanged controller."""


class Softened(BioInspired):
    """The paper's controller with a ``Softening``, in NumPy; without one it is ``BioInspired``, an echo per beam."""

    def __init__(
        self,
        scenario: Scenario,
        num_worlds: int = 1,
        *,
        gains: BioInspiredGains | None = None,
        softening: Softening = PAPER,
    ) -> None:
        super().__init__(scenario, num_worlds, gains=gains)
        self.softening = softening

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        g, soft, limits = self.gains, self.softening, self.limits
        neighbour, echo = percept["neighbour"].astype(np.float64), percept["echo_position"].astype(np.float64)
        weight = -g.zeta_n * (_bounded_exp(g.delta_n, neighbour) - math.e) * (percept["detected"] > 0)
        weight *= fade(np.hypot(neighbour[..., 0], neighbour[..., 1]), soft.near_m, soft.far_m)
        force = g.zeta_l * percept["reference"].astype(np.float64) + (weight[..., None] * neighbour).sum(axis=-2)
        weight = -g.zeta_o * _bounded_exp(g.delta_o, echo) * (percept["echo"] > 0)
        force += (weight[..., None] * echo).sum(axis=-2)
        force[..., 0] -= soft.surge_damping * (percept["velocity"] - percept["reference_velocity"])[..., 0]
        action = force * (1.0 / limits.max_force, limits.lever_arm / limits.max_torque)
        action /= np.maximum(np.hypot(action[..., 0], action[..., 1]), 1.0)[..., None]
        return action.astype(np.float32)


def fade(distance: Float64, near: float, far: float) -> Float64:
    """1 up to ``near``, 0 from ``far`` on, with the cubic smooth step between; any shape."""
    if math.isinf(near):
        return np.ones_like(distance)
    share = np.clip((far - distance) / (far - near), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _bounded_exp(length: float, p: Float64) -> Float64:
    """exp(length / |p|) with the clamps of ``bio_inspired.bounded_exp``."""
    distance = np.maximum(np.hypot(p[..., 0], p[..., 1]), MIN_DISTANCE_M)
    return np.exp(np.minimum(length / distance, MAX_EXPONENT))
