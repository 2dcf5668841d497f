"""The benchmark's tables: interquartile means over seeds with intervals, worst seeds, and the paper's figures."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from rich.markup import escape
from rich.table import Table as RichTable

from uuv_marl.baselines.making import with_requirements
from uuv_marl.baselines.names import parse_name
from uuv_marl.benchmark.estimates import FEWEST, estimate
from uuv_marl.benchmark.paper import PAPER, PaperFigure
from uuv_marl.benchmark.results import PolicyInfo, ResultRow, Results, requirements_of
from uuv_marl.scenario import Scenario, conditions, differences, scenario_names
from uuv_marl.tasks import Follow

NOTHING = "–"
"""Cell without a value."""
_NARROW = 110
"""Columns of a terminal below which its table omits intervals and the time mean."""
HEADERS = (
    "policy", "class, and extra observations", "arrived", "task time [s]", "worst", "obstacle distance [m]", "worst",
    "spacing [m]", "worst", "mean spacing [m]", "within Eq. 7", "collisions", "paper",
)  # fmt: skip
CAPTION = (
    "Interquartile mean over seeds [95 % bootstrap interval]; worst seed; times over the seeds that arrived. "
    "Arrived is the paper's success: all vehicles rest at the end, or have passed it where arrival.criterion = "
    "passage, with or without collisions. "
    "Obstacle distance: smallest, to the surface; spacing: smallest between two vehicles, and its time mean. "
    "Within Eq. 7: mean share of the time in which all vehicles are within s_l of l(t), keep s_o from obstacles, "
    "and s_u from each other. "
    "SFF and SDC are reconstructions: the paper only names them. Figures of the paper are single runs."
)
_TASK_CAPTION = (
    "Interquartile mean over seeds [95 % bootstrap interval]; worst seed. Swarm success: episodes in which every "
    "vehicle succeeds; a vehicle succeeds if it is at its goal at the end of the episode and has had no collision. "
    "Success: mean share of such vehicles. Obstacle distance: smallest, to the surface; spacing: smallest between two "
    "vehicles."
)


class RowCells(NamedTuple):
    """A policy's row of the table of ``follow``, a text for each of ``HEADERS``."""

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


class Table(NamedTuple):
    """A scenario's table."""

    title: str
    headers: tuple[str, ...]
    """``HEADERS`` for the task ``follow``, whose rows are ``RowCells``."""
    rows: Sequence[tuple[str, ...]]
    caption: str


def scenario_table(results: Results, scenario: Scenario, policies: Sequence[str], seeds: Sequence[int]) -> Table:
    """The table of a scenario, with a row for each of the policies that has runs with these seeds."""
    runs = {policy: results.select(scenario.name, policy, seeds) for policy in policies}
    loaded, task = results.scenarios[scenario.name], scenario.task_class
    rows = [_cells(loaded, own, results.policies[policy]) for policy, own in runs.items() if own]
    if issubclass(task, Follow):
        return Table(title(scenario, seeds), HEADERS, rows, CAPTION)
    headers = (
        "policy", "class, and extra observations", "swarm success", "success", *task.columns,
        "obstacle distance [m]", "worst", "spacing [m]", "worst", "collisions",
    )  # fmt: skip
    task_rows = [_task_cells(cells, runs[cells.policy], task.columns) for cells in rows]
    own_columns = "".join(f" {name}: {meaning}." for name, meaning in task.columns.items())
    return Table(title(scenario, seeds), headers, task_rows, _TASK_CAPTION + own_columns)


def title(scenario: Scenario, seeds: Sequence[int]) -> str:
    """Heading of a scenario's table."""
    changed = differences(scenario) if scenario.name in scenario_names() else []
    note = f"; CHANGED: {', '.join(changed)}" if changed else ""
    return (
        f"{scenario.name} v{scenario.version} ({scenario.source}), {scenario.swarm.num_vehicles} vehicles, "
        f"{counted(len(seeds), 'seed')}, echoes report the {scenario.sonar.echo_reports}, {conditions(scenario)}{note}"
    )


def _cells(scenario: Scenario, runs: Sequence[ResultRow], info: PolicyInfo) -> RowCells:
    """The row of a policy from its runs, at least one."""
    policy = runs[0].policy
    times, distances, spacings = (
        _measured(runs, name) for name in ("task_time_s", "min_obstacle_distance_m", "min_spacing_m")
    )
    collisions = [run.metrics["collisions"] for run in runs]
    collided = sum(count > 0 for count in collisions)
    shares = [run.metrics["constraint_share"] for run in runs]
    return RowCells(
        policy=policy,
        requirements=_requirements_text(scenario, policy, info),
        arrived=f"{len(times)}/{len(runs)}",
        time=estimate_text(times, ".1f"),
        slowest=f"{max(times):.1f}" if times else NOTHING,
        distance=estimate_text(distances, ".2f"),
        nearest=f"{min(distances):.2f}" if distances else NOTHING,
        spacing=estimate_text(spacings, ".2f"),
        closest=f"{min(spacings):.2f}" if spacings else NOTHING,
        mean=estimate_text(_measured(runs, "mean_min_spacing_m"), ".2f"),
        within=", ".join(f"{name} {np.mean([s[name] for s in shares]):.0%}" for name in ("s_l", "s_o", "s_u")),
        collisions=f"{sum(collisions)} in {counted(collided, 'seed')}" if collided else "0",
        paper=NOTHING if differences(scenario) else _paper_cell(PAPER.get((scenario.name, policy), PaperFigure())),
    )


def _task_cells(cells: RowCells, runs: Sequence[ResultRow], columns: Iterable[str]) -> tuple[str, ...]:
    """The row of a policy in the table of a task with measures of its own."""
    shares = _measured(runs, "success_share")
    return (
        cells.policy, cells.requirements, f"{_measured(runs, 'swarm_success').count(1.0)}/{len(runs)}",
        f"{np.mean(shares):.1%}" if shares else NOTHING,
        *(estimate_text(_measured(runs, name), ".3g") for name in columns),
        cells.distance, cells.nearest, cells.spacing, cells.closest, cells.collisions,
    )  # fmt: skip


def _measured(runs: Sequence[ResultRow], name: str) -> list[float]:
    """A metric, also one of the task's own, of the runs that have it."""
    every: list[Mapping[str, Any]] = [{**run.metrics, **run.metrics.get("task", {})} for run in runs]
    return [value for metrics in every if (value := metrics.get(name)) is not None]


def estimate_text(sample: Sequence[float], spec: str) -> str:
    """An estimate as text, each number as ``spec`` says: without interval for few values, a dash for none."""
    return f"{estimate(sample, fewest=FEWEST):{spec}}" if sample else NOTHING


def counted(number: int, what: str) -> str:
    """A number with its noun: ``1 seed``, ``2 seeds``."""
    return f"{number} {what}" + ("" if number == 1 else "s")


def _requirements_text(scenario: Scenario, policy: str, info: PolicyInfo) -> str:
    """Class of a policy, and what it requires on a scenario beyond what the scenario gives to all."""
    texts = [info["policy_class"]] if "policy_class" in info else []
    required = with_requirements(policy, requirements_of(info), scenario)
    texts += required.sonar.channels
    if required.timing.decision_period_s != scenario.timing.decision_period_s:
        texts.append(f"a decision every {required.timing.decision_period_s:g} s")
    damping = required.actuators.yaw_damping_nms
    if damping and (parse_name(policy).own_clock or not scenario.timing.fixed):
        texts.append(f"yaw damping {damping:g} N m s")
    return ", ".join(texts) or NOTHING


def _paper_cell(paper: PaperFigure) -> str:
    distances = "-".join(f"{distance:g}" for distance in paper.min_obstacle_distance_m or ())
    parts = (
        f"{paper.task_time_s:g} s" if paper.task_time_s else "",
        f"{distances} m" if distances else "",
        f"spacing {paper.min_spacing_m:g} m, mean {paper.mean_min_spacing_m:g} m" if paper.min_spacing_m else "",
    )
    return ", ".join(filter(None, parts)) or NOTHING


def terminal_table(table: Table, width: int) -> RichTable:
    """A table for a terminal of a given width in columns; names of policies are folded last, and never cut."""
    stacked, narrow = table.headers == HEADERS, width < _NARROW
    out = RichTable(
        title=table.title, title_justify="left", caption=escape(table.caption), caption_justify="left",
        padding=0 if narrow else (0, 1), show_lines=stacked,
    )  # fmt: skip
    longest = max((len(row[0]) for row in table.rows), default=0)
    if stacked:
        out.add_column("policy", overflow="fold", width=min(max(longest, 0 if narrow else 23), width // 4))
        for header in ("arrived", "task time [s]", "obstacle distance [m]", "spacing [m]"):
            out.add_column(escape(header), justify="right", overflow="fold")
        out.add_column("collisions" if narrow else "within Eq. 7, collisions", overflow="fold")
        out.add_column("paper", overflow="fold")
    else:
        widths = {table.headers[0]: min(longest, width // 4), table.headers[-1]: len(table.headers[-1])}
        for header in table.headers:
            out.add_column(escape(header), overflow="fold", width=widths.get(header))
    for row in table.rows:
        cells = _stacked(RowCells(*row), narrow) if stacked else row
        out.add_row(*(escape(cell.replace(NOTHING, "-")) for cell in cells))  # a dash that every terminal has
    return out


def _stacked(c: RowCells, narrow: bool) -> tuple[str, ...]:
    """The cells of a row that fit a terminal; a narrow one omits intervals, the time mean and the shares of Eq. 7."""
    time, distance, spacing = (text.partition(" [")[0] if narrow else text for text in (c.time, c.distance, c.spacing))
    return (
        c.policy if c.requirements == NOTHING else f"{c.policy}\n({c.requirements})",
        c.arrived,
        f"{time}\nworst {c.slowest}",
        f"{distance}\nworst {c.nearest}",
        f"{spacing}\nworst {c.closest}" + ("" if narrow else f"\ntime mean {c.mean}"),
        c.collisions if narrow else f"{c.within}\ncollisions: {c.collisions}",
        c.paper,
    )


def markdown_table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, with a line end after the last row."""
    lines = [headers, ("---",) * len(headers), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
