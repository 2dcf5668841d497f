"""The benchmark's tables: interquartile means over seeds with intervals, worst seeds, and the paper's figures."""

from collections.abc import Callable, Iterable, Mapping, Sequence
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
"""Columns of a terminal below which its table omits intervals, and space beside its lines."""
_NEEDS = "class, and extra observations"
_WIDE = (_NEEDS, "mean spacing [m]", "within Eq. 7")
"""Columns that a terminal's table omits; the first is below the policy's name, and a worst value below its mean."""
_INTERVAL = " [95 % bootstrap interval]"
_MEANINGS = {
    "policy": f"Interquartile mean over seeds{_INTERVAL}; worst seed; times over the seeds that arrived.",
    "arrived": "Arrived is the paper's success: all vehicles rest at the end, or have passed it where "
    "arrival.criterion = passage, with or without collisions.",
    "swarm success": "Swarm success: episodes in which every vehicle succeeds; a vehicle succeeds if it is at its goal "
    "at the end of the episode and has had no collision.",
    "success": "Success: mean share of such vehicles.",
    "obstacle distance [m]": "Obstacle distance: smallest, to the surface; spacing: smallest between two vehicles.",
    "mean spacing [m]": "Mean spacing: time mean of the smallest.",
    "within Eq. 7": "Within Eq. 7: mean share of the time in which all vehicles are within s_l of l(t), keep s_o from "
    "obstacles, and s_u from each other.",
    "paper": "SFF and SDC are reconstructions: the paper only names them. Figures of the paper are single runs.",
}
"""Sentences of the caption, by the column that they belong to."""


class Table(NamedTuple):
    """A scenario's table."""

    title: str
    rows: Sequence[Mapping[str, str]]
    """At least one; cells by the header of their column."""
    meanings: Mapping[str, str] = _MEANINGS

    def caption(self, *omitted: str) -> str:
        """The meaning of the columns but the omitted ones."""
        return " ".join(self.meanings[name] for name in self.rows[0] if name in self.meanings and name not in omitted)


def scenario_table(results: Results, scenario: Scenario, policies: Sequence[str], seeds: Sequence[int]) -> Table:
    """The table of a scenario, with a row for each of the policies that has runs with these seeds."""
    runs = {policy: results.select(scenario.name, policy, seeds) for policy in policies}
    loaded, own = results.scenarios[scenario.name], scenario.task_class.columns
    rows = [_row(loaded, each, results.policies[policy]) for policy, each in runs.items() if each]
    return Table(title(scenario, seeds), rows, _MEANINGS | {name: f"{name}: {own[name]}." for name in own})


def title(scenario: Scenario, seeds: Sequence[int]) -> str:
    """Heading of a scenario's table."""
    changed = differences(scenario) if scenario.name in scenario_names() else []
    note = f"; CHANGED: {', '.join(changed)}" if changed else ""
    return (
        f"{scenario.name} v{scenario.version} ({scenario.source}), {scenario.swarm.num_vehicles} vehicles, "
        f"{counted(len(seeds), 'seed')}, echoes report the {scenario.sonar.echo_reports}, {conditions(scenario)}{note}"
    )


def _row(scenario: Scenario, runs: Sequence[ResultRow], info: PolicyInfo) -> dict[str, str]:
    """The row of a policy from its runs, at least one."""
    policy, task = runs[0].policy, scenario.task_class
    every: list[Mapping[str, Any]] = [{**run.metrics, **run.metrics.get("task", {})} for run in runs]

    def values(metric: str) -> list[float]:
        return [metrics[metric] for metrics in every if metrics.get(metric) is not None]

    def worst(metric: str, spec: str, pick: Callable[[list[float]], float] = min) -> str:
        return f"{pick(values(metric)):{spec}}" if values(metric) else NOTHING

    def mean(metric: str, spec: str) -> str:
        return f"{estimate(values(metric), fewest=FEWEST):{spec}}" if values(metric) else NOTHING

    counts = values("collisions")
    collisions = f"{sum(counts)} in {counted(sum(map(bool, counts)), 'seed')}" if any(counts) else "0"
    shares = [run.metrics["constraint_share"] for run in runs]
    within = (f"{name} {np.mean([share[name] for share in shares]):.0%}" for name in ("s_l", "s_o", "s_u"))
    follows, success = issubclass(task, Follow), values("success_share")
    first = {
        "arrived": f"{len(values('task_time_s'))}/{len(runs)}",
        "task time [s]": mean("task_time_s", ".1f"),
        "worst time [s]": worst("task_time_s", ".1f", max),
    } if follows else {
        "swarm success": f"{values('swarm_success').count(1.0)}/{len(runs)}",
        "success": f"{np.mean(success):.1%}" if success else NOTHING,
        **{name: mean(name, ".3g") for name in task.columns},
    }  # fmt: skip
    figure = PaperFigure() if differences(scenario) else PAPER.get((scenario.name, policy), PaperFigure())
    paper = {"mean spacing [m]": mean("mean_min_spacing_m", ".2f"), "within Eq. 7": ", ".join(within)}
    return {
        "policy": policy,
        _NEEDS: _requirements_text(scenario, policy, info),
        **first,
        "obstacle distance [m]": mean("min_obstacle_distance_m", ".2f"),
        "worst distance [m]": worst("min_obstacle_distance_m", ".2f"),
        "spacing [m]": mean("min_spacing_m", ".2f"),
        "worst spacing [m]": worst("min_spacing_m", ".2f"),
        **(paper if follows else {}),
        "collisions": collisions,
        **({"paper": _paper_cell(figure)} if follows else {}),
    }


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
    narrow, caption = width < _NARROW, table.caption(*_WIDE)
    out = RichTable(
        title=table.title, title_justify="left", caption=escape(caption.replace(_INTERVAL, "") if narrow else caption),
        caption_justify="left", padding=0 if narrow else (0, 1), show_lines=True,
    )  # fmt: skip
    shown = [name for name in table.rows[0] if name not in _WIDE and not name.startswith("worst ")]
    longest = max(22, *(len(row["policy"]) for row in table.rows))
    for name in shown:
        out.add_column(escape(name), overflow="fold", width=min(longest, width // 5) if name == "policy" else None)
    for row in table.rows:
        cells = [row[name].partition(" [")[0] if narrow else row[name] for name in shown]
        if row[_NEEDS] != NOTHING:
            cells[0] += f"\n({row[_NEEDS]})"
        for k, name in enumerate(shown):  # "worst time [s]" for "task time [s]"
            if worst := row.get(f"worst {' '.join(name.split()[-2:])}"):
                cells[k] += f"\nworst {worst}"
        out.add_row(*(escape(cell.replace(NOTHING, "-")) for cell in cells))  # a dash that every terminal has
    return out


def markdown_table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, with a line end after the last row."""
    lines = [headers, ("---",) * len(headers), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
