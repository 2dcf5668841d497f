"""Scores of the episodes: success per cell, per axis and per group of axes, and the severity at which it is lost.

Every score is a mean over seeds with a percentile-bootstrap interval over them; a seed brings all its levels and axes
along, so that its start and field do not blur the difference between them. Intervals of fewer than five seeds are NaN.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import bootstrap

from uuv_marl.benchmark.robustness.axes import AXES, CALM
from uuv_marl.types import Float64, Int64

ENOUGH = 0.9
"""Success at which a level still counts as passed. Assumed: a usual demand."""
EVERY = "all"
"""The mean over the groups, without the combined axis."""
_SEEDS = 5
_RESAMPLES = 2000
_ROUNDING = 1e-9


class Score(NamedTuple):
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float

    def __format__(self, spec: str) -> str:
        """``value [low, high]``, or the value alone where the interval is unknown, or nothing at these digits."""
        value, low, high = (f"{number:{spec}}" for number in self)
        return value if np.isnan(self.low) or low == high else f"{value} [{low}, {high}]"


class AxisScore(NamedTuple):
    """How a policy fares on an axis."""

    success: Score
    """Mean over the levels that were run, without level 0."""
    critical: Score
    """Level up to which success is at least ``ENOUGH``, see ``critical_level``."""
    levels: tuple[int, ...]
    """That were run, with level 0."""


def by_seed(episodes: Any) -> Any:
    """Success with a row for each scenario, policy and seed, and a column for each axis and level."""
    return episodes.pivot_table("success_share", ["scenario", "policy", "seed"], ["axis", "level"])


def scored(samples: Float64, statistic: Callable[..., Float64] = np.mean) -> Score:
    """A statistic over seeds with its interval, repeatable.

    Args:
        samples: shape (seed,), or (seed, column) for a statistic of several columns' means.
        statistic: from one array for each column, and ``axis``, over which it goes.
    """
    columns = tuple(samples.reshape(len(samples), -1).T)
    value = float(statistic(*columns, axis=-1))
    if len(samples) < _SEEDS:
        return Score(value, np.nan, np.nan)
    resample: Any = bootstrap
    interval = resample(
        columns, statistic, paired=True, vectorized=True, n_resamples=_RESAMPLES, method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return Score(value, float(interval.low), float(interval.high))


def axis_score(table: Any, axis: str) -> AxisScore | None:
    """A policy's score on an axis from its rows of ``by_seed``; None where it was not run."""
    if axis not in table or CALM not in table:
        return None
    both = table[[CALM, axis]].dropna(axis="columns", how="all").dropna()
    if axis not in both or both.empty:
        return None
    levels = (0, *(int(level) for level in both[axis]))
    calm, rest = both[CALM].to_numpy()[:, 0], both[axis].to_numpy()
    shares = np.column_stack([calm, rest])
    return AxisScore(scored(rest.mean(axis=1)), scored(shares, partial(_critical, levels)), levels)


def _critical(levels: tuple[int, ...], *shares: Float64, axis: int) -> Float64:
    return critical_level(np.stack([share.mean(axis) for share in shares]), levels)


def critical_level(shares: Float64, levels: tuple[int, ...]) -> Float64:
    """The level up to which success stays at ``ENOUGH``, linear between levels.

    Args:
        shares: mean success at each of ``levels``, shape (level, ...).
        levels: level 0 and those above it that were run.

    Returns:
        Shape (...): -1 where level 0 is below already, and one more than the last level where none is.
    """
    below = shares < ENOUGH - _ROUNDING
    k: Int64 = np.where(below.any(axis=0), np.argmax(below, axis=0), len(levels))
    high = np.clip(k, 1, len(levels) - 1)[None]
    s_low, s_high = (np.take_along_axis(shares, j, 0)[0] for j in (high - 1, high))
    at = np.array(levels, np.float64)
    step = np.clip((s_low - ENOUGH) / np.where(s_low > s_high, s_low - s_high, 1.0), 0.0, 1.0)
    between: Float64 = at[high - 1][0] + step * (at[high] - at[high - 1])[0]
    return np.select(
        [k == 0, k == len(levels)], [np.full_like(between, -1.0), np.full_like(between, at[-1] + 1.0)], between
    )


def critical_text(axis: str, score: AxisScore) -> str:
    """The critical severity in the axis's unit, as a table shows it."""
    levels, one = score.levels, AXES[axis]
    places = [0 if level == 0 else 1 + one.levels.index(level) for level in levels]
    labels, severity = [one.labels[k] for k in places], np.array([one.severity[k] for k in places])

    def text(level: float) -> str:
        if level < 0.0:
            return "fails undisturbed"
        if level > levels[-1]:
            return f"beyond {labels[-1]}"
        k = max(int(np.searchsorted(levels, level)), 1)
        if np.isfinite(severity[k - 1 : k + 1]).all():
            return f"{np.interp(level, levels[k - 1 : k + 1], severity[k - 1 : k + 1]):.3g}"
        return labels[levels.index(int(level))] if level in levels else f"between {labels[k - 1]} and {labels[k]}"

    low, high = (text(level) for level in score.critical[1:]) if not np.isnan(score.critical.low) else ("", "")
    value = text(score.critical.value)
    return value if low == high else f"{value} [{low}, {high}]"


def group_score(table: Any, group: str) -> Score | None:
    """A policy's mean over the axes of a group that were run; None for none.

    ``EVERY``: over the groups, but X and those that concern only policies with some channel.
    """
    seeds = _group(table, group)
    return None if seeds is None else scored(seeds[~np.isnan(seeds)])


def _group(table: Any, group: str) -> Float64 | None:
    """The mean over a group's axes for each seed, NaN where one of its cells is missing; ``EVERY`` over the groups."""
    if group == EVERY:
        usual = dict.fromkeys(axis.group for axis in AXES.values() if not axis.channels)
        parts = [_group(table, name) for name in usual if name != "X"]
        parts_scored = [part for part in parts if part is not None]
        return np.mean(np.stack(parts_scored), axis=0) if parts_scored else None
    axes = [name for name, axis in AXES.items() if axis.group == group and name in table]
    whole = [table[name].dropna(axis="columns", how="all").to_numpy() for name in axes]
    means = [values.mean(axis=1) for values in whole if values.size]
    return np.mean(means, axis=0) if means else None
