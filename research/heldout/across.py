"""Algorithms over training seeds: their runs on each task, and the probability of improvement (Agarwal et al. 2021)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import bootstrap

from research.heldout.episodes import Episode
from research.heldout.sets import FIRST, SETS, HeldOut
from uuv_marl.benchmark.robustness.scores import Score
from uuv_marl.benchmark.tables import FEWEST
from uuv_marl.types import Float64


def success(episodes: Sequence[Episode]) -> float:
    """Share of the episodes that arrive and touch nothing."""
    return float(np.mean([episode.succeeded for episode in episodes]))


def efficiency(episodes: Sequence[Episode]) -> float:
    """Mean of l(t)'s time over the task's, 0 where the swarm does not arrive."""
    return float(np.mean([episode.efficiency for episode in episodes]))


SCORES = {"success": success, "efficiency": efficiency}
"""Scores of a run on a task, from 0 to 1."""


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
        trained: True for its trainings, False for the policy of that name that ships.
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


def overall(scores: Sequence[Sequence[float]]) -> Score:
    """Mean over tasks of the mean over runs: with few tasks a trimmed mean would leave out the hardest.

    The interval is of a bootstrap over runs within each task, repeatable; it is unknown where all tasks have fewer than
    ``FEWEST`` runs together.

    Args:
        scores: of the runs, for each task.
    """
    return _bootstrapped(_mean, scores)


def improvement(mine: Sequence[Sequence[float]], other: Sequence[Sequence[float]]) -> Score:
    """Probability that a run of mine scores higher than one of the other's; a tie counts half.

    The mean over tasks, with an interval as in ``overall`` (Agarwal et al. 2021).

    Args:
        mine: scores of an algorithm's runs, for each task.
        other: the same of another algorithm.
    """
    return _bootstrapped(_higher, [*mine, *other], 2 * FEWEST)


def _bootstrapped(statistic: Any, scores: Sequence[Sequence[float]], fewest: int = FEWEST) -> Score:
    """A statistic of samples with its interval, which is unknown for fewer values in all."""
    samples = [np.asarray(one, np.float64) for one in scores]
    value = float(statistic(*samples))
    if min(map(len, samples)) < 2 or sum(map(len, samples)) < fewest:
        return Score(value, np.nan, np.nan)
    resample: Any = bootstrap
    interval = resample(
        samples, statistic, vectorized=True, n_resamples=2000, method="percentile", rng=np.random.default_rng(0)
    ).confidence_interval
    return Score(value, float(interval.low), float(interval.high))


def _mean(*samples: Float64, axis: int = -1) -> Float64:
    return np.mean([x.mean(axis=axis) for x in samples], axis=0)


def _higher(*samples: Float64, axis: int = -1) -> Float64:  # noqa: ARG001 - scipy names it
    """Of mine and then the other's samples, runs along the last axis."""
    half = len(samples) // 2
    pairs = [(x[..., :, None], y[..., None, :]) for x, y in zip(samples[:half], samples[half:], strict=True)]
    return np.mean([(0.5 + 0.5 * np.sign(x - y)).mean(axis=(-2, -1)) for x, y in pairs], axis=0)
