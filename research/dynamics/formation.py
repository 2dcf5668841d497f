"""Formations of steady tracking: places where the paper's controller (Eq. 18-20) balances the drag on a straight leg.

Positions are relative to l(t), x ahead and y to starboard. With frozen neighbour sets the control law is
smooth; ``Formation.settled`` says whether the vehicles detect these sets at such places.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.paper.bio_inspired import MAX_EXPONENT, MIN_DISTANCE_M, BioInspiredGains
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float64, Int32

ROUNDS = 1500
"""Relaxation steps towards a formation."""
_NEWTON_ROUNDS = 30
_SETTLED_N = 1e-6
_WITHIN_M = 5.0
"""A solution farther than this from where the sets were frozen is another formation."""


class Formation(NamedTuple):
    """Places of steady tracking, and the neighbours that each vehicle detects there."""

    places: Float64
    """Places relative to l(t) [m], shape (vehicle, 2)."""
    neighbour_indices: Int32
    """Index of the vehicle detected, -1 for none, shape (vehicle, sector)."""
    residual_n: float
    """Root mean square over vehicles of the unbalanced force [N]; 0 where settled."""
    settled: bool
    """Whether forces balance with the neighbour sets that the vehicles detect there."""


def straight_leg(
    num_vehicles: int = 54, yaw_damping_nms: float = 0.0, control_step_s: float = 0.1, leg_m: float = 4000.0
) -> Scenario:
    """Open water and one leg to the north from the origin; all clocks have the same period."""
    clocks = ("control_step_s", "integration_step_s", "decision_period_s")
    overrides = {f"timing.{clock}": control_step_s for clock in clocks} | {
        "trajectory.waypoints_m": [[0.0, 0.0], [leg_m, 0.0]],
        "actuators.yaw_damping_nms": yaw_damping_nms,
    }
    return load_scenario("tracking", num_vehicles=num_vehicles, overrides=overrides)


def drag_n(scenario: Scenario) -> float:
    """Drag at the reference's speed [N]."""
    speed = scenario.trajectory.speed_mps
    return (scenario.vehicle.X_u + scenario.vehicle.X_uu * speed) * speed


def links(places: Float64, neighbour_indices: Int32, gains: BioInspiredGains) -> tuple[Float64, Float64, Float64]:
    """Position of the neighbour [m] of every link, shape (..., vehicle, sector, 2), its weight and slope.

    The force from a neighbour at p is weight p, and changes with p by weight I + slope p p^T. Both [N/m, N/m3] are 0
    without a detection. Eq. 20.
    """
    at = np.take_along_axis(places[..., None, :, :], np.maximum(neighbour_indices, 0)[..., None], axis=-2)
    p = at - places[..., :, None, :]
    distance = np.maximum(np.hypot(p[..., 0], p[..., 1]), MIN_DISTANCE_M)
    value = np.exp(np.minimum(gains.delta_n / distance, MAX_EXPONENT))
    zeta_n = gains.zeta_n * (neighbour_indices >= 0)
    return p, -zeta_n * (value - np.e), zeta_n * value * gains.delta_n / distance**3


def forces(places: Float64, neighbour_indices: Int32, gains: BioInspiredGains) -> Float64:
    """Force of the controller on every vehicle [N], in the leg's frame, shape (..., vehicle, 2). Eq. 18-20."""
    p, weight, _ = links(places, neighbour_indices, gains)
    return -gains.zeta_l * places + (weight[..., None] * p).sum(axis=-2)


def stiffness(places: Float64, neighbour_indices: Int32, gains: BioInspiredGains) -> Float64:
    """Derivative of the forces by the places [N/m], shape (2 vehicle, 2 vehicle), with frozen sets."""
    n, each = len(neighbour_indices), np.arange(len(neighbour_indices))
    p, weight, slope = links(places, neighbour_indices, gains)
    block = weight[..., None, None] * np.eye(2) + slope[..., None, None] * p[..., :, None] * p[..., None, :]
    total = np.zeros((n, n, 2, 2))
    np.add.at(
        total,
        (np.repeat(each, neighbour_indices.shape[1]), np.maximum(neighbour_indices, 0).ravel()),
        block.reshape(-1, 2, 2),
    )
    total[each, each] -= block.sum(axis=1) + gains.zeta_l * np.eye(2)
    return total.transpose(0, 2, 1, 3).reshape(2 * n, 2 * n)


def formations(
    scenario: Scenario, gains: BioInspiredGains, seeds: Sequence[int], rounds: int = ROUNDS
) -> list[Formation]:
    """A formation from each seed's start: relaxed with fresh neighbour sets, then solved with frozen ones.

    Where no balance is found, the relaxed state with the smallest residual of the second half stands for it.
    """
    swarm = Swarm(scenario, len(seeds))
    swarm.reset(list(seeds))
    push = np.array([drag_n(scenario), 0.0])
    places = swarm.state.eta[:, :, :2].copy()
    places -= places.mean(axis=1, keepdims=True) + push / gains.zeta_l
    best, least = places.copy(), np.full(len(seeds), np.inf)
    for k in range(rounds):
        neighbour_indices = _detected_indices(swarm, places)
        p, weight, slope = links(places, neighbour_indices, gains)
        missing = -gains.zeta_l * places + (weight[..., None] * p).sum(axis=-2) - push
        residual = _rms(missing)
        better = (residual < least) & (k >= rounds // 2)
        best[better], least[better] = places[better], residual[better]
        # Each vehicle moves by its own stiffness, so that no gain makes the iteration overshoot.
        stiff = np.abs(weight + slope * (p**2).sum(axis=-1)) + np.abs(weight)
        places = places + 0.5 * missing / (gains.zeta_l + 2.0 * stiff.sum(axis=-1))[..., None]
    sets = _detected_indices(swarm, best)
    solved = np.array([_solve(best[w], sets[w], push, gains) for w in range(len(seeds))])
    same = (_detected_indices(swarm, solved) == sets).all(axis=(1, 2))
    return [
        Formation(solved[w], sets[w], 0.0, True)
        if same[w] and _rms(forces(solved[w], sets[w], gains) - push) < _SETTLED_N
        else Formation(best[w], sets[w], float(least[w]), False)
        for w in range(len(seeds))
    ]


def _detected_indices(swarm: Swarm, places: Float64) -> Int32:
    """Indices of the vehicles detected at these places, headings north, shape (world, vehicle, sector)."""
    swarm.state.eta[:, :, :2], swarm.state.eta[:, :, 2] = places, 0.0
    swarm.observe()
    return swarm.detected_index.copy()


def _rms(force: Float64) -> Float64:
    """Root mean square length over vehicles, shape (...)."""
    return np.sqrt((force**2).sum(axis=-1).mean(axis=-1))


def _solve(places: Float64, neighbour_indices: Int32, push: Float64, gains: BioInspiredGains) -> Float64:
    """Places of balance [m] with frozen sets by Newton's method, within ``_WITHIN_M`` of ``places`` (vehicle, 2).

    ``neighbour_indices`` has shape (vehicle, sector); ``push`` is the force against the drag [N], shape (2,).
    """
    now = places
    for _ in range(_NEWTON_ROUNDS):
        missing = forces(now, neighbour_indices, gains) - push
        # The smallest move that solves it: turning the whole formation about its centre costs nothing.
        move = np.linalg.lstsq(stiffness(now, neighbour_indices, gains), -missing.ravel(), rcond=1e-9)[0].reshape(-1, 2)
        after = now + move * min(1.0, 1.0 / max(float(np.abs(move).max()), 1e-12))
        if np.abs(after - places).max() > _WITHIN_M:
            break
        now = after
    return now
