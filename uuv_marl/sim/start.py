"""Initial states: two groups behind the trajectory's first point, with a guaranteed spacing."""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float64

_TRIES_PER_VEHICLE = 64


def start_state(scenario: Scenario, waypoints: Float64, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """Sample poses eta and velocities nu, shape (vehicle, 3) each, from the scenario's start. Section 5.1.

    The first half of the vehicles, rounded up, forms the port group.
    """
    n, start = scenario.swarm.num_vehicles, scenario.start
    length, width = start.sides(n)
    num_port = (n + 1) // 2
    port = _group(scenario, num_port, rng)
    starboard = _group(scenario, n - num_port, rng)
    along = np.concatenate([port[:, 0], starboard[:, 0]]) - length
    across = np.concatenate([port[:, 1] - start.gap_m / 2 - width, starboard[:, 1] + start.gap_m / 2])
    ahead = (waypoints[1] - waypoints[0]) / np.hypot(*(waypoints[1] - waypoints[0]))
    eta, nu = np.zeros((n, 3)), np.zeros((n, 3))
    eta[:, 0] = waypoints[0, 0] + along * ahead[0] - across * ahead[1]
    eta[:, 1] = waypoints[0, 1] + along * ahead[1] + across * ahead[0]
    eta[:, 2] = rng.uniform(-math.pi, math.pi, n)
    nu[:, 0] = rng.uniform(start.speed_min_mps, start.speed_max_mps, n)
    return eta, nu


def _group(scenario: Scenario, count: int, rng: np.random.Generator) -> Float64:
    """Positions (vehicle, 2) in a rectangle [0, length] x [0, width] [m]: random, or on a lattice if too dense."""
    n, start = scenario.swarm.num_vehicles, scenario.start
    length, width = start.sides(n)
    candidates, placed = np.zeros((count * _TRIES_PER_VEHICLE, 3)), np.empty((count, 3))
    candidates[:, :2] = rng.random((len(candidates), 2)) * (length, width)
    if scatter(candidates, start.spacing_m, placed) == count:
        return placed[:, :2]
    columns, rows, row_m = start.lattice(n)
    row, column = np.divmod(rng.permutation(columns * rows)[:count], columns)
    lattice = np.stack([row * row_m, (column + 0.5 * (row % 2)) * start.spacing_m], axis=1)
    # Slightly wider, so that rounding never brings two vehicles below the spacing.
    return lattice * (1.0 + 1e-12)


@compiled
def scatter(candidates: Float64, gap: float, placed: Float64) -> int:
    """Fill ``placed`` with the discs that keep a gap [m] from all before them; return how many.

    Both arrays have shape (disc, 3): two coordinates and a radius [m], 0 for a point.
    """
    num_placed = 0
    for k in range(candidates.shape[0]):
        if num_placed == placed.shape[0]:
            break
        free = True
        for m in range(num_placed):
            dx, dy = candidates[k, 0] - placed[m, 0], candidates[k, 1] - placed[m, 1]
            near = candidates[k, 2] + placed[m, 2] + gap
            if dx * dx + dy * dy < near * near:
                free = False
                break
        if free:
            for c in range(3):
                placed[num_placed, c] = candidates[k, c]
            num_placed += 1
    return num_placed
