"""How far what a vehicle meets is from what its model and its sonar should give: 0 in still water with exact echoes."""

from uuv_marl.baselines.memory.neighbours import age_of, noise_of
from uuv_marl.baselines.memory.response import remains
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

FULL_SHORTFALL = 0.4
"""Where so much remains of what is asked of thrust or torque, a vehicle doubts all [1]. Assumed."""
NOISE = 0.02
"""So large errors of neighbours' places over their range do the same [1]. Assumed: those of 2 degrees. Exact echoes
make none, but at slow decisions, when neighbours are not where they were expected."""
USUAL_AGE_S, OLD_S = 0.15, 0.2
"""So old are readings on the mean where nothing is wrong; so much more does the same [s]. In still water 95 % of the
means are below 0.12 s, of neighbours that are heard no more and kept for a while; the second number is assumed."""


@compiled
def uncertainty(w: int, i: int, memory: Surroundings) -> float:
    """How much a vehicle doubts: from 0, all is as expected, to 1."""
    old = max(age_of(w, i, memory) - USUAL_AGE_S, 0.0)
    moves = max(remains(w, i, 0, memory), remains(w, i, 1, memory)) / FULL_SHORTFALL
    return min(moves + noise_of(w, i, memory) / NOISE + old / OLD_S, 1.0)
