"""Cells of a box that active arrays cover, for a reward for searching it."""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float64

CELL_M = 25.0
"""Side of a cell [m]. Assumed: a quarter of the bow's range."""
FORGET_S = 100.0
"""Time after which a covered cell counts in full again [s]. Assumed: a target moves farther than an array's range."""


def num_cells(side_m: float) -> int:
    """Number of cells of a box with this side [m]."""
    return math.ceil(side_m / CELL_M) ** 2


def fans(scenario: Scenario) -> Float64:
    """Active arrays, shape (array, 3): direction from the bow [rad], range [m], cosine of half the aperture [1]."""
    active = [array for array in scenario.sonar.arrays if array.kind == "active"]
    each = [(math.radians(a.mounting_deg), a.range_m, math.cos(math.radians(0.5 * a.aperture_deg))) for a in active]
    return np.array(each, np.float64).reshape(len(each), 3)


@compiled
def cover(
    worlds: Bool, time_s: Float64, half: float, fan: Float64, eta: Float64, alive: Bool, covered_s: Float64,
    newly: Float64,
) -> None:  # fmt: skip
    """Note when cells were last covered, and count those that each vehicle covers.

    A cell that any vehicle covered t seconds before counts min(t, FORGET_S) / FORGET_S.

    Args:
        worlds: to be updated, shape (world,).
        time_s: since the reset [s], shape (world,).
        half: of the box's side [m].
        fan: see ``fans``.
        eta: positions [m] and headings [rad], shape (world, vehicle, 3).
        alive: vehicles that count, shape (world, vehicle).
        covered_s: when each cell was last covered [s], shape (world, cell); changed.
        newly: number of cells, shape (world, vehicle); changed.
    """
    side = math.ceil(2.0 * half / CELL_M)
    for w in range(eta.shape[0] if fan.shape[0] else 0):
        for i in range(eta.shape[1] if worlds[w] else 0):
            newly[w, i] = 0.0
            for k in range(fan.shape[0] if alive[w, i] else 0):
                x, y, reach = eta[w, i, 0] + half, eta[w, i, 1] + half, fan[k, 1]
                c, s = cos_sin(eta[w, i, 2] + fan[k, 0])
                for a in range(max(0, int((x - reach) / CELL_M)), min(side, int((x + reach) / CELL_M) + 1)):
                    for b in range(max(0, int((y - reach) / CELL_M)), min(side, int((y + reach) / CELL_M) + 1)):
                        d_x, d_y = (a + 0.5) * CELL_M - x, (b + 0.5) * CELL_M - y
                        r = math.sqrt(d_x * d_x + d_y * d_y)
                        if r <= reach and d_x * c + d_y * s >= fan[k, 2] * r:
                            cell = a * side + b
                            newly[w, i] += min(time_s[w] - covered_s[w, cell], FORGET_S) / FORGET_S
                            covered_s[w, cell] = time_s[w]
