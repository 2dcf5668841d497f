"""What a learned policy should reach, set before it was trained, and whether it does."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.studies.heldout.episodes import Episode
from uuv_marl.studies.heldout.sets import SETS

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
    demand: str
    measured: str
    met: bool


def targets(episodes: Sequence[Episode], policy: str) -> list[Target]:
    """All that apply to sets with episodes of the policy and its rival."""
    found: list[Target] = []
    for held in SETS:
        mine = of(episodes, held.name, policy)
        rival = of(episodes, held.name, RIVAL)
        if mine and rival:
            found.append(_no_collision(held.name, mine))
            if held.scenario == "random_field":
                found += [_arrival(held.name, mine), _no_slower(held.name, mine, rival)]
            elif held.scenario != "lossy":
                clear = _OTHER_SIZES_M if "swarm.num_vehicles" in held.overrides else _PAPERS_BEST_M
                found += [_time(held.name, mine, rival), *_distances(held.name, mine, clear)]
    return found


def of(episodes: Sequence[Episode], name: str, policy: str) -> list[Episode]:
    """A shipped policy's episodes of a set, by seed."""
    mine = [e for e in episodes if (e.set, e.policy, e.training_seed) == (name, policy, None)]
    return sorted(mine, key=lambda e: e.seed)


def _no_collision(name: str, mine: Sequence[Episode]) -> Target:
    collided = sum(e.collisions > 0 for e in mine)
    return Target(name, "no collision", f"in {collided} of {len(mine)} episodes", collided == 0)


def _arrival(name: str, mine: Sequence[Episode]) -> Target:
    share = float(np.mean([e.task_time_s is not None for e in mine]))
    return Target(name, f"at least {_ARRIVED:.0%} arrive", f"{share:.1%}", share >= _ARRIVED)


def _no_slower(name: str, mine: Sequence[Episode], rival: Sequence[Episode]) -> Target:
    extra = paired(mine, rival)
    mean = float(np.mean(extra)) if extra else float("nan")
    measured = f"{mean:+.1f} s over {len(extra)} episodes"
    return Target(name, f"mean time no longer than {RIVAL}'s where both arrive", measured, mean <= 0.0)


def _time(name: str, mine: Sequence[Episode], rival: Sequence[Episode]) -> Target:
    ours, theirs = _mean_time(mine), _mean_time(rival)
    met = ours <= _SLOWER * theirs and all(e.task_time_s is not None for e in mine)
    arrived = sum(e.task_time_s is not None for e in mine)
    measured = f"{ours:.1f} s against {theirs:.1f} s, {arrived} of {len(mine)} arrive"
    return Target(name, f"all arrive, mean time at most {RIVAL}'s + 1 %", measured, met)


def _distances(name: str, mine: Sequence[Episode], clear: float) -> list[Target]:
    found: list[Target] = []
    obstacle = [e.min_obstacle_distance_m for e in mine if e.min_obstacle_distance_m is not None]
    if obstacle:
        worst = min(obstacle)
        found.append(Target(name, f"worst obstacle distance at least {clear:g} m", f"{worst:.2f} m", worst >= clear))
    spacing = min(e.min_spacing_m for e in mine if e.min_spacing_m is not None)
    found.append(Target(name, f"worst spacing at least {_SPACING_M:g} m", f"{spacing:.2f} m", spacing >= _SPACING_M))
    return found


def paired(mine: Sequence[Episode], rival: Sequence[Episode]) -> list[float]:
    """Task times less the rival's on the seeds where both arrive [s]."""
    other = {e.seed: e.task_time_s for e in rival}
    return [
        e.task_time_s - other[e.seed]  # pyright: ignore[reportOperatorIssue] - both are there
        for e in mine
        if e.task_time_s is not None and other.get(e.seed) is not None
    ]


def _mean_time(episodes: Sequence[Episode]) -> float:
    times = [e.task_time_s for e in episodes if e.task_time_s is not None]
    return float(np.mean(times)) if times else float("nan")
