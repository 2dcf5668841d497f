"""What changes the law's numbers for one vehicle at one decision: its doubt, and the trim of an actor."""

import math
from typing import Literal, get_args

from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.memory.doubt import trim_weights
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool

Trim = Literal["steering"]
"""A gain of a vehicle that an actor may change."""
ALL_TRIMS: tuple[Trim] = get_args(Trim)
MOST_TRIM = 3.0
"""Trims are bounded here [1]. Assumed: a factor of 20 is more than any gain should change."""
_TRIM_STEERING = 8.0
"""What 1 does: a factor of e^8 on steering, so that a third asks for the tenth that a long lag needs."""


@compiled
def wary(g: ScoutGains, share: float) -> ScoutGains:
    """Gains of a vehicle that doubts: pull and push, changed. ``share``: how much it doubts, 0 to 1."""
    pull, push = math.exp(share * g.pull_in_doubt), math.exp(share * g.push_in_doubt)
    return ScoutGains(
        g.pull * pull, g.push * push, g.push_range, g.pull_at_rest, g.push_at_rest, g.together, g.behind_m, g.steering,
        g.kept_s, g.lead, g.pull_in_doubt, g.push_in_doubt,
    )  # fmt: skip


@compiled
def softened(g: ScoutGains, trim: float, lags: float) -> ScoutGains:
    """Gains of a vehicle whose steering is trimmed: never harder than the law's, nor softer than a twentieth of it.

    A ``trim`` of 0 and more changes nothing; the share ``lags`` of it counts, 0 to 1.
    """
    steering = max(lags * _TRIM_STEERING * min(trim, 0.0), -MOST_TRIM)
    return ScoutGains(
        g.pull, g.push, g.push_range, g.pull_at_rest, g.push_at_rest, g.together, g.behind_m,
        g.steering * math.exp(steering), g.kept_s, g.lead, g.pull_in_doubt, g.push_in_doubt,
    )  # fmt: skip


@compiled
def heeded(worlds: Bool, share: float, kept: Surroundings, out: Bool) -> None:
    """Whose trims count at all: those of vehicles whose actuators lag.

    ``share``: of the lag that the law makes up for.
    """
    for w in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[w, i] = worlds[w] and kept.begun[w, i] > 0.0 and trim_weights(w, i, share, kept)[0] > 0.0
