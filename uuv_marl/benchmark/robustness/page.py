"""``report.md``: scores, critical severities and all cells, written from the table of episodes alone."""

from collections import defaultdict
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from uuv_marl.atomic import write_text
from uuv_marl.baselines import POLICIES
from uuv_marl.benchmark.robustness.axes import AXES, BASE, CALM, GROUPS
from uuv_marl.benchmark.robustness.figure import draw
from uuv_marl.benchmark.robustness.job import EPISODES, FULL, read_episodes
from uuv_marl.benchmark.robustness.scores import (
    ENOUGH,
    EVERY,
    WORTH_KEEPING,
    AxisScore,
    axis_score,
    by_seed,
    critical_text,
    difference,
    group_score,
    scored,
)
from uuv_marl.benchmark.style import house_style, save
from uuv_marl.benchmark.tables import counted, markdown_table
from uuv_marl.scenario import IDEAL, conditions, load_scenario, scenario_names

_NOTHING = "–"
_LEARNED: dict[str, tuple[frozenset[str], frozenset[int]]] = {
    f"{name}{training}": (
        frozenset(("W1", "W2", "W3", "S1", "S2", "S3", "S5", "S7", "S8", "S9", "A1", *others)),
        frozenset(levels),
    )
    for name, others, levels in (
        ("mappo_v2", ("A2",), (1, 2, 3)),
        ("mappo_v3", (), (1, 2, 3)),
        ("mappo_v4", (), (2, 3, 4, 5)),
    )
    for training in ("", "_seed1")
}
"""Axes and levels that a learned policy was trained with; all others were tuned or trained in still water."""


def write_report(folder: Path) -> list[Path]:
    """``report.md`` and its pictures from the folder's ``EPISODES``; the paths, that of the page first."""
    episodes = read_episodes(folder / EPISODES)
    page = folder / "report.md"
    write_text(page, report(episodes))
    with house_style():
        scenarios = by_seed(episodes).groupby(level="scenario", sort=False)
        return [page, *(save(draw(own), folder / _picture(name)) for name, own in scenarios)]


def report(episodes: Any) -> str:
    """The page's text."""
    story = Template(resources.files("uuv_marl.benchmark.robustness").joinpath("story.md").read_text(encoding="utf-8"))
    table, scenarios = by_seed(episodes), list(episodes["scenario"].unique())
    seeds, policies = episodes["seed"].nunique(), ", ".join(f"`{name}`" for name in episodes["policy"].unique())
    return story.substitute(
        headline=f"{counted(len(episodes), 'episode')} of {policies} on {', '.join(f'`{s}`' for s in scenarios)}, "
        f"{counted(seeds, 'seed')}.",
        conditions=f"{_calm(scenarios)}; echoes report the {BASE['sonar.echo_reports']} of obstacles",
        missing="\n".join(f"- {line}." for line in _missing(episodes)) or "- Nothing: every cell was run.",
        scenarios="\n".join(_scenario(name, episodes, table.loc[[name]]) for name in scenarios),
        axes=markdown_table(
            ("axis", "what", "unit", "level 0", "levels", "source"),
            [(a.name, a.title, a.unit, a.labels[0], "; ".join(a.labels[1:]), a.source) for a in AXES.values()],
        ),
    )


def _picture(scenario: str) -> str:
    """Where a scenario's picture is, seen from the page."""
    return f"figures/{scenario}.png"


def _calm(scenarios: list[str]) -> str:
    """What is on at level 0."""
    found = [conditions(load_scenario(name, overrides=BASE)) for name in scenarios if name in scenario_names()]
    return "; ".join(dict.fromkeys(found)) or f"{IDEAL}, unless the scenario says otherwise"


def _missing(episodes: Any) -> Iterator[str]:
    """What a full run has and these episodes have not."""
    for column, whole in (("level", FULL.levels), ("scenario", FULL.scenarios)):
        if absent := [str(one) for one in whole if one not in set(episodes[column])]:
            yield f"Not run: {column}s {', '.join(absent)} (of {', '.join(map(str, whole))})"
    absent, idle = defaultdict[str, list[str]](list), defaultdict[str, list[str]](list)
    scenarios = episodes["scenario"].unique()
    for policy, own in episodes.groupby("policy", sort=False):
        if elsewhere := [name for name in scenarios if name not in set(own["scenario"])]:
            yield f"Not run for `{policy}`: scenarios {', '.join(elsewhere)}"
        for name in AXES.keys() - set(own["axis"]):
            unused = policy.removeprefix("guarded:") in POLICIES and not AXES[name].concerns(policy)
            (idle if unused else absent)[name].append(f"`{policy}`")
    for found, words in (
        (absent, "Not run for"),
        (idle, "Left out, since they use neither link nor modem, for"),
    ):
        for policies in dict.fromkeys(tuple(found[name]) for name in AXES if name in found):
            names = [name for name in AXES if tuple(found.get(name, ())) == policies]
            yield f"{words} {', '.join(policies)}: {', '.join(names)}"
    count = episodes.groupby(["scenario", "axis", "level", "policy"]).size()
    if count.min() < count.max():
        few, most = count[count < count.max()], counted(int(count.max()), "seed")
        names = ", ".join(f"`{name}`" for name in dict.fromkeys(few.index.get_level_values("policy")))
        yield (
            f"Not complete: {counted(len(few), 'cell')} of {names} with fewer than {most}. "
            'Compare these policies with others only where seeds are paired, in "Who is best"'
        )


def _scenario(name: str, episodes: Any, table: Any) -> str:
    """A scenario's picture and tables."""
    policies = dict[str, Any](iter(table.groupby(level="policy", sort=False)))
    scores = {(one, axis): axis_score(own, axis) for one, own in policies.items() for axis in AXES if axis in table}
    star = " A star: trained with it." if any(_mark(name, "A1", 1) for name in policies) else ""
    parts = (
        ("Scores", "Mean success over the levels that were run. `all`: the mean over the groups, without X.",
         _groups(policies)),
        ("Who is best", "By how much the policy with the highest mean over all groups (of X, where only X was run), "
         "and each that was trained with disturbances, is above each other, paired by seed.", _best(table)),
        ("Axes", f"Mean success over the levels that were run; then what it keeps of level 0's success, where that "
         f"is at least {WORTH_KEEPING:g}.{star}", _table(scores, _kept)),
        ("Critical severity", f"Where success falls below {ENOUGH:g} first, linear between the levels that were run, "
         "in the axis's unit.", _table(scores, lambda _, axis, score: critical_text(axis, score))),
        ("Every cell", "Success; in how many episodes the whole swarm succeeded; contacts per episode, those of "
         "faulty vehicles too." + star,
         _cells(episodes[episodes["scenario"] == name], policies)),
    )  # fmt: skip
    picture = f"![Success over severity on {name}]({_picture(name)})"
    tables = "\n".join(f"### {title}\n\n{words}\n\n{rows}" for title, words, rows in parts)
    return f"## {name}\n\n{picture}\n\n{tables}"


def _groups(policies: dict[str, Any]) -> str:
    groups = ["W", "S", "N", "C", "A", "F", EVERY, "X"]
    headers = ["policy", "level 0", *(f"{GROUPS[g]} ({g})" if g in GROUPS else g for g in groups)]
    rows: list[list[str]] = []
    for policy, own in policies.items():
        calm = scored(own[CALM].dropna().to_numpy()) if CALM in own else None
        rows.append([policy, *(f"{s:.2f}" if s else _NOTHING for s in (calm, *(group_score(own, g) for g in groups)))])
    return markdown_table(headers, rows)


def _best(table: Any) -> str:
    """Who is best over all groups (in X where no other was run), and who was trained disturbed, minus each other."""
    known: dict[str, float] = {}
    for group in (EVERY, "X"):
        scores = {name: group_score(own, group) for name, own in table.groupby(level="policy", sort=False)}
        known = known or {name: score.value for name, score in scores.items() if score}
    firsts = list(dict.fromkeys([*sorted(known, key=known.__getitem__)[-1:], *(n for n in known if n in _LEARNED)]))
    rows = [
        (f"{first} - {name}", *(f"{more:+.3f}" if more else _NOTHING for more in found))
        for k, first in enumerate(firsts)
        for name in known
        if name not in firsts[: k + 1]
        for found in [[difference(table, first, name, group) for group in (EVERY, "X")]]
    ]
    return markdown_table(("policies", EVERY, f"{GROUPS['X']} (X)"), rows) if rows else "There is one policy.\n"


def _kept(policy: str, axis: str, score: AxisScore) -> str:
    """Success on an axis, and what it is of that at level 0."""
    kept = f"; {score.retention.value:.0%}" if score.retention else ""
    return f"{score.success:.2f}{_mark(policy, axis, *score.levels)}{kept}"


def _table(scores: dict[tuple[str, str], AxisScore | None], cell: Callable[[str, str, AxisScore], str]) -> str:
    """A row for each axis that any policy was run on, a column for each policy."""
    policies, axes = (dict.fromkeys(key[k] for key in scores) for k in (0, 1))
    rows = [
        (
            axis, f"{AXES[axis].title} [{AXES[axis].unit}]",
            *(cell(policy, axis, score) if (score := scores[policy, axis]) else _NOTHING for policy in policies),
        )
        for axis in axes
    ]  # fmt: skip
    return markdown_table(("axis", "what [unit]", *policies), rows)


def _cells(episodes: Any, policies: dict[str, Any]) -> str:
    found = dict[Any, Any](iter(episodes.groupby(["axis", "level", "policy"])))
    rows: list[list[str]] = []
    places = [
        (CALM, 0, "–"),
        *((a.name, k, label) for a in AXES.values() for k, label in zip(a.levels, a.labels[1:], strict=True)),
    ]
    for axis, level, label in places:
        if any((axis, level, policy) in found for policy in policies):
            cells = [found.get((axis, level, policy)) for policy in policies]
            marks = [_mark(policy, axis, level) for policy in policies]
            texts = (_NOTHING if own is None else _cell(own) + mark for own, mark in zip(cells, marks, strict=True))
            rows.append([axis, str(level), label, *texts])
    return markdown_table(("axis", "level", "severity", *policies), rows)


def _mark(policy: str, axis: str, *levels: int) -> str:
    """A star where the policy was trained with one of these levels."""
    axes, known = _LEARNED.get(policy.removeprefix("guarded:"), (frozenset[str](), frozenset[int]()))
    return "*" if axis in axes and not known.isdisjoint(levels) else ""


def _cell(own: Any) -> str:
    success = own["success_share"].dropna().to_numpy()
    if not len(success):
        return _NOTHING
    swarms, contacts = own["swarm_success"].sum(), own["collisions"].mean()
    return f"{scored(success):.2f}; {swarms:.0f}/{len(success)}; {contacts:.3g}"
