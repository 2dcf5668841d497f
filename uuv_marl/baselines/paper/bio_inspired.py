"""The paper's controller (Eq. 18-22), from positions alone, and its strongest hand-made form."""

import math
from typing import Literal, NamedTuple, get_args

from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.policy import Limits, surge_resistance, tuned, write_action
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.errors import PolicyError
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32, Int64

FEED_FORWARD = 1.2  # feed-forward of ``bio_inspired_plus``: a little more than the drag, as it acts along the reference
MAX_EXPONENT = 50.0  # largest exponent length / distance [1]
MIN_DISTANCE_M = 0.5  # smallest distance in the exponent [m]


class BioInspiredGains(NamedTuple):
    """Gains of Eq. 18-21; the defaults are Table 1."""

    zeta_l: float = 30.0  # attraction to the reference point [N/m]
    zeta_n: float = 0.8  # weight of neighbours [N/m]
    delta_n: float = 60.0  # distance at which neighbours neither attract nor repel [m]
    zeta_o: float = 8.0  # weight of obstacles [N/m]
    delta_o: float = 80.0  # decay length of their repulsion [m]
    # multiple of the drag at the reference's velocity that is added as thrust [1]; none in the paper
    feed_forward: float = 0.0


ObstacleTerm = Literal["per_echo", "per_obstacle"]


class BioInspired(Controller):
    """Attraction to l(t), attraction and repulsion among neighbours, repulsion from obstacles. Eq. 18-22.

    Args:
        gains: Table 1 by default.
        obstacle_term: Eq. 21's sum is over echoes or over obstacles. Echoes of adjacent sub-sectors count as one
            obstacle, by the nearest echo, where their positions agree (centres) or follow without a gap (surfaces).
    """

    requirements = PolicyRequirements(outputs_force=True)
    Gains = BioInspiredGains

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, gains: BioInspiredGains | None = None,
        obstacle_term: ObstacleTerm = "per_echo",
    ) -> None:  # fmt: skip
        super().__init__(scenario, num_worlds, gains=gains)
        if obstacle_term not in get_args(ObstacleTerm):
            raise PolicyError(f"obstacle_term must be 'per_echo' or 'per_obstacle', got {obstacle_term!r}")
        self._once = obstacle_term == "per_obstacle"

    def _write(self, percept: Percept, action: Float32) -> None:
        flat = self.flat(percept)
        _act(flat, self.layout.offsets, self.gains, self.limits, self._once, self._centres, action, self.clamps)


class BioInspiredPlus(BioInspired):
    """The same controller with feed-forward of the reference's velocity, yaw damping and tuned gains."""

    requirements = Controller.requirements

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, gains: BioInspiredGains | None = None) -> None:
        tuned_gains = gains or BioInspiredGains(**tuned("bio_inspired_plus"), feed_forward=FEED_FORWARD)
        super().__init__(scenario, num_worlds, gains=tuned_gains)


@compiled
def bounded_exp(length: float, distance: float) -> tuple[float, int]:
    """exp(length / distance) [1], distance at least 0.5 m and exponent at most 50, and 1 if a bound is active."""
    clamped = int(distance < MIN_DISTANCE_M)
    exponent = length / max(distance, MIN_DISTANCE_M)
    if exponent > MAX_EXPONENT:
        return math.exp(MAX_EXPONENT), 1
    return math.exp(exponent), clamped


@compiled
def neighbour_force(p_x: float, p_y: float, g: BioInspiredGains) -> tuple[float, float, int]:
    """Force [N] from a neighbour at p relative to the vehicle [m], zero at delta_n. One term of Eq. 20."""
    value, clamped = bounded_exp(g.delta_n, math.hypot(p_x, p_y))
    weight = -g.zeta_n * (value - math.e)
    return weight * p_x, weight * p_y, clamped


@compiled
def obstacle_force(p_x: float, p_y: float, g: BioInspiredGains) -> tuple[float, float, int]:
    """Force [N] from an obstacle at p relative to the vehicle [m]. One term of Eq. 21."""
    value, clamped = bounded_exp(g.delta_o, math.hypot(p_x, p_y))
    weight = -g.zeta_o * value
    return weight * p_x, weight * p_y, clamped


@compiled
def counts_once(w: int, i: int, a: int, see: Fields, centres: bool) -> bool:
    """Whether active sub-sector a holds the echo that stands for its obstacle: the nearest, first of equals."""
    reach, position = see.echo_range[w, i, a], see.echo_position[w, i]
    for side in (-1, 1):
        other = a + side
        while 0 <= other < see.echo.shape[2] and see.echo[w, i, other] > 0.0:
            if centres and (position[other, 0] != position[a, 0] or position[other, 1] != position[a, 1]):
                break
            theirs = see.echo_range[w, i, other]
            if theirs < reach or (theirs == reach and side < 0):
                return False
            other += side
    return True


@compiled
def _act(
    flat: Float32, at: Starts, g: BioInspiredGains, limits: Limits, once: bool, centres: bool, action: Float32,
    clamps: Int64,
) -> None:  # fmt: skip
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            v_x, v_y = see.reference_velocity[w, i, 0], see.reference_velocity[w, i, 1]
            drag = g.feed_forward * surge_resistance(math.hypot(v_x, v_y), limits)
            f_x = g.zeta_l * see.reference[w, i, 0] + drag * v_x
            f_y = g.zeta_l * see.reference[w, i, 1] + drag * v_y
            for k in range(see.detected.shape[2]):
                if see.detected[w, i, k] > 0.0:
                    d_x, d_y, c = neighbour_force(see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1], g)
                    f_x, f_y = f_x + d_x, f_y + d_y
                    clamps[w] += c
            for a in range(see.echo.shape[2]):
                if see.echo[w, i, a] > 0.0 and (not once or counts_once(w, i, a, see, centres)):
                    d_x, d_y, c = obstacle_force(see.echo_position[w, i, a, 0], see.echo_position[w, i, a, 1], g)
                    f_x, f_y = f_x + d_x, f_y + d_y
                    clamps[w] += c
            write_action(f_x, f_y, limits, action[w, i])
