"""How far what a vehicle meets is from what its model and its sonar should give: 0 in still water with exact echoes."""

from uuv_marl.baselines.memory.neighbours import age_of, noise_of
from uuv_marl.baselines.memory.response import remains
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

REMAINS = 0.4
"""Where so much remains of what is asked of thrust or torque, a vehicle doubts all [1]. Assumed."""
NOISE = 0.02
"""So large errors of neighbours' places over their range do the same [1]. Assumed: those of 2 degrees. Exact echoes
make none, but at slow decisions, when neighbours are not where they were expected."""
UNSURE = 0.03
"""Up to so large errors a vehicle that makes up for its lag is trimmed for it in full, from twice as large ones not at
all [1]. Assumed: vehicles that swing with a lag of 1.5 s make 0.02 themselves; 2 degrees and pings every 0.5 s 0.06."""
USUAL_AGE_S, OLD_S = 0.15, 0.2
"""So old are readings on the mean where nothing is wrong; so much more does the same [s]. In still water 95 % of the
means are below 0.12 s, of neighbours that are heard no more and kept for a while; the second number is assumed."""


@compiled
def doubt(w: int, i: int, kept: Surroundings) -> tuple[float, float]:
    """Whether its actuators lag, and of all: from 0, as expected, to 1.

    A lag delays thrust and torque, a fault or little authority touches one of them.
    """
    old = max(age_of(w, i, kept) - USUAL_AGE_S, 0.0)
    thrust, torque = remains(w, i, 0, kept), remains(w, i, 1, kept)
    moves = max(thrust, torque) / REMAINS
    return min(thrust, torque), min(moves + noise_of(w, i, kept) / NOISE + old / OLD_S, 1.0)


@compiled
def trim_weights(w: int, i: int, lead: float, kept: Surroundings) -> tuple[float, float]:
    """How far trims count, 0 to 1: that of steering, and all others. They are ``doubt``'s, with one exception.

    Soft steering bears a lag, but lets vehicles touch that do not know well where the others are. So where a law makes
    up for the lag itself, the trim of steering counts the less, the less well neighbours are heard. ``lead``: share of
    the lag that is made up for.
    """
    lags, share = doubt(w, i, kept)
    if lead > 0.0:
        lags *= min(max(2.0 - noise_of(w, i, kept) / UNSURE, 0.0), 1.0)
    return lags, share
