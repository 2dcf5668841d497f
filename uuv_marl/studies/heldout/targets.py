"""What a learned policy should reach, set before it was trained, and whether it does."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.studies.heldout.episodes import Episode, measured, select
from uuv_marl.studies.heldout.sets import SETS, HeldOut

RIVAL = "bio_inspired_plus"
"""The strongest hand-made law."""
_PAPERS_BEST_M = 12.63
"""The paper's largest distance to an obstacle, Table 2."""
_OTHER_SIZES_M = 10.0
_SPACING_M = 6.0
_ARRIVED = 0.99
_SLOWER = 1.01


class Target(NamedTuple):
    """One demand on one set."""

    set: str
    kind: str
    """What it is about."""
    demand: str
    measured: str
    met: bool


def targets(episodes: Sequence[Episode], policy: str) -> list[Target]:
    """All that apply to sets with episodes of the policy and its rival."""
    found = ((held, *(select(episodes, held.name, name) for name in (policy, RIVAL))) for held in SETS)
    return [
        Target(held.name, *demand)
        for held, mine, rival in found
        if mine and rival
        for demand in _demands(held, mine, rival)
    ]


def _demands(held: HeldOut, mine: Sequence[Episode], rival: Sequence[Episode]) -> Iterator[tuple[str, str, str, bool]]:
    """The kind, what is demanded, what was measured, and whether that will do."""
    collided, arrived = sum(e.collisions > 0 for e in mine), sum(e.arrived for e in mine)
    yield "collisions", "no collision", f"in {collided} of {len(mine)} episodes", collided == 0
    if held.scenario == "random_field":
        share, extra = arrived / len(mine), paired(mine, rival)
        yield "arrival", f"at least {_ARRIVED:.0%} arrive", f"{share:.1%}", share >= _ARRIVED
        demand, mean = f"mean time no longer than {RIVAL}'s where both arrive", _mean(extra)
        yield "time", demand, f"{mean:+.1f} s over {len(extra)} episodes", mean <= 0.0
    elif held.scenario != "lossy":
        ours, theirs = (_mean(measured(found, "task_time_s")) for found in (mine, rival))
        words = f"{ours:.1f} s against {theirs:.1f} s, {arrived} of {len(mine)} arrive"
        met = ours <= _SLOWER * theirs and arrived == len(mine)
        yield "arrival and time", f"all arrive, mean time at most {RIVAL}'s + 1 %", words, met
        clear = _OTHER_SIZES_M if "swarm.num_vehicles" in held.overrides else _PAPERS_BEST_M
        for what, least in (("obstacle_distance", clear), ("spacing", _SPACING_M)):
            if found := measured(mine, f"min_{what}_m"):
                kind = what.replace("_", " ")
                yield kind, f"worst {kind} at least {least:g} m", f"{min(found):.2f} m", min(found) >= least


def paired(mine: Sequence[Episode], rival: Sequence[Episode]) -> list[float]:
    """Task times less the rival's on the seeds where both arrive [s]."""
    other = {e.seed: e.task_time_s for e in rival if e.task_time_s is not None}
    return [e.task_time_s - other[e.seed] for e in mine if e.task_time_s is not None and e.seed in other]


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
