"""The benchmark's table: interquartile means over seeds with bootstrap intervals, worst seeds, the paper's figures."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.markup import escape
from rich.table import Table as RichTable
from scipy.stats import bootstrap, trim_mean

from uuv_marl.benchmark.paper import PAPER, PaperFigure
from uuv_marl.benchmark.results import Results, Row, knowledge
from uuv_marl.scenario_files import differences

Float64 = NDArray[np.float64]
_CONFIDENCE = 0.95
_RESAMPLES = 2000
_NOTHING = "–"

HEADERS = (
    "policy", "beyond the percept", "arrived", "task time [s]", "worst", "obstacle distance [m]", "worst",
    "spacing [m]", "worst", "mean spacing [m]", "within Eq. 7", "collisions", "paper",
)  # fmt: skip
CAPTION = (
    "Interquartile mean over seeds [95 % bootstrap interval]; worst seed; times over the seeds that arrived. "
    "Obstacle distance: smallest, to the surface; spacing: smallest between two vehicles, and its time mean. "
    "Within Eq. 7: mean share of the time in which all vehicles are within s_l of l(t), keep s_o from obstacles, "
    "and s_u from each other. "
    "SFF and SDC are reconstructions: the paper only names them. Figures of the paper are single runs."
)


class Estimate(NamedTuple):
    """An interquartile mean with its interval."""

    iqm: float
    low: float
    high: float


def estimate(*samples: Sequence[float]) -> Estimate:
    """Interquartile mean and its percentile-bootstrap interval (Agarwal et al. 2021); repeatable.

    Of one sample, such as a value for each seed, or of several together: each is resampled by itself.
    """
    data = [np.asarray(sample, np.float64) for sample in samples]
    whole = float(_iqm(*data))
    if min(map(len, data)) < 2 or all(np.ptp(sample) == 0.0 for sample in data):
        return Estimate(whole, whole, whole)
    resample: Any = bootstrap
    interval = resample(
        tuple(data),
        _iqm,
        confidence_level=_CONFIDENCE,
        n_resamples=_RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(whole, float(interval.low), float(interval.high))


def _iqm(*data: Float64, axis: int = -1) -> Float64:
    return np.asarray(trim_mean(np.concatenate(data, axis=axis), 0.25, axis=axis), np.float64)


def rows_of(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int]) -> list[tuple[str, ...]]:
    """The table's cells, a row for each policy that has runs."""
    rows: list[tuple[str, ...]] = []
    as_in_paper = not differences(results.scenarios[scenario])
    for policy in policies:
        runs = results.select(scenario, policy, seeds)
        if runs:
            rows.append(_cells(policy, runs, PAPER.get((scenario, policy)) if as_in_paper else None))
    return rows


def _cells(policy: str, runs: Sequence[Row], paper: PaperFigure | None) -> tuple[str, ...]:
    times = _values(runs, "task_time_s")
    collisions = _values(runs, "collisions")
    collided = sum(1 for count in collisions if count)
    return (
        policy,
        _knows(policy),
        f"{len(times)}/{len(runs)}",
        *_pair(times, max, 1),
        *_pair(_values(runs, "min_obstacle_distance_m"), min, 2),
        *_pair(_values(runs, "min_spacing_m"), min, 2),
        _pair(_values(runs, "mean_min_spacing_m"), min, 2)[0],
        _shares(runs),
        f"{sum(collisions):.0f} in {collided} seeds" if collided else "0",
        _paper_cell(paper),
    )


def _values(runs: Sequence[Row], name: str) -> list[float]:
    values = [run.metrics[name] for run in runs]
    return [float(value) for value in values if isinstance(value, (int, float))]


def _shares(runs: Sequence[Row]) -> str:
    shares = [run.metrics["constraint_share"] for run in runs]
    means = {
        name: float(np.mean([share[name] for share in shares if isinstance(share, dict)]))
        for name in ("s_l", "s_o", "s_u")
    }
    return ", ".join(f"{name} {mean:.0%}" for name, mean in means.items())


def _pair(values: Sequence[float], worst: Callable[[Sequence[float]], float], digits: int) -> tuple[str, str]:
    if not values:
        return _NOTHING, _NOTHING
    e = estimate(values)
    return f"{e.iqm:.{digits}f} [{e.low:.{digits}f}, {e.high:.{digits}f}]", f"{worst(values):.{digits}f}"


def _knows(policy: str) -> str:
    known = knowledge(policy)
    parts = list(known["channels"])
    if known["yaw_damping_nms"]:
        parts.append(f"yaw damping {known['yaw_damping_nms']:g} N m s")
    return ", ".join(parts) or _NOTHING


def _paper_cell(paper: PaperFigure | None) -> str:
    if paper is None:
        return _NOTHING
    parts: list[str] = []
    if paper.task_time_s is not None:
        parts.append(f"{paper.task_time_s:g} s")
    if paper.min_obstacle_distance_m is not None:
        parts.append("-".join(f"{distance:g}" for distance in paper.min_obstacle_distance_m) + " m")
    if paper.min_spacing_m is not None:
        parts.append(f"spacing {paper.min_spacing_m:g} m, mean {paper.mean_min_spacing_m:g} m")
    return ", ".join(parts)


def rich_table(title: str, rows: Sequence[Sequence[str]]) -> RichTable:
    """For the terminal: the same cells, stacked so that they fit."""
    table = RichTable(title=title, title_justify="left", caption=CAPTION, caption_justify="left", show_lines=True)
    table.add_column("policy\n(beyond the percept)")
    for header in ("arrived", "task time [s]", "obstacle distance [m]", "spacing [m]"):
        table.add_column(escape(header), justify="right")
    table.add_column("within Eq. 7, collisions")
    table.add_column("paper")
    for (
        policy,
        knows,
        arrived,
        time,
        slowest,
        distance,
        nearest,
        spacing,
        closest,
        mean,
        within,
        collisions,
        paper,
    ) in rows:
        cells = (
            policy if knows == _NOTHING else f"{policy}\n({knows})",
            arrived,
            f"{time}\nworst {slowest}",
            f"{distance}\nworst {nearest}",
            f"{spacing}\nworst {closest}\ntime mean {mean}",
            f"{within}\ncollisions: {collisions}",
            paper,
        )
        table.add_row(*map(escape, cells))
    return table


def markdown_table(title: str, rows: Sequence[Sequence[str]]) -> str:
    """For ``table.md``."""
    lines = [f"## {title}", "", "| " + " | ".join(HEADERS) + " |", "|" + " --- |" * len(HEADERS)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"
