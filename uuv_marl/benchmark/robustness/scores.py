"""Scores of the episodes: success per axis and per group of axes, as means over seeds with intervals.

A seed keeps all its levels and axes together, so that its start and map do not blur the difference between them.
"""

from functools import partial
from typing import Any

import numpy as np

from uuv_marl.benchmark.estimates import FEWEST, Estimate, estimate
from uuv_marl.benchmark.robustness.axes import AXES, CALM
from uuv_marl.benchmark.robustness.job import METRICS
from uuv_marl.types import Float64

ENOUGH = 0.9
"""Success that the pictures mark as passed. Assumed: a usual demand."""
EVERY = "all"
"""The mean over the groups, without the combined axis."""
scored = partial(estimate, statistic=np.mean, fewest=FEWEST)
"""The mean over seeds (seed,) with its interval."""


def by_seed(episodes: Any) -> Any:
    """Success with a row for each scenario, policy and seed, and a column for each axis and level.

    A task's own main metric, in a column after ``METRICS``, takes the place of ``success_share``.
    """
    rows, columns = ["scenario", "policy", "seed"], ["axis", "level"]
    success = episodes["success_share"]
    for name in episodes.columns.difference([*rows, *columns, *METRICS], sort=False):
        success = episodes[name].fillna(success)
    return episodes.assign(success=success).pivot_table("success", rows, columns)


def axis_score(table: Any, axis: str) -> Estimate | None:
    """A policy's mean over the levels of an axis above 0, from its rows of ``by_seed``; None where it was not run."""
    if axis not in table or CALM not in table:
        return None
    both = table[[CALM, axis]].dropna(axis="columns", how="all").dropna()
    return None if axis not in both or both.empty else scored(both[axis].to_numpy().mean(axis=1))


def group_score(table: Any, group: str) -> Estimate | None:
    """A policy's mean over the axes of a group that were run; None where no seed has all of them.

    ``EVERY``: over the groups, but X and those that concern only policies with some channel.
    """
    seeds = _group(table, group)
    return None if seeds is None or np.isnan(seeds).all() else scored(seeds[~np.isnan(seeds)])


def _group(table: Any, group: str) -> Float64 | None:
    """The mean over a group's axes for each seed, NaN where one of its cells is missing; ``EVERY`` over the groups."""
    if group == EVERY:
        usual = dict.fromkeys(axis.group for axis in AXES.values() if not axis.channels)
        parts = [_group(table, name) for name in usual if name != "X"]
        parts_scored = [part for part in parts if part is not None]
        return np.mean(np.stack(parts_scored), axis=0) if parts_scored else None
    axes = [name for name, axis in AXES.items() if axis.group == group and name in table]
    levels = [table[name].dropna(axis="columns", how="all").to_numpy() for name in axes]
    means = [values.mean(axis=1) for values in levels if values.size]
    return np.mean(means, axis=0) if means else None
