"""Bootstrap over trainings and maps: every mean is resampled together, so that differences keep what they share."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.types import Float64

RESAMPLES = 2000


class Estimate(NamedTuple):
    """A number and its 95 % interval."""

    point: float
    low: float
    high: float


def resampled(scores: Sequence[Float64], seed: int) -> list[Float64]:
    """Means of trainings over the episodes of a task, in resamples of both.

    Args:
        scores: of each competitor, shape (training, episode); all ran the same episodes.
        seed: of the resamples.

    Returns:
        For each competitor the means of its trainings, shape (1 + resample, training): the first row without
        resampling. Episodes are drawn once for all competitors, trainings for each.
    """
    rng, num = np.random.default_rng(seed), scores[0].shape[1]
    weights = np.concatenate([np.ones((1, num)), rng.multinomial(num, np.full(num, 1.0 / num), RESAMPLES)]) / num
    found: list[Float64] = []
    for own in scores:
        size = len(own)
        drawn = np.concatenate([np.arange(size)[None], rng.integers(size, size=(RESAMPLES, size))])
        found.append(np.take_along_axis(weights @ own.T, drawn, axis=1))
    return found


def estimate(values: Float64) -> Estimate:
    """The first value, and the interval of the others."""
    low, high = np.quantile(values[1:], (0.025, 0.975))
    return Estimate(float(values[0]), float(low), float(high))


def improvement(one: Float64, other: Float64, tie: float) -> Float64:
    """Probability that a training of the one scores higher than one of the other, where a tie counts half.

    Args:
        one: main metrics of shape (resample, training, task).
        other: as ``one``.
        tie: difference up to which two scores are equal.
    """
    gap = one[:, :, None] - other[:, None]
    return ((gap > tie) + 0.5 * (np.abs(gap) <= tie)).mean(axis=(1, 2, 3))
