"""``robustness.md``: every policy's scores by group, and its worst axes, written from the table of episodes alone."""

from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.estimates import Estimate
from uuv_marl.benchmark.robustness.axes import AXES, BASE, CALM, GROUPS, overrides
from uuv_marl.benchmark.robustness.figure import draw
from uuv_marl.benchmark.robustness.job import EPISODES, read_episodes
from uuv_marl.benchmark.robustness.scores import EVERY, axis_score, by_seed, group_score, scored
from uuv_marl.benchmark.style import house_style, save
from uuv_marl.benchmark.tables import NOTHING, markdown_table
from uuv_marl.scenario import IDEAL, conditions, load_scenario, scenario_names

_GROUPS = [*(group for group in GROUPS if group != "X"), EVERY, "X"]
_WORST = 3
"""Number of axes that a policy's row names."""


def write_robustness_report(folder: Path) -> list[Path]:
    """Write the page and its pictures from the folder's ``EPISODES``; return the paths, first the page's."""
    episodes = read_episodes(folder / EPISODES)
    page = folder / "robustness.md"
    write_text(page, report(episodes))
    with house_style():
        scenarios = by_seed(episodes).groupby(level="scenario", sort=False)
        return [page, *(save(draw(_main(own)), folder / _picture(name)) for name, own in scenarios)]


def report(episodes: Any) -> str:
    """The page's text."""
    folder = resources.files("uuv_marl.benchmark.robustness")
    scenarios = by_seed(episodes).groupby(level="scenario", sort=False)
    names = [name for name, _ in scenarios]
    return Template((folder / "story.md").read_text(encoding="utf-8")).substitute(
        headline=f"{len(episodes):,} episodes on {', '.join(f'`{name}`' for name in names)}",
        conditions=_calm(names),
        echoes=BASE["sonar.echo_reports"],
        axes=", ".join(f"{name} ({axis.title})" for name, axis in AXES.items() if (episodes["axis"] == name).any()),
        scenarios="\n".join(_scenario(name, own) for name, own in scenarios),
    )


def _picture(scenario: str) -> str:
    """Path of a scenario's picture, relative to the page."""
    return f"figures/robustness_{scenario}.png"


def _calm(scenarios: list[str]) -> str:
    """Conditions at level 0."""
    shipped = [name for name in scenarios if name in scenario_names()]
    phrases = [conditions(load_scenario(name, overrides=overrides(CALM, 0, name))) for name in shipped]
    return "; ".join(dict.fromkeys(phrases)) or f"{IDEAL}, unless the scenario says otherwise"


def _main(table: Any) -> Any:
    """The rows of the policies with the most seeds, and the cells that one of them ran."""
    seeds = table.groupby(level="policy").size()
    rows = table[table.index.get_level_values("policy").isin(seeds[seeds == seeds.max()].index)]
    return rows.dropna(axis="columns", how="all")


def _scenario(name: str, table: Any) -> str:
    """A scenario's table and picture."""
    picture = f"![Success over severity on {name}]({_picture(name)})"
    cells = table.columns[table.notna().any()]
    levels = ", ".join(map(str, sorted({level for _, level in cells} - {0})))
    missing = ", ".join(axis for axis in AXES if axis in table and axis not in {run for run, _ in cells})
    return f"## {name}\n\nLevels {levels}{missing and f'; without {missing}'}.\n\n{_scores(table)}\n{picture}\n"


def _scores(table: Any) -> str:
    """A row for each policy, the highest score over all groups first."""
    rows: list[tuple[float, tuple[str, ...]]] = []
    for policy, own in table.groupby(level="policy", sort=False):
        scores = {group: group_score(own, group) for group in _GROUPS}
        cells = [f"{score:.2f}" if score and group == EVERY else _text(score) for group, score in scores.items()]
        undisturbed: Any = own[CALM].dropna().to_numpy() if CALM in own else ()
        calm = _text(scored(undisturbed) if len(undisturbed) else None)
        best = scores[EVERY] or scores["X"]
        rows.append((best.value if best else -1.0, (policy, f"{len(own)}", calm, *cells, _worst(own))))
    head = ("policy", "seeds", "undisturbed", *(GROUPS.get(group, group) for group in _GROUPS), "worst axes")
    return markdown_table(head, [cells for _, cells in sorted(rows, key=lambda row: row[0], reverse=True)])


def _worst(table: Any) -> str:
    """The axes, but X, with a policy's lowest scores, the lowest first."""
    scores = {name: score.value for name in AXES if name != "X" and (score := axis_score(table, name))}
    lowest = sorted(scores, key=scores.__getitem__)[:_WORST]
    return ", ".join(f"{name} {scores[name]:.2f}" for name in lowest) or NOTHING


def _text(score: Estimate | None) -> str:
    return f"{score.value:.2f}" if score else NOTHING
