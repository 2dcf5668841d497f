"""``learners.md``: the comparison of learning algorithms, written from curves and episodes alone."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, grouped, measured, short, write_rows
from research.learners.figures import draw_curves, draw_profiles
from research.learners.layout import marl_eval
from research.learners.protocol import AGENT_STEPS, LEARNERS, MINUTES, TASKS, TRAININGS
from research.learners.statistics import Estimate, improvement, interquartile_mean, mean
from research.tasks.page import named
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.style import house_style
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.types import Float64

_ENOUGH = 4
"""Fewest trainings for a comparison. With three, a fifth of equal pairs differ significantly, with four or five a
twelfth (3,000 simulated)."""
_FEW = 100
"""Fewest episodes for a mean."""
Groups = Mapping[tuple[str, ...], Sequence[Row]]
"""Rows by task, learner or policy, training, and set."""


def write_page(folder: Path, curves: Sequence[Row], rows: Sequence[Row]) -> list[Path]:
    """Write the page, its pictures and its files; return the paths."""
    write_rows(folder / "learners.csv.gz", rows)
    write_rows(folder / "learners_curves.csv.gz", curves)
    write_text(folder / "learners_marl_eval.json", json.dumps(marl_eval(curves, rows)) + "\n")
    write_text(folder / "learners.md", report(curves, rows))
    shown, pictures = complete(curves, rows), folder / "figures"
    with house_style():
        drawn = [
            draw_curves(*shown, pictures / "learners_curves.png"),
            draw_profiles(against_controller(by_training(shown[1])), pictures / "learners_profiles.png"),
        ]
    names = ("learners.md", "learners.csv.gz", "learners_curves.csv.gz", "learners_marl_eval.json")
    return [*(folder / name for name in names), *drawn]


def complete(curves: Sequence[Row], rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Curves and rows of the trainings that all learners have on all tasks, and rows of other policies."""
    num = Counter(training for *_, training in grouped(curves, "task", "learner", "training"))
    shown = {"", *(training for training, learned in num.items() if learned == len(TASKS) * len(LEARNERS))}
    return [row for row in curves if row["training"] in shown], [row for row in rows if row["training"] in shown]


def report(curves: Sequence[Row], rows: Sequence[Row]) -> str:
    """The page's text, from ``complete`` trainings."""
    curves, rows = complete(curves, rows)
    groups, num_trainings = by_training(rows), len(grouped(curves, "task", "learner", "training"))
    wanted = len(TASKS) * len(LEARNERS) * TRAININGS
    partial = f" so far (of {wanted})" * (num_trainings < wanted)
    return Template(read_text("learners", "story.md")).substitute(
        first=_first(groups), tiers=_tiers(groups), safety=_safety(groups), pairs=_pairs(groups), apart=_apart(groups),
        compute=_compute(curves), settings=_settings(), episodes=f"{len(rows):,}", steps=f"{AGENT_STEPS / 1e6:g}",
        minutes=f"{MINUTES:g}", trainings=f"{num_trainings} trainings" + partial,
    )  # fmt: skip


def by_training(rows: Sequence[Row]) -> Groups:
    """Rows by task, learner or policy, training, and set."""
    return grouped(rows, "task", "learner", "training", "set")


def scores(groups: Groups) -> dict[str, Float64]:
    """The headline of each learner's trainings on unseen seeds, shape (training, task)."""
    return {
        competitor: np.concatenate([_values(groups, task, competitor) for task in TASKS], axis=1)
        for competitor in LEARNERS
    }


def ranked(groups: Groups) -> dict[str, Float64]:
    """``scores`` in two digits, so that smaller differences are ties."""
    return {competitor: every.round(2) for competitor, every in scores(groups).items()}


def against_controller(groups: Groups) -> dict[str, Float64]:
    """The headline over the best controller's, both above that of ``random``."""
    controller, least = (
        np.array([_values(groups, name, policy or task.policies[0]).mean() for name, task in TASKS.items()])
        for policy in ("", "random")
    )
    return {competitor: (every - least) / (controller - least) for competitor, every in scores(groups).items()}


def _values(groups: Groups, task: str, competitor: str, name: str = "share", each: str = "") -> Float64:
    """A measure of each training, mean over the episodes of a set, shape (training, 1); on unseen seeds if none."""
    return np.array([[_mean(rows, name)] for rows in _of(groups, task, competitor, each)], np.float64)


def _of(groups: Groups, task: str, competitor: str, each: str = "") -> list[Sequence[Row]]:
    """Rows of each training on a set; on unseen seeds if none."""
    return [rows for (*place, _, name), rows in groups.items() if [*place, name] == [task, competitor, each or task]]


def _mean(rows: Sequence[Row], name: str) -> float:
    values = measured(rows, name)
    return float(np.mean(values)) if values else float("nan")


def _with_interval(estimate: Estimate) -> str:
    return f"{short(estimate.point)} [{short(estimate.low)}, {short(estimate.high)}]"


def _over_episodes(rows: Sequence[Row]) -> Estimate:
    """The mean headline of episodes, with a 95 % interval."""
    values = measured(rows, "share")
    point, half = float(np.mean(values)), 1.96 * float(np.std(values)) / len(values) ** 0.5
    return Estimate(point, max(point - half, 0.0), min(point + half, 1.0))


def _first(groups: Groups) -> str:
    """Headline and swarm success on unseen seeds, a column for each task, then all tasks."""
    every, table = against_controller(groups), list[tuple[str, ...]]()
    for competitor, own in scores(groups).items():
        shares = [_values(groups, task, competitor, "swarm_success").mean() for task in TASKS]
        cells = [f"{_with_interval(mean(own[:, k : k + 1]))}, {short(float(share))}" for k, share in enumerate(shares)]
        overall = [_with_interval(statistic(every[competitor])) for statistic in (interquartile_mean, mean)]
        table.append((competitor, *cells, *overall))
    for words in ("best controller", "oracle", "random"):
        policies = [task.policies[0] if words == "best controller" else words for task in TASKS.values()]
        rows = [groups.get((task, policy, "", task)) for task, policy in zip(TASKS, policies, strict=True)]
        cells = [f"{_with_interval(_over_episodes(r))}, {short(_mean(r, 'swarm_success'))}" if r else "–" for r in rows]
        table.append((words, *cells, "", ""))
    return markdown_table(("", *TASKS, "all, IQM", "all, mean"), table)


def _competitors(groups: Groups, task: str) -> list[str]:
    """Learners, then policies."""
    return list(dict.fromkeys([*LEARNERS, *(competitor for where, competitor, *_ in groups if where == task)]))


def _called(competitor: str) -> str:
    """Name of a competitor, for a policy of the package with its extra observations."""
    return competitor if competitor in LEARNERS else named(competitor)


def _tiers(groups: Groups) -> str:
    """The headline in each set, a table for each task."""
    tables: list[str] = []
    for task in TASKS.values():
        names = [each.name for each in task.sets]
        rows = [
            (_called(one), *(short(float(_values(groups, task.name, one, each=name).mean())) for name in names))
            for one in _competitors(groups, task.name)
        ]
        tables.append(markdown_table(("", *names), rows))
    return "\n".join(tables)


def _safety(groups: Groups) -> str:
    """Collisions, distances and time on unseen seeds."""
    formats = {
        "collisions_per_vehicle": "{:.3f}", "min_obstacle_distance_m": "{:.1f} m", "min_spacing_m": "{:.1f} m",
        "time_ratio": "{:.2f}",
    }  # fmt: skip
    table: list[tuple[str, ...]] = []
    for task in TASKS:
        for competitor in _competitors(groups, task):
            cells = [
                spec.format(float(np.nanmean(_values(groups, task, competitor, name))))
                if sum(len(measured(rows, name)) for rows in _of(groups, task, competitor)) >= _FEW else "–"
                for name, spec in formats.items()
            ]  # fmt: skip
            table.append((task, _called(competitor), *cells))
    return markdown_table(("task", "", "collisions", "obstacle distance", "spacing", "time ratio"), table)


def _pairs(groups: Groups) -> str:
    """Probability of improvement over all tasks."""
    every = ranked(groups)
    table = [(f"{one} over {other}", _with_interval(improvement(every[one], every[other])))
             for one, other in combinations(LEARNERS, 2)]  # fmt: skip
    return markdown_table(("", "probability"), table)


def _apart(groups: Groups) -> str:
    """Pairs that differ significantly on each task: the interval excludes one half."""
    every, table = ranked(groups), list[tuple[str, ...]]()
    if (num := min(map(len, every.values()))) < _ENOUGH:
        return f"Each learner has {num} of {TRAININGS} trainings so far, too few for a comparison.\n"
    for k, task in enumerate(TASKS):
        apart: list[str] = []
        for one, other in combinations(LEARNERS, 2):
            estimate = improvement(every[one][:, k : k + 1], every[other][:, k : k + 1])
            if estimate.low > 0.5 or estimate.high < 0.5:
                apart.append(f"{one} over {other}" if estimate.low > 0.5 else f"{other} over {one}")
        table.append((task, str(len(apart)), ", ".join(apart) or "–"))
    return markdown_table(("task", "pairs", "significantly different"), table)


def _compute(curves: Sequence[Row]) -> str:
    """Mean agent-steps and processor time of a training."""
    table: list[tuple[str, ...]] = []
    for competitor in LEARNERS:
        cells: list[str] = []
        for task in TASKS:
            last = {
                row["training"]: row for row in curves if (row["task"], row["learner"]) == (task, competitor)
            }.values()
            steps, minutes = (float(np.mean(measured(last, name))) for name in ("agent_steps", "minutes"))
            cells.append(f"{steps / 1e6:.1f} M, {minutes:.1f} min")
        table.append((competitor, *cells))
    return markdown_table(("", *TASKS), table)


def _settings() -> str:
    """Settings that differ from the trainers' defaults."""
    table = [
        (each.name, each.trainer, ", ".join(f"`{name}` {value}" for name, value in each.settings.items()) or "none")
        for each in LEARNERS.values()
    ]
    return markdown_table(("", "trainer", "settings"), table)
