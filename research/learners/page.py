"""``learners.md``: the comparison of learning algorithms, written from curves and episodes alone."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, measured, short, write_rows
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
"""Of pairs that are alike a fifth would be told apart with three trainings of each, a twelfth with four or five (3,000
simulated)."""
_FEW = 100
"""Of fewer episodes no mean is told."""
Found = Mapping[tuple[str, str], Mapping[str, Mapping[str, Sequence[Row]]]]
"""Rows by task and learner or policy, then by training, then by set."""


def write_page(folder: Path, curves: Sequence[Row], rows: Sequence[Row]) -> list[Path]:
    """The page, its pictures, and its files; the paths."""
    write_rows(folder / "learners.csv.gz", rows)
    write_rows(folder / "learners_curves.csv.gz", curves)
    write_text(folder / "learners_marl_eval.json", json.dumps(marl_eval(curves, rows)) + "\n")
    write_text(folder / "learners.md", report(curves, rows))
    shown, pictures = complete(curves, rows), folder / "figures"
    with house_style():
        drawn = [
            draw_curves(*shown, pictures / "learners_curves.png"),
            draw_profiles(against_controller(grouped_rows(shown[1])), pictures / "learners_profiles.png"),
        ]
    names = ("learners.md", "learners.csv.gz", "learners_curves.csv.gz", "learners_marl_eval.json")
    return [*(folder / name for name in names), *drawn]


def complete(curves: Sequence[Row], rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Those of the trainings that all learners have on all tasks, and rows of policies that are not trained here."""
    num = Counter(training for *_, training in {(row["task"], row["learner"], row["training"]) for row in curves})
    shown = {"", *(training for training, learned in num.items() if learned == len(TASKS) * len(LEARNERS))}
    return [row for row in curves if row["training"] in shown], [row for row in rows if row["training"] in shown]


def report(curves: Sequence[Row], rows: Sequence[Row]) -> str:
    """The page's text, on ``complete`` passes."""
    curves, rows = complete(curves, rows)
    rows_by_competitor, num_trainings = (
        grouped_rows(rows),
        len({(row["task"], row["learner"], row["training"]) for row in curves}),
    )
    wanted = len(TASKS) * len(LEARNERS) * TRAININGS
    return Template(read_text("learners", "story.md")).substitute(
        first=_first(rows_by_competitor), tiers=_tiers(rows_by_competitor), safety=_safety(rows_by_competitor), pairs=_pairs(rows_by_competitor), apart=_apart(rows_by_competitor),
        compute=_compute(curves), settings=_settings(), episodes=f"{len(rows):,}", steps=f"{AGENT_STEPS / 1e6:g}",
        minutes=f"{MINUTES:g}", trainings=f"{num_trainings} trainings" + f" so far (of {wanted})" * (num_trainings < wanted),
    )  # fmt: skip


def grouped_rows(rows: Iterable[Row]) -> Found:
    """Rows by where they belong."""
    rows_by_competitor: dict[tuple[str, str], dict[str, dict[str, list[Row]]]] = {}
    for row in rows:
        mine = rows_by_competitor.setdefault((row["task"], row["learner"]), {}).setdefault(row["training"], {})
        mine.setdefault(row["set"], []).append(row)
    return rows_by_competitor


def scores(rows_by_competitor: Found) -> dict[str, Float64]:
    """The headline of each learner's trainings on unseen seeds, shape (training, task)."""
    return {
        competitor: np.concatenate([_values(rows_by_competitor, task, competitor) for task in TASKS], axis=1)
        for competitor in LEARNERS
    }


def ranked(rows_by_competitor: Found) -> dict[str, Float64]:
    """The same in two digits: smaller differences are ties."""
    return {competitor: every.round(2) for competitor, every in scores(rows_by_competitor).items()}


def against_controller(rows_by_competitor: Found) -> dict[str, Float64]:
    """The headline over the best controller's, both above that of ``random``."""
    controller, least = (
        np.array(
            [
                _values(rows_by_competitor, task, competitor).mean()
                for task, competitor in zip(TASKS, names, strict=True)
            ],
            np.float64,
        )
        for names in ([task.policies[0] for task in TASKS.values()], ["random"] * len(TASKS))
    )
    return {
        competitor: (every - least) / (controller - least) for competitor, every in scores(rows_by_competitor).items()
    }


def _values(rows_by_competitor: Found, task: str, competitor: str, name: str = "share", each: str = "") -> Float64:
    """A measure of each training, mean over the episodes of a set, shape (training, 1); on unseen seeds if none."""
    return np.array(
        [[_mean(sets[each or task], name)] for sets in rows_by_competitor[task, competitor].values()], np.float64
    )


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


def _first(rows_by_competitor: Found) -> str:
    """Headline and swarm success on unseen seeds, a column for each task, then all tasks."""
    every, table = against_controller(rows_by_competitor), list[tuple[str, ...]]()
    for competitor, own in scores(rows_by_competitor).items():
        whole = [_values(rows_by_competitor, task, competitor, "swarm_success").mean() for task in TASKS]
        cells = [f"{_with_interval(mean(own[:, k : k + 1]))}, {short(float(share))}" for k, share in enumerate(whole)]
        table.append(
            (
                competitor,
                *cells,
                _with_interval(interquartile_mean(every[competitor])),
                _with_interval(mean(every[competitor])),
            )
        )
    for words in ("best controller", "oracle", "random"):
        named = {name: task.policies[0] if words == "best controller" else words for name, task in TASKS.items()}
        cells = [
            _with_interval(_over_episodes(rows_by_competitor[task, competitor][""][task])) + f", {short(_mean(rows_by_competitor[task, competitor][''][task], 'swarm_success'))}"
            if (task, competitor) in rows_by_competitor else "–"
            for task, competitor in named.items()
        ]  # fmt: skip
        table.append((words, *cells, "", ""))
    return markdown_table(("", *TASKS, "all, IQM", "all, mean"), table)


def _everyone(rows_by_competitor: Found, task: str) -> list[str]:
    """Learners, then policies, then those from elsewhere."""
    return [
        *LEARNERS,
        *(competitor for where, competitor in rows_by_competitor if where == task and competitor not in LEARNERS),
    ]


def _called(competitor: str) -> str:
    """A policy of the package with what it gets beyond sonar; learners and those from elsewhere by their names."""
    return competitor if competitor in LEARNERS or competitor.endswith("(checked)") else named(competitor)


def _tiers(rows_by_competitor: Found) -> str:
    """The headline in each set, a table for each task."""
    tables: list[str] = []
    for task in TASKS.values():
        names = [each.name for each in task.sets]
        rows = [
            (
                _called(competitor),
                *(short(float(_values(rows_by_competitor, task.name, competitor, each=name).mean())) for name in names),
            )
            for competitor in _everyone(rows_by_competitor, task.name)
        ]
        tables.append(markdown_table(("", *names), rows))
    return "\n".join(tables)


def _safety(rows_by_competitor: Found) -> str:
    """Collisions, distances and time on unseen seeds."""
    formats = {
        "collisions_per_vehicle": "{:.3f}", "min_obstacle_distance_m": "{:.1f} m", "min_spacing_m": "{:.1f} m",
        "time_ratio": "{:.2f}",
    }  # fmt: skip
    table: list[tuple[str, ...]] = []
    for task in TASKS:
        for competitor in _everyone(rows_by_competitor, task):
            cells = [
                spec.format(float(np.nanmean(_values(rows_by_competitor, task, competitor, name))))
                if _number(rows_by_competitor, task, competitor, name) >= _FEW else "–"
                for name, spec in formats.items()
            ]  # fmt: skip
            table.append((task, _called(competitor), *cells))
    return markdown_table(("task", "", "collisions", "obstacle distance", "spacing", "time ratio"), table)


def _number(rows_by_competitor: Found, task: str, competitor: str, name: str) -> int:
    """How many episodes on unseen seeds have this measure."""
    return sum(len(measured(sets[task], name)) for sets in rows_by_competitor[task, competitor].values())


def _pairs(rows_by_competitor: Found) -> str:
    """Probability of improvement over all tasks."""
    every = ranked(rows_by_competitor)
    table = [(f"{one} over {other}", _with_interval(improvement(every[one], every[other])))
             for one, other in combinations(LEARNERS, 2)]  # fmt: skip
    return markdown_table(("", "probability"), table)


def _apart(rows_by_competitor: Found) -> str:
    """Pairs that differ significantly on each task: the interval excludes one half."""
    every, table = ranked(rows_by_competitor), list[tuple[str, ...]]()
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
    """Agent-steps and processor time of a training, mean."""
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
    """What differs from the trainers' defaults."""
    table = [
        (each.name, each.trainer, ", ".join(f"`{name}` {value}" for name, value in each.settings.items()) or "none")
        for each in LEARNERS.values()
    ]
    return markdown_table(("", "trainer", "settings"), table)
