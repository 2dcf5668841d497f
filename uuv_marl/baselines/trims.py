"""What changes the law's numbers for one vehicle at one decision: its doubt, and the trims of an actor."""

import math
from typing import Literal, get_args

from uuv_marl.baselines.gains import Gains
from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.memory.doubt import trim_weights
from uuv_marl.baselines.safety import Barrier
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32

Trim = Literal["pull", "together", "push", "behind_m", "steering", "neighbour_m"]
"""A number of a vehicle that an actor may change: one of five gains (``trimmed``), or the distance kept from neighbours
(``widened``)."""
ALL_TRIMS: tuple[Trim, ...] = get_args(Trim)
"""All of them, in the order in which the law takes them."""
TRIMS = len(ALL_TRIMS)
MOST_TRIM = 3.0
"""They are bounded here [1]. Assumed: a factor of 20 is more than any gain should change."""
_TRIM_STEERING, _TRIM_PER_S, _TRIM_M, _TRIM_KEEP_M = 8.0, 0.04, 2.0, 1.0
"""What 1 does: a factor of e^8 on steering, so that a third asks for the tenth that a long lag needs; and what it adds
to ``together`` [1/s], to ``behind_m`` [m] and to the distance kept from neighbours [m]. Assumed: as much as the pull,
the way for which a swarm coasts on, and a share of a hull's length."""


@compiled
def wary(g: Gains, share: float) -> Gains:
    """Gains of a vehicle that doubts: pull and push, changed. ``share``: how much it doubts, 0 to 1."""
    pull, push = math.exp(share * g.pull_in_doubt), math.exp(share * g.push_in_doubt)
    return Gains(
        g.pull * pull, g.push * push, g.push_range, g.pull_at_rest, g.push_at_rest, g.together, g.behind_m, g.steering,
        g.kept_s, g.lead, g.pull_in_doubt, g.push_in_doubt,
    )  # fmt: skip


@compiled
def trimmed(g: Gains, trims: Float32, share: float, lags: float) -> Gains:
    """Gains of one vehicle, changed: pull, push and steering by factors, together and behind_m by sums.

    Steering is never harder than the law's, nor softer than a twentieth of it; pushes are never weaker. ``trims``: of
    pull, together, push, behind_m and steering, 0 changes nothing; ``share`` of them counts, of that of steering
    ``lags``, 0 to 1 each.
    """
    pull, push = share * trims[0], share * max(trims[2], 0.0)
    steering = max(lags * _TRIM_STEERING * min(trims[4], 0.0), -MOST_TRIM)
    together, behind_m = share * _TRIM_PER_S * trims[1], share * _TRIM_M * trims[3]
    return Gains(
        g.pull * math.exp(pull), g.push * math.exp(push), g.push_range, g.pull_at_rest, g.push_at_rest,
        max(g.together + together, 0.0), g.behind_m + behind_m, g.steering * math.exp(steering), g.kept_s, g.lead,
        g.pull_in_doubt, g.push_in_doubt,
    )  # fmt: skip


@compiled
def widened(by: Barrier, trims: Float32, share: float) -> Barrier:
    """The filter of one vehicle, which keeps a larger distance from neighbours.

    The last of ``trims`` is that of the distance, 0 and less change nothing; ``share`` of it counts, 0 to 1.
    """
    keep = by.neighbour_m + share * _TRIM_KEEP_M * max(trims[5], 0.0)
    return Barrier(
        by.obstacle_m, by.gap_share, by.narrowest_m, by.obstacle_rate, keep, by.neighbour_rate, by.noise_margin,
        by.share, by.horizon_m,
    )  # fmt: skip


@compiled
def heeded(worlds: Bool, steering_alone: bool, share: float, kept: Surroundings, out: Bool) -> None:
    """Whose trims count at all: steering where actuators lag, all others where a vehicle doubts.

    ``steering_alone``: whether steering is all that is trimmed; ``share``: of the lag that the law makes up for.
    """
    for w in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[w, i] = False
            if worlds[w] and kept.begun[w, i] > 0.0:
                lags, others = trim_weights(w, i, share, kept)
                out[w, i] = lags > 0.0 or (others > 0.0 and not steering_alone)
