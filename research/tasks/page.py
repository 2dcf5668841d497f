"""The page of a task, written from the rows of its episodes alone."""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, grouped, measured, read_rows, short
from research.second import SECOND, first_of, runnable
from research.statistics import estimate, resampled
from research.tasks import failures
from research.tasks.studies import STUDIES, Study, set_name
from uuv_marl.baselines.making import policy_requirements
from uuv_marl.baselines.registry import is_trained
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.scenario import load_scenario
from uuv_marl.types import Float64

Groups = Mapping[tuple[str, ...], Sequence[Row]]
"""Rows by policy and set."""
Columns = Mapping[str, Sequence[str]]
"""Sets by the header of their column."""
_RESAMPLES = 2000
_NOT_CONTROLLERS = ("oracle", "carrot_informed", "random", "idle", "research.blind")
_MEASURES: Mapping[str, tuple[str, Callable[[Sequence[float], int], str]]] = {
    "found_share": ("found", lambda values, _: short(float(np.mean(values)))),
    "found_s": ("time until held", lambda values, _: f"{np.mean(values):.0f} s"),
    "success_share": ("vehicle success", lambda values, _: short(float(np.mean(values)))),
    "collisions": ("collisions", lambda values, n: f"{np.mean(values) / n:.2f}"),
    "time_ratio": ("time", lambda values, _: f"{np.mean(values):.2f}" if values else "–"),
    "swarm_time_ratio": ("swarm time", lambda values, _: f"{np.mean(values):.2f}" if values else "–"),
    "min_obstacle_distance_m": ("obstacle distance", lambda values, _: f"{np.mean(values):.1f} m" if values else "–"),
    "min_spacing_m": ("spacing", lambda values, _: f"{np.mean(values):.1f} m" if values else "–"),
}
"""Header and cell of each measure, from its values by episode and the number of vehicles."""


def report(task: str, rows: Sequence[Row]) -> str:
    """The page's text."""
    groups = grouped(rows, "policy", "set")
    study = STUDIES[task]
    kinds = {name.split("-")[1]: [name] for name in study.own if "-" in name}
    return Template(read_text("tasks", "stories", f"{task}.md")).substitute(
        episodes=f"{sum(row['set'] not in study.final.values() for row in rows):,}",
        tiers=_shares(groups, study, _tiers(task)),
        kinds=_measures(groups, study, kinds),
        measures=_measures(groups, study, {}),
        many=_measures(
            groups, study, {kind: [many] for kind in kinds if (many := set_name(task, kind, 54)) in study.sets}
        ),
        final=_final(groups, study) + _others(groups, study),
        failures=failures.table(read_rows(failures.ROWS), task),
        informed=_shares(groups, study, {name: [set_name(name, "", 20)] for name in _tiers(task)}, "success_share"),
    )


def _tiers(task: str) -> Columns:
    return {name: tier_sets(name) for name in (f"{task}_easy", task, f"{task}_hard")}


def tier_sets(scenario: str) -> list[str]:
    """The sets of a scenario: those of the kinds of map in its file."""
    return [set_name(scenario, kind) for kind in getattr(load_scenario(scenario).task_numbers, "kinds", [""])]


def _shares(groups: Groups, study: Study, columns: Columns, share: str = "") -> str:
    """The headline, or another ``share``, with its interval, and swarm success, for policies that ran on all sets."""
    share = share or study.headline
    table = [
        (named(policy), *(f"{with_interval(_values(mine, share))}, {_mean(mine, 'swarm_success')}" for mine in cells))
        for policy in _policies(groups)
        if (cells := _cells(groups, policy, columns))
    ]
    return markdown_table(("policy", *columns), table)


def _measures(groups: Groups, study: Study, columns: Columns) -> str:
    """The headline and the swarm success in each column, or of the medium tier, and other measures."""
    table: list[tuple[str, ...]] = []
    for policy in _policies(groups):
        cells = [
            groups.get((policy, name), ()) for names in ([*columns.values()] or [[study.medium]]) for name in names
        ]
        if every := [row for rows in cells for row in rows]:
            shares = [
                [_mean([rows], name) for name in (study.headline, "swarm_success")] if rows else ["–"] for rows in cells
            ]
            own = [", ".join(two) for two in shares] if columns else shares[0]
            rest = (_MEASURES[name][1](measured(every, name), _size(every[0])) for name in _shown(study))
            table.append((named(policy), *own, *rest))
    heads = (*columns,) if columns else (study.headline.replace("_", " "), "swarm success")
    return markdown_table(("policy", *heads, *(_MEASURES[name][0] for name in _shown(study))), table)


def _shown(study: Study) -> list[str]:
    """The other measures that have a column."""
    return [name for name in study.metrics[1:] if name in _MEASURES]


def _size(row: Row) -> int:
    """Number of vehicles."""
    scenario, _, rest = row["set"].partition("-")
    last = rest.split("-")[-1]
    return int(last) if last.isdigit() else load_scenario(scenario).swarm.num_vehicles


def _final(groups: Groups, study: Study) -> str:
    """The headline and the swarm success on the final seeds.

    A network has its gain over the best controller that observes no more, or else over the best of all, and one that
    was trained several times a second row for all of its trainings.
    """
    heads, table = ["policy"], dict[str, list[str]]()
    for scenario, name in study.final.items():
        mine, _ = _by_length(groups, name)
        heads += [scenario, "gain"]
        for policy in (policy for policy in mine if policy not in SECOND):
            every = [policy, *(other for other in mine if other in SECOND and first_of(other) == policy)]
            for trainings in [[policy], every] if len(every) > 1 else [[policy]]:
                title = named(policy) + (f", {len(every)} trainings" if len(trainings) > 1 else "")
                table.setdefault(title, [title]).extend(_final_cells(mine, trainings, study.headline))
    return markdown_table(heads, table.values())


def _others(groups: Groups, study: Study) -> str:
    """The headline of the policies that ran on the first final seeds only, the best first, as a paragraph."""
    texts, seeds = list[str](), 0
    for scenario, name in study.final.items():
        _, mine = _by_length(groups, name)
        means = [(policy, float(np.mean(measured(rows, study.headline)))) for policy, rows in mine.items()]
        if ranked := sorted(means, key=lambda pair: pair[1], reverse=True):
            seeds = len(mine[ranked[0][0]])
            equal = groupby(ranked, lambda pair: short(pair[1]))
            cells = (f"{', '.join(policy for policy, _ in pairs)} {value}" for value, pairs in equal)
            texts.append(f"on `{scenario}` " + ", ".join(cells))
    return f"\nThe others, on the first {seeds} of these seeds: {'; '.join(texts)}.\n" if texts else ""


def _by_length(groups: Groups, name: str) -> tuple[Mapping[str, Sequence[Row]], Mapping[str, Sequence[Row]]]:
    """Rows by policy in a set, of the policies with the most episodes and of the others."""
    mine = {policy: rows for (policy, where), rows in groups.items() if where == name}
    most = max(map(len, mine.values()), default=0)
    return (
        {policy: rows for policy, rows in mine.items() if len(rows) == most},
        {policy: rows for policy, rows in mine.items() if len(rows) < most},
    )


def _final_cells(mine: Mapping[str, Sequence[Row]], trainings: Sequence[str], headline: str) -> tuple[str, str]:
    """The headline with its interval over trainings and episodes, swarm success, and a network's gain."""
    policy, rows = trainings[0], [row for training in trainings for row in mine[training]]
    shares = {name: np.array(measured(own, headline)) for name, own in mine.items()}
    own = np.stack([shares[training] for training in trainings])
    if not is_trained(policy):
        return _pair(resampled([own], 0)[0], rows), ""
    controllers = [name for name in mine if not (is_trained(name) or name.startswith(_NOT_CONTROLLERS))]
    rivals = [name for name in controllers if _channels(name) <= _channels(policy)] or controllers
    best = max(rivals, key=lambda rival: shares[rival].mean())
    means, others = resampled([own, shares[best][None]], 0)
    gain = estimate(means.mean(axis=1) - others.mean(axis=1))
    return _pair(means, rows), f"{short(gain.point)} [{short(gain.low)}, {short(gain.high)}] over {best}"


def _pair(means: Float64, rows: Sequence[Row]) -> str:
    """The mean over trainings with its interval, from ``resampled``, and swarm success."""
    share = estimate(means.mean(axis=1))
    return f"{short(share.point)} [{short(share.low)}, {short(share.high)}], {_mean([rows], 'swarm_success')}"


def named(policy: str) -> str:
    """A policy with its extra observations."""
    channels = policy_requirements(runnable(policy)).channels
    return f"{policy} with {', '.join(channels)}" if channels else policy


def _channels(policy: str) -> set[str]:
    return {*policy_requirements(runnable(policy)).channels}


def _policies(groups: Groups) -> list[str]:
    return list(dict.fromkeys(policy for policy, _ in groups))


def _cells(groups: Groups, policy: str, columns: Columns) -> list[list[Sequence[Row]]]:
    """The rows of a policy in each set of each column; nothing if some are missing."""
    cells = [[groups.get((policy, name), ()) for name in names] for names in columns.values()]
    return cells if all(rows for mine in cells for rows in mine) else []


def _values(mine: Sequence[Sequence[Row]], name: str) -> list[Float64]:
    """A metric's values in each set, shape (episode,)."""
    return [np.array(measured(rows, name)) for rows in mine]


def _mean(mine: Sequence[Sequence[Row]], name: str) -> str:
    return short(float(np.mean([values.mean() for values in _values(mine, name)])))


def with_interval(sets: Sequence[Float64]) -> str:
    """The mean over sets of values, shape (episode,) each, and its 95 % interval over episodes."""
    rng, means = np.random.default_rng(0), np.empty(_RESAMPLES)
    for k in range(_RESAMPLES):
        means[k] = np.mean([values[rng.integers(len(values), size=len(values))].mean() for values in sets])
    low, high = np.percentile(means, (2.5, 97.5))
    return f"{short(float(np.mean([values.mean() for values in sets])))} [{short(low)}, {short(high)}]"
