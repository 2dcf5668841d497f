"""``learners.md``: who learns what, written from curves and episodes alone."""

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
            draw_profiles(against_law(found_in(shown[1])), pictures / "learners_profiles.png"),
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
    found, made = found_in(rows), len({(row["task"], row["learner"], row["training"]) for row in curves})
    wanted = len(TASKS) * len(LEARNERS) * TRAININGS
    return Template(read_text("learners", "story.md")).substitute(
        first=_first(found), tiers=_tiers(found), safety=_safety(found), pairs=_pairs(found), apart=_apart(found),
        compute=_compute(curves), settings=_settings(), episodes=f"{len(rows):,}", steps=f"{AGENT_STEPS / 1e6:g}",
        minutes=f"{MINUTES:g}", trainings=f"{made} trainings" + f" so far (of {wanted})" * (made < wanted),
    )  # fmt: skip


def found_in(rows: Iterable[Row]) -> Found:
    """Rows by where they belong."""
    found: dict[tuple[str, str], dict[str, dict[str, list[Row]]]] = {}
    for row in rows:
        mine = found.setdefault((row["task"], row["learner"]), {}).setdefault(row["training"], {})
        mine.setdefault(row["set"], []).append(row)
    return found


def scores(found: Found) -> dict[str, Float64]:
    """The headline of each learner's trainings on unseen seeds, shape (training, task)."""
    return {who: np.concatenate([_values(found, task, who) for task in TASKS], axis=1) for who in LEARNERS}


def ranked(found: Found) -> dict[str, Float64]:
    """The same in two digits: smaller differences are ties."""
    return {who: every.round(2) for who, every in scores(found).items()}


def against_law(found: Found) -> dict[str, Float64]:
    """The headline over the best law's, both above what ``random`` has."""
    law, least = (
        np.array([_values(found, task, who).mean() for task, who in zip(TASKS, names, strict=True)], np.float64)
        for names in ([task.policies[0] for task in TASKS.values()], ["random"] * len(TASKS))
    )
    return {who: (every - least) / (law - least) for who, every in scores(found).items()}


def _values(found: Found, task: str, who: str, name: str = "share", each: str = "") -> Float64:
    """A measure of each training, mean over the episodes of a set, shape (training, 1); on unseen seeds if none."""
    return np.array([[_mean(sets[each or task], name)] for sets in found[task, who].values()], np.float64)


def _mean(rows: Sequence[Row], name: str) -> float:
    values = measured(rows, name)
    return float(np.mean(values)) if values else float("nan")


def _told(found: Estimate) -> str:
    return f"{short(found.point)} [{short(found.low)}, {short(found.high)}]"


def _over_episodes(rows: Sequence[Row]) -> Estimate:
    """The mean headline of episodes, with a 95 % interval."""
    values = measured(rows, "share")
    point, half = float(np.mean(values)), 1.96 * float(np.std(values)) / len(values) ** 0.5
    return Estimate(point, max(point - half, 0.0), min(point + half, 1.0))


def _first(found: Found) -> str:
    """Headline and whole swarms on unseen seeds, a column for each task, then all tasks."""
    every, table = against_law(found), list[tuple[str, ...]]()
    for who, own in scores(found).items():
        whole = [_values(found, task, who, "whole").mean() for task in TASKS]
        cells = [f"{_told(mean(own[:, k : k + 1]))}, {short(float(share))}" for k, share in enumerate(whole)]
        table.append((who, *cells, _told(interquartile_mean(every[who])), _told(mean(every[who]))))
    for words in ("the best law", "oracle", "random"):
        named = {name: task.policies[0] if words == "the best law" else words for name, task in TASKS.items()}
        cells = [
            _told(_over_episodes(found[task, who][""][task])) + f", {short(_mean(found[task, who][''][task], 'whole'))}"
            if (task, who) in found else "–"
            for task, who in named.items()
        ]  # fmt: skip
        table.append((words, *cells, "", ""))
    return markdown_table(("", *TASKS, "all, IQM", "all, mean"), table)


def _everyone(found: Found, task: str) -> list[str]:
    """Learners, then policies, then those from elsewhere."""
    return [*LEARNERS, *(who for where, who in found if where == task and who not in LEARNERS)]


def _called(who: str) -> str:
    """A policy of the package with what it gets beyond sonar; learners and those from elsewhere by their names."""
    return who if who in LEARNERS or who.endswith("(checked)") else named(who)


def _tiers(found: Found) -> str:
    """The headline in each set, a table for each task."""
    tables: list[str] = []
    for task in TASKS.values():
        names = [each.name for each in task.sets]
        rows = [
            (_called(who), *(short(float(_values(found, task.name, who, each=name).mean())) for name in names))
            for who in _everyone(found, task.name)
        ]
        tables.append(markdown_table(("", *names), rows))
    return "\n".join(tables)


def _safety(found: Found) -> str:
    """Contacts, distances and time on unseen seeds."""
    ways = {"contacts": "{:.3f}", "to_obstacles": "{:.1f} m", "to_others": "{:.1f} m", "time": "{:.2f}"}
    table: list[tuple[str, ...]] = []
    for task in TASKS:
        for who in _everyone(found, task):
            cells = [
                way.format(float(np.nanmean(_values(found, task, who, name))))
                if _number(found, task, who, name) >= _FEW else "–"
                for name, way in ways.items()
            ]  # fmt: skip
            table.append((task, _called(who), *cells))
    return markdown_table(("task", "", *(name.replace("_", " ") for name in ways)), table)


def _number(found: Found, task: str, who: str, name: str) -> int:
    """How many episodes on unseen seeds have this measure."""
    return sum(len(measured(sets[task], name)) for sets in found[task, who].values())


def _pairs(found: Found) -> str:
    """Probability of improvement over all tasks."""
    every = ranked(found)
    table = [(f"{one} over {other}", _told(improvement(every[one], every[other])))
             for one, other in combinations(LEARNERS, 2)]  # fmt: skip
    return markdown_table(("", "probability"), table)


def _apart(found: Found) -> str:
    """Pairs that are told apart on each task: the interval holds no one half."""
    every, table = ranked(found), list[tuple[str, ...]]()
    if (num := min(map(len, every.values()))) < _ENOUGH:
        return f"Each learner has {num} of {TRAININGS} trainings so far, too few to tell anyone apart.\n"
    for k, task in enumerate(TASKS):
        apart: list[str] = []
        for one, other in combinations(LEARNERS, 2):
            told = improvement(every[one][:, k : k + 1], every[other][:, k : k + 1])
            if told.low > 0.5 or told.high < 0.5:
                apart.append(f"{one} over {other}" if told.low > 0.5 else f"{other} over {one}")
        table.append((task, str(len(apart)), ", ".join(apart) or "–"))
    return markdown_table(("task", "pairs", "told apart"), table)


def _compute(curves: Sequence[Row]) -> str:
    """Agent-steps and processor time of a training, mean."""
    table: list[tuple[str, ...]] = []
    for who in LEARNERS:
        cells: list[str] = []
        for task in TASKS:
            last = {row["training"]: row for row in curves if (row["task"], row["learner"]) == (task, who)}.values()
            steps, minutes = (float(np.mean(measured(last, name))) for name in ("agent_steps", "minutes"))
            cells.append(f"{steps / 1e6:.1f} M, {minutes:.1f} min")
        table.append((who, *cells))
    return markdown_table(("", *TASKS), table)


def _settings() -> str:
    """What differs from the trainers' defaults."""
    table = [
        (each.name, each.by, ", ".join(f"`{name}` {value}" for name, value in each.settings.items()) or "none")
        for each in LEARNERS.values()
    ]
    return markdown_table(("", "trainer", "settings"), table)
