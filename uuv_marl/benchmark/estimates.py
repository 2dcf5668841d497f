"""Estimates over seeds with bootstrap intervals."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import bootstrap, trim_mean

from uuv_marl.types import Float64

FEWEST = 5
"""Fewest values for which an interval is shown."""
_RESAMPLES = 2000


class Estimate(NamedTuple):
    """A number with its 95 % interval, whose ends are NaN where it is unknown."""

    value: float
    low: float
    high: float

    def __format__(self, spec: str) -> str:
        """``value [low, high]``, or the value alone where the interval is unknown."""
        return f"{self.value:{spec}}" + ("" if np.isnan(self.low) else f" [{self.low:{spec}}, {self.high:{spec}}]")


def interquartile_mean(data: Float64, axis: int = -1) -> Float64:
    """Mean of the middle half of the values along an axis."""
    return np.asarray(trim_mean(data, 0.25, axis=axis), np.float64)


def estimate(
    sample: Sequence[float] | Float64, statistic: Callable[..., Any] = interquartile_mean, fewest: int = 1
) -> Estimate:
    """A statistic with its percentile-bootstrap interval (Agarwal et al. 2021); the same numbers every time.

    Args:
        sample: shape (seed,).
        statistic: from an array and an ``axis``.
        fewest: number of values below which the interval is unknown.
    """
    data = np.asarray(sample, np.float64).ravel()
    value = float(statistic(data, axis=-1))
    if len(data) < fewest:
        return Estimate(value, np.nan, np.nan)
    if len(data) < 2 or np.ptp(data) == 0.0:
        return Estimate(value, value, value)
    resample: Any = bootstrap
    interval = resample(
        (data,), statistic, n_resamples=_RESAMPLES, method="percentile", vectorized=True, rng=np.random.default_rng(0)
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high))
