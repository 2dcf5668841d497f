"""What the strongest policies should reach, set before they were run on these seeds, and whether they do."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from research.heldout.episodes import ByPolicy, Episode, measured
from research.heldout.sets import LEADING, SETS, HeldOut
from uuv_marl.benchmark.robustness.scores import Score, scored

_TUNED = "bio_inspired_plus"
"""The policy whose effort is the measure on the paper's scenarios."""
_RIVALS = "scout", "scout_plus", "mappo"
"""Whose task times are the measure on random fields: the strongest laws, and the learned policy of version 0.1.0."""
_PAPERS_BEST_M = 12.63
"""The paper's largest distance to an obstacle, Table 2."""
_SPACING_M = 6.0
_ARRIVED = 0.99
_COLLIDED = 0.005
_SLOWER = 1.005
_MANY = 1000
"""Episodes from which a share of collisions is demanded instead of none."""


class Target(NamedTuple):
    """One demand on a policy on one set."""

    set: str
    policy: str
    kind: str
    """What it is about."""
    demand: str
    measured: str
    met: bool


def targets(episodes: Sequence[Episode]) -> list[Target]:
    """All demands on the policies of ``LEADING`` that the episodes can answer."""
    found: list[Target] = []
    by_policy = ByPolicy(episodes)
    for held in (held for held in SETS if held.aimed):
        tuned = by_policy.select(held.name, _TUNED)
        runs = {policy: mine for policy in LEADING if (mine := by_policy.select(held.name, policy))}
        for policy, mine in runs.items():
            rivals = {name: runs[name] for name in _RIVALS if name in runs and name != policy}
            found += [Target(held.name, policy, *demand) for demand in _demands(held, mine, rivals, tuned)]
    return found


def _demands(
    held: HeldOut, mine: Sequence[Episode], rivals: dict[str, list[Episode]], tuned: Sequence[Episode]
) -> Iterator[tuple[str, str, str, bool]]:
    """The kind, what is demanded, what was measured, and whether that will do."""
    count = len(mine)
    collided, arrived = sum(e.collisions > 0 for e in mine), sum(e.arrived for e in mine)
    if count < _MANY:
        yield "collisions", "no collision", f"in {collided} of {count}", collided == 0
    else:
        bound, demand = upper_bound(collided, count), f"share of episodes with a collision surely below {_COLLIDED:.1%}"
        yield "collisions", demand, f"{collided} of {count}: below {bound:.2%}", bound < _COLLIDED
    yield "arrival", f"at least {_ARRIVED:.0%} arrive", f"{arrived} of {count}", arrived >= _ARRIVED * count
    if count >= _MANY:
        for name, other in rivals.items():
            extra, demand = later(mine, other), f"mean time, or limit, at most that of `{name}`"
            yield "time", demand, f"{extra:+.1f} s", extra.value <= 0.0
    if held.scenario in ("tracking", "single_obstacle", "multi_obstacle"):
        yield from _papers(mine)
        if tuned:
            extra, demand = harder(mine, tuned), f"mean effort at most that of `{_TUNED}`"
            yield "effort", demand, f"{extra:+.3f}", extra.value <= 0.0


def _papers(mine: Sequence[Episode]) -> Iterator[tuple[str, str, str, bool]]:
    """What is demanded on the paper's scenarios."""
    share = float(np.mean([e.time_s / e.duration_s for e in mine]))
    yield "time", f"mean time at most that of l(t) + {_SLOWER - 1:.1%}", f"{share - 1:+.1%}", share <= _SLOWER
    for what, least in (("obstacle_distance", _PAPERS_BEST_M), ("spacing", _SPACING_M)):
        if found := measured(mine, f"min_{what}_m"):
            kind = what.replace("_", " ")
            yield kind, f"worst {kind} at least {least:g} m", f"{min(found):.2f} m", min(found) >= least


def upper_bound(count: int, episodes: int) -> float:
    """The share that is exceeded with a probability of 5 % at most, where so many of the episodes count (exact)."""
    return float(binomtest(count, episodes).proportion_ci(confidence_level=0.9, method="exact").high)


def later(mine: Sequence[Episode], other: Sequence[Episode]) -> Score:
    """How much later mine arrive [s], on the seeds that both have; who does not arrive takes the time limit."""
    return _more(mine, other, lambda e: e.time_s)


def harder(mine: Sequence[Episode], other: Sequence[Episode]) -> Score:
    """By how much the effort of mine is larger [1], on the seeds that both have."""
    return _more(mine, other, lambda e: e.effort)


def _more(mine: Sequence[Episode], other: Sequence[Episode], value: Callable[[Episode], float]) -> Score:
    theirs = {e.seed: value(e) for e in other}
    return scored(np.array([value(e) - theirs[e.seed] for e in mine if e.seed in theirs]))
