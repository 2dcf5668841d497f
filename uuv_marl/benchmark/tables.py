"""The benchmark's table: interquartile means over seeds with bootstrap intervals, worst seeds, the paper's figures."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from rich.markup import escape
from rich.table import Table as RichTable
from scipy.stats import bootstrap, trim_mean

from uuv_marl.baselines.making import with_requirements
from uuv_marl.baselines.names import parse_name
from uuv_marl.benchmark.paper import PAPER, PaperFigure
from uuv_marl.benchmark.results import PolicyInfo, ResultRow, Results, requirements_of
from uuv_marl.scenario import Scenario, differences
from uuv_marl.tasks import Task
from uuv_marl.types import Float64

_CONFIDENCE = 0.95
_RESAMPLES = 2000
_NOTHING = "–"

FEWEST = 5
"""Fewest values for an interval: of fewer the bootstrap tells nothing."""
_NARROW = 110
"""Columns of a terminal below which its table leaves out intervals and the time mean."""

HEADERS = (
    "policy", "class, and beyond sonar", "arrived", "task time [s]", "worst", "obstacle distance [m]", "worst",
    "spacing [m]", "worst", "mean spacing [m]", "within Eq. 7", "collisions", "paper",
)  # fmt: skip


class TableRow(NamedTuple):
    """A row of the table, a text for each of ``HEADERS``; estimates as ``mean [low, high]``."""

    policy: str
    requirements: str
    arrived: str
    time: str
    slowest: str
    distance: str
    nearest: str
    spacing: str
    closest: str
    mean: str
    within: str
    collisions: str
    paper: str


CAPTION = (
    "Interquartile mean over seeds [95 % bootstrap interval]; worst seed; times over the seeds that arrived. "
    "Arrived is the paper's success: the whole swarm rests at the end, or where arrival.criterion = passage has "
    "passed it, whether it touched anything or not. "
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

    def __format__(self, spec: str) -> str:
        """``mean [low, high]``, each number as ``spec`` says."""
        return f"{self.iqm:{spec}} [{self.low:{spec}}, {self.high:{spec}}]"


def estimate(sample: Sequence[float]) -> Estimate:
    """Interquartile mean and its percentile-bootstrap interval (Agarwal et al. 2021); repeatable."""
    data = np.asarray(sample, np.float64)
    whole = float(_iqm(data))
    if len(data) < 2 or np.ptp(data) == 0.0:
        return Estimate(whole, whole, whole)
    resample: Any = bootstrap
    interval = resample(
        (data,),
        _iqm,
        confidence_level=_CONFIDENCE,
        n_resamples=_RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(whole, float(interval.low), float(interval.high))


def _iqm(data: Float64, axis: int = -1) -> Float64:
    return np.asarray(trim_mean(data, 0.25, axis=axis), np.float64)


def estimate_text(sample: Sequence[float], spec: str) -> str:
    """An estimate as text, each number as ``spec`` says: without interval for few values, a dash for none."""
    if not sample:
        return _NOTHING
    e = estimate(sample)
    return f"{e:{spec}}" if len(sample) >= FEWEST else f"{e.iqm:{spec}}"


def table_rows(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int]) -> list[TableRow]:
    """The table's cells, a row for each policy that has runs.

    Args:
        results: with the runs.
        scenario: its name.
        policies: their names, in the order of the rows.
        seeds: whose runs count.
    """
    rows: list[TableRow] = []
    loaded = results.scenarios[scenario]
    as_in_paper = not differences(loaded)
    for policy in policies:
        runs = results.select(scenario, policy, seeds)
        if runs:
            paper = PAPER.get((scenario, policy)) if as_in_paper else None
            known = results.policies[policy]
            requirements = _requirements_text(loaded, policy, known)
            rows.append(_cells(policy, requirements, runs, paper))
    return rows


def task_headers(task: type[Task]) -> tuple[str, ...]:
    """Columns of the table of a task other than ``follow``."""
    return (
        "policy", "class, and beyond sonar", "whole swarms", "untouched and there", *task.columns,
        "obstacle distance [m]", "worst", "spacing [m]", "worst", "collisions",
    )  # fmt: skip


_TASK_CAPTION = (
    "Interquartile mean over seeds [95 % bootstrap interval]; worst seed. Whole swarms: episodes in which every "
    "vehicle succeeded; a vehicle succeeds that is where the task wants it when the episode ends, and has touched "
    "nothing. Untouched and there: mean share of such vehicles. Obstacle distance: smallest, to the surface; spacing: "
    "smallest between two vehicles."
)


def task_caption(task: type[Task]) -> str:
    """What the columns of ``task_headers`` are."""
    own = "".join(f" {name}: {meaning}." for name, meaning in task.columns.items())
    return _TASK_CAPTION + own


def task_rows(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int]) -> list[tuple[str, ...]]:
    """The cells of ``task_headers``, a row for each policy that has runs, with arguments as for ``table_rows``."""
    columns: Mapping[str, str] = results.scenarios[scenario].task_class.columns
    rows: list[tuple[str, ...]] = []
    for cells in table_rows(results, scenario, policies, seeds):
        own = [run.metrics.get("task", {}) for run in results.select(scenario, cells.policy, seeds)]
        shares = [value for run in own if (value := run.get("success_share")) is not None]
        task_cells = [
            estimate_text([value for run in own if (value := run.get(name)) is not None], ".3g") for name in columns
        ]
        rows.append((
            cells.policy, cells.requirements, f"{sum(run.get('swarm_success') == 1.0 for run in own)}/{len(own)}",
            f"{np.mean(shares):.1%}" if shares else _NOTHING, *task_cells, cells.distance, cells.nearest, cells.spacing,
            cells.closest, cells.collisions,
        ))  # fmt: skip
    return rows


def task_table(
    title: str, headers: Sequence[str], rows: Sequence[Sequence[str]], caption: str, width: int
) -> RichTable:
    """The table of a task for a terminal of a given width in columns; names of policies are cut last."""
    table = RichTable(
        title=title, title_justify="left", caption=escape(caption), caption_justify="left",
        padding=0 if width < _NARROW else (0, 1),
    )  # fmt: skip
    longest = max((len(row[0]) for row in rows), default=0)
    whole = {headers[0]: min(longest, width // 4), headers[-1]: len(headers[-1])}
    for header in headers:
        table.add_column(escape(header), overflow="fold", width=whole.get(header))
    for row in rows:
        table.add_row(*(escape(cell.replace(_NOTHING, "-")) for cell in row))
    return table


def _cells(policy: str, requirements: str, runs: Sequence[ResultRow], paper: PaperFigure | None) -> TableRow:
    """A policy's row.

    Args:
        policy: its name.
        knows: what it has beyond the percept, on the scenario's vehicle.
        runs: its runs, at least one.
        paper: what the paper says of it, if anything.
    """
    times = _values(runs, "task_time_s")
    distances, spacings = _values(runs, "min_obstacle_distance_m"), _values(runs, "min_spacing_m")
    collisions = [run.metrics["collisions"] for run in runs]
    collided = sum(count > 0 for count in collisions)
    shares = [run.metrics["constraint_share"] for run in runs]

    return TableRow(
        policy=policy,
        requirements=requirements,
        arrived=f"{len(times)}/{len(runs)}",
        time=estimate_text(times, ".1f"),
        slowest=f"{max(times):.1f}" if times else _NOTHING,
        distance=estimate_text(distances, ".2f"),
        nearest=f"{min(distances):.2f}" if distances else _NOTHING,
        spacing=estimate_text(spacings, ".2f"),
        closest=f"{min(spacings):.2f}" if spacings else _NOTHING,
        mean=estimate_text(_values(runs, "mean_min_spacing_m"), ".2f"),
        within=", ".join(f"{name} {np.mean([s[name] for s in shares]):.0%}" for name in ("s_l", "s_o", "s_u")),
        collisions=f"{sum(collisions)} in {counted(collided, 'seed')}" if collided else "0",
        paper=_paper_cell(paper),
    )


_Measured = Literal["task_time_s", "min_obstacle_distance_m", "min_spacing_m", "mean_min_spacing_m"]


def _values(runs: Sequence[ResultRow], name: _Measured) -> list[float]:
    return [value for run in runs if (value := run.metrics[name]) is not None]


def counted(number: int, what: str) -> str:
    """A number with its noun: ``1 seed``, ``2 seeds``."""
    return f"{number} {what}" + ("" if number == 1 else "s")


def _requirements_text(scenario: Scenario, policy: str, known: PolicyInfo) -> str:
    """What a policy has beyond the percept on a scenario, and beyond what all others have there."""
    texts = [known["policy_class"]] if "policy_class" in known else []
    has = with_requirements(policy, requirements_of(known), scenario)
    texts += [*has.sonar.channels, *(["identity"] if "identity" in known else [])]
    if has.timing.decision_period_s != scenario.timing.decision_period_s:
        texts.append(f"a decision every {has.timing.decision_period_s:g} s")
    damping = has.actuators.yaw_damping_nms
    if damping and (parse_name(policy).own_clock or not scenario.timing.fixed):
        texts.append(f"yaw damping {damping:g} N m s")
    return ", ".join(texts) or _NOTHING


def _paper_cell(paper: PaperFigure | None) -> str:
    if paper is None:
        return _NOTHING
    distances = "-".join(f"{distance:g}" for distance in paper.min_obstacle_distance_m or ())
    parts = (
        f"{paper.task_time_s:g} s" if paper.task_time_s else "",
        f"{distances} m" if distances else "",
        f"spacing {paper.min_spacing_m:g} m, mean {paper.mean_min_spacing_m:g} m" if paper.min_spacing_m else "",
    )
    return ", ".join(filter(None, parts))


def rich_table(title: str, rows: Sequence[TableRow], width: int) -> RichTable:
    """The table for a terminal of a given width in columns: the same cells, stacked so that they fit.

    For a narrow terminal it leaves out intervals, the spacing's time mean and the shares of Eq. 7; table.md has them.
    """
    narrow = width < _NARROW
    table = RichTable(
        title=title, title_justify="left", caption=CAPTION, caption_justify="left", show_lines=True,
        padding=0 if narrow else (0, 1),
    )  # fmt: skip
    # A policy's name is what tells rows from each other: it is folded where it must be, and never cut.
    longest = max((len(cells.policy) for cells in rows), default=0)
    table.add_column("policy", overflow="fold", width=min(max(longest, 0 if narrow else 23), width // 4))
    for header in ("arrived", "task time [s]", "obstacle distance [m]", "spacing [m]"):
        table.add_column(escape(header), justify="right", overflow="fold")
    table.add_column("collisions" if narrow else "within Eq. 7, collisions", overflow="fold")
    table.add_column("paper", overflow="fold")
    for c in rows:
        time, distance, spacing = (
            text.partition(" [")[0] if narrow else text for text in (c.time, c.distance, c.spacing)
        )
        cells = (
            c.policy if c.requirements == _NOTHING else f"{c.policy}\n({c.requirements})",
            c.arrived,
            f"{time}\nworst {c.slowest}",
            f"{distance}\nworst {c.nearest}",
            f"{spacing}\nworst {c.closest}" + ("" if narrow else f"\ntime mean {c.mean}"),
            c.collisions if narrow else f"{c.within}\ncollisions: {c.collisions}",
            c.paper,
        )
        table.add_row(*(escape(cell.replace(_NOTHING, "-")) for cell in cells))  # a dash that every terminal has
    return table


def markdown_table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, with a line end after the last row."""
    lines = [headers, ("---",) * len(headers), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
