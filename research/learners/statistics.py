"""Rliable's estimates (Agarwal et al. 2021), with types, and the same numbers every time."""

# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownLambdaType=false
# It lives in the environment of ``make test-benchmarl``.

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from rliable.library import create_performance_profile, get_interval_estimates
from rliable.metrics import aggregate_iqm, aggregate_mean, probability_of_improvement

from uuv_marl.types import Float64

_RESAMPLES, _OF_PAIRS, _OF_PROFILES = 2000, 500, 1000


class Estimate(NamedTuple):
    """A number and its 95 % interval, by a bootstrap over trainings, stratified by task."""

    point: float
    low: float
    high: float


def mean(scores: Float64) -> Estimate:
    """Over trainings and tasks, ``scores`` (training, task)."""
    return _aggregated(scores, aggregate_mean)


def interquartile_mean(scores: Float64) -> Estimate:
    """The same of the middle half of the scores."""
    return _aggregated(scores, aggregate_iqm)


def _aggregated(scores: Float64, aggregate: Callable[[Float64], float]) -> Estimate:
    with _seeded():
        return _estimate(*get_interval_estimates({"": scores}, lambda x: np.array([aggregate(x)]), reps=_RESAMPLES))


def improvement(one: Float64, other: Float64) -> Estimate:
    """Probability that a training of the one scores higher than one of the other; both (training, task)."""
    with _seeded():
        return _estimate(
            *get_interval_estimates(
                {"": [one, other]}, lambda x, y: np.array([probability_of_improvement(x, y)]), reps=_OF_PAIRS
            )
        )


def profiles(scores: Mapping[str, Float64], levels: Float64) -> dict[str, Float64]:
    """Share of the scores (training, task) above each level, and its interval: shape (3, level), by learner."""
    with _seeded():
        profile, ends = create_performance_profile(dict(scores), levels, reps=_OF_PROFILES)
    return {name: np.stack([profile[name], *ends[name]]) for name in scores}


def _estimate(points: Mapping[str, Float64], ends: Mapping[str, Float64]) -> Estimate:
    return Estimate(float(points[""][0]), float(ends[""][0, 0]), float(ends[""][1, 0]))


@contextmanager
def _seeded() -> Generator[None]:
    """Rliable draws from NumPy's global generator, which is as before afterwards."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002
