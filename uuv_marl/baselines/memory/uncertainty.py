"""Deviation of motion and sonar from a vehicle's model: 0 in still water with exact echoes."""

from uuv_marl.baselines.memory.neighbours import age_of, noise_of
from uuv_marl.baselines.memory.response import remains
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

FULL_SHORTFALL = 0.4  # remaining share of a demand on thrust or torque that means full uncertainty [1]. Assumed.
NOISE = 0.02
"""Position errors of neighbours over range that mean the same [1]. Assumed: those of 2 degrees. Exact echoes cause
errors only at long decision periods, when neighbours are not where they were predicted."""
USUAL_AGE_S, OLD_S = 0.15, 0.2
"""Mean age of readings in ideal conditions, and the excess that means full uncertainty [s]. In still water 95 % of the
means are below 0.12 s, from remembered neighbours; the second number is assumed."""


@compiled
def uncertainty(w: int, i: int, memory: Surroundings) -> float:
    """Uncertainty of a vehicle, from 0 (all as predicted) to 1."""
    old = max(age_of(w, i, memory) - USUAL_AGE_S, 0.0)
    moves = max(remains(w, i, 0, memory), remains(w, i, 1, memory)) / FULL_SHORTFALL
    return min(moves + noise_of(w, i, memory) / NOISE + old / OLD_S, 1.0)
