"""Algorithms over training seeds: interquartile means with stratified bootstrap intervals (Agarwal et al. 2021)."""

from collections.abc import Sequence

import numpy as np

from uuv_marl.studies.heldout.episodes import Episode
from uuv_marl.studies.heldout.sets import FIRST, SETS, HeldOut


def success(episodes: Sequence[Episode]) -> float:
    """Share of the episodes that arrive and touch nothing."""
    return float(np.mean([episode.succeeded for episode in episodes]))


def efficiency(episodes: Sequence[Episode]) -> float:
    """Mean of l(t)'s time over the task's, 0 where the swarm does not arrive."""
    return float(np.mean([episode.efficiency for episode in episodes]))


SCORES = {"success": success, "efficiency": efficiency}
"""Of a run on a task, from 0 to 1."""


def tasks(episodes: Sequence[Episode]) -> list[HeldOut]:
    """The tasks of the comparison on which trainings were run."""
    trained = {e.set for e in episodes if e.training_seed is not None}
    return [held for held in SETS if held.across and held.name in trained]


def runs(episodes: Sequence[Episode], held: HeldOut, policy: str, trained: bool) -> list[list[Episode]]:
    """A policy's episodes of a task, a list for each training; a policy that ships counts as one.

    Args:
        episodes: of all sets and policies.
        held: the task; seeds beyond its first ``across`` are left out.
        policy: its name.
        trained: whether its trainings are meant, not the policy of that name that ships.
    """
    found: dict[int | None, list[Episode]] = {}
    for e in episodes:
        if (e.set, e.policy, e.training_seed is not None) == (
            held.name,
            policy,
            trained,
        ) and e.seed < FIRST + held.across:
            found.setdefault(e.training_seed, []).append(e)
    return list(found.values())
