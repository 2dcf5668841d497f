"""Algorithms over training seeds: interquartile means with stratified bootstrap intervals (Agarwal et al. 2021)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, trim_mean

from uuv_marl.benchmark.tables import Estimate
from uuv_marl.heldout.episodes import Episode

Float64 = NDArray[np.float64]
_RESAMPLES = 2000


def success(episodes: Sequence[Episode]) -> float:
    """Share of the episodes that arrive and touch nothing."""
    return float(np.mean([episode.succeeded for episode in episodes]))


def efficiency(episodes: Sequence[Episode]) -> float:
    """Mean of l(t)'s time over the task's, 0 where the swarm does not arrive."""
    return float(np.mean([0.0 if e.task_time_s is None else e.duration_s / e.task_time_s for e in episodes]))


SCORES = {"success": success, "efficiency": efficiency}
"""Of a run on a task, from 0 to 1."""


def stratified(tasks: Sequence[Sequence[float]]) -> Estimate:
    """Interquartile mean over all runs of all tasks, runs resampled within each task; a score for each run."""
    data = [np.asarray(scores, np.float64) for scores in tasks]
    whole = _iqm(*data)
    if min(len(scores) for scores in data) < 2 or all(np.ptp(scores) == 0.0 for scores in data):
        return Estimate(whole, whole, whole)
    resample: Any = bootstrap
    interval = resample(
        tuple(data),
        _iqm,
        vectorized=False,
        n_resamples=_RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(whole, float(interval.low), float(interval.high))


def _iqm(*tasks: Float64) -> float:
    return float(trim_mean(np.concatenate(tasks), 0.25))
