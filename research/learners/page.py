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
from research.learners.figures import draw_curves
from research.learners.layout import marl_eval
from research.learners.protocol import AGENT_STEPS, AGGREGATED, FLOOR, LEARNERS, MINUTES, TASKS, TIE, TRAININGS
from research.statistics import Estimate, estimate, improvement, resampled
from research.tasks.page import named
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.style import house_style
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.types import Float64

_ENOUGH = 4
"""Fewest trainings for a comparison. Of pairs of equal learners .19 would differ significantly with three trainings,
.14 with four, .12 with five, .08 with ten."""
_FEW = 100
"""Fewest episodes for a mean."""
_CELLS = sum(len(task.learners) for task in TASKS.values())
"""Trainings with the same seed."""
Groups = Mapping[tuple[str, ...], Sequence[Row]]
"""Rows by task, learner or policy, training, and set."""
Means = Mapping[tuple[str, str], Float64]
"""Of each task and competitor, the means that ``statistics.resampled`` gives, shape (1 + resample, training)."""


def write_page(folder: Path, curves: Sequence[Row], rows: Sequence[Row]) -> list[Path]:
    """Write the page, its picture and its files; return the paths."""
    write_rows(folder / "learners.csv.gz", rows)
    write_rows(folder / "learners_curves.csv.gz", curves)
    write_text(folder / "learners_marl_eval.json", json.dumps(marl_eval(*complete(curves, rows))) + "\n")
    write_text(folder / "learners.md", report(curves, rows))
    with house_style():
        drawn = draw_curves(*complete(curves, rows), folder / "figures" / "learners_curves.png")
    names = ("learners.md", "learners.csv.gz", "learners_curves.csv.gz", "learners_marl_eval.json")
    return [*(folder / name for name in names), drawn]


def complete(curves: Sequence[Row], rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Curves and rows of the trainings that all learners have on all tasks, and rows of other policies."""
    num = Counter(training for *_, training in grouped(curves, "task", "learner", "training"))
    shown = {"", *(training for training, learned in num.items() if learned == _CELLS)}
    return [row for row in curves if row["training"] in shown], [row for row in rows if row["training"] in shown]


def report(curves: Sequence[Row], rows: Sequence[Row]) -> str:
    """The page's text, from ``complete`` trainings."""
    curves, rows = complete(curves, rows)
    groups, num_trainings = by_training(rows), len(grouped(curves, "task", "learner", "training"))
    every, wanted = means(groups), _CELLS * TRAININGS
    partial = f" so far (of {wanted})" * (num_trainings < wanted)
    unseen, *others = (len(each.episodes) for each in next(iter(TASKS.values())).sets)
    return Template(read_text("learners", "story.md")).substitute(
        unseen=unseen, other=others[0],
        first=_first(groups, every), separation=_separation(every), challenge=_challenge(groups, every),
        tiers=_tiers(groups), safety=_safety(groups), pairs=_pairs(every), apart=_apart(every),
        compute=_compute(curves), settings=_settings(), episodes=f"{len(rows):,}", steps=f"{AGENT_STEPS / 1e6:g}",
        minutes=f"{MINUTES:g}", trainings=f"{num_trainings} trainings" + partial,
    )  # fmt: skip


def by_training(rows: Sequence[Row]) -> Groups:
    """Rows by task, learner or policy, training, and set."""
    return grouped(rows, "task", "learner", "training", "set")


def means(groups: Groups) -> Means:
    """The headline of all trainings and policies on unseen seeds, resampled over trainings and maps."""
    found: dict[tuple[str, str], Float64] = {}
    for k, task in enumerate(TASKS):
        competitors = _competitors(groups, task)
        scores = [np.array([_by_seed(rows) for rows in _of(groups, task, one)]) for one in competitors]
        for one, values in zip(competitors, resampled(scores, seed=k), strict=True):
            found[task, one] = values
    return found


def _by_seed(rows: Sequence[Row]) -> list[float]:
    return measured(sorted(rows, key=lambda row: int(row["seed"])), "share")


def against_controller(every: Means, task: str, learner: str) -> Float64:
    """The headline of a learner's trainings over the best controller's, both above that of ``random``."""
    least, controller = every[task, "random"], every[task, TASKS[task].policies[0]]
    return (every[task, learner] - least) / (controller - least)


def compared(every: Means) -> list[str]:
    """The tasks of the aggregates: not those at the floor."""
    return [task for task in AGGREGATED if _best(every, task)[1] >= FLOOR]


def _best(every: Means, task: str) -> tuple[str, float]:
    """The learner with the best mean on a task, and its mean over the best controller's."""
    found = {learner: float(against_controller(every, task, learner)[0].mean()) for learner in LEARNERS}
    best = max(found, key=lambda learner: found[learner])
    return best, found[best]


def _overall(every: Means, learner: str) -> Float64:
    """Scores over the best controller's, mean over trainings and tasks, shape (1 + resample,)."""
    return np.mean([against_controller(every, task, learner).mean(axis=1) for task in compared(every)], axis=0)


def _stacked(every: Means, learner: str) -> Float64:
    """The headline on the tasks of the aggregates, shape (1 + resample, training, task)."""
    return np.stack([every[task, learner] for task in compared(every)], axis=-1)


def _values(groups: Groups, task: str, competitor: str, name: str = "share", each: str = "") -> Float64:
    """A measure of each training, mean over the episodes of a set, shape (training, 1); on unseen seeds if none."""
    return np.array([[_mean(rows, name)] for rows in _of(groups, task, competitor, each)], np.float64)


def _of(groups: Groups, task: str, competitor: str, each: str = "") -> list[Sequence[Row]]:
    """Rows of each training on a set; on unseen seeds if none."""
    return [rows for (*place, _, name), rows in groups.items() if [*place, name] == [task, competitor, each or task]]


def _mean(rows: Sequence[Row], name: str) -> float:
    values = measured(rows, name)
    return float(np.mean(values)) if values else float("nan")


def _with_interval(found: Estimate) -> str:
    return f"{short(found.point)} [{short(found.low)}, {short(found.high)}]"


def _cell(groups: Groups, every: Means, task: str, one: str) -> str:
    """Headline with its interval, and swarm success."""
    if (task, one) not in every:
        return "–"
    success = float(_values(groups, task, one, "swarm_success").mean())
    return f"{_with_interval(estimate(every[task, one].mean(axis=1)))}, {short(success)}"


def _first(groups: Groups, every: Means) -> str:
    """Headline and swarm success on unseen seeds, a column for each task, then all tasks."""
    table = list[tuple[str, ...]]()
    for learner in LEARNERS:
        cells = (_cell(groups, every, task, learner) for task in AGGREGATED)
        table.append((learner, *cells, _with_interval(estimate(_overall(every, learner)))))
    for words in ("best controller", "oracle", "random"):
        ones = ((task, TASKS[task].policies[0] if words == "best controller" else words) for task in AGGREGATED)
        table.append((words, *(_cell(groups, every, *one) for one in ones), ""))
    return markdown_table(("", *AGGREGATED, "mean score"), table)


def _separation(every: Means) -> str:
    """Whether a task separates the learners: the best one against the controller, and the spread of the means."""
    table: list[tuple[str, ...]] = []
    for task in AGGREGATED:
        own = [float(every[task, learner][0].mean()) for learner in LEARNERS]
        best, share = _best(every, task)
        table.append((task, best, short(share), short(max(own) - min(own)), "yes" if task in compared(every) else "no"))
    return markdown_table(("task", "best learner", "its score", "spread", "in the mean score"), table)


def _challenge(groups: Groups, every: Means) -> str:
    """The tasks that are in no aggregate."""
    tables: list[str] = []
    for task in (name for name in TASKS if name not in AGGREGATED):
        rows = [(_called(one), _cell(groups, every, task, one)) for one in _competitors(groups, task)]
        tables.append(markdown_table(("", task), rows))
    return "\n".join(tables)


def _competitors(groups: Groups, task: str) -> list[str]:
    """Learners, then policies."""
    return list(
        dict.fromkeys([*TASKS[task].learners, *(competitor for where, competitor, *_ in groups if where == task)])
    )


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
            rows = [row for own in _of(groups, task, competitor) for row in own]
            found = {name: measured(rows, name) for name in formats}
            cells = [
                formats[name].format(float(np.mean(values))) if len(values) >= _FEW else "–"
                for name, values in found.items()
            ]
            table.append((task, _called(competitor), *cells))
    return markdown_table(("task", "", "collisions", "obstacle distance", "spacing", "time ratio"), table)


def _pairs(every: Means) -> str:
    """Probability of improvement over the tasks of the aggregates."""
    if _few(every):
        return ""
    table = [
        (
            f"{one} over {other}",
            _with_interval(estimate(improvement(_stacked(every, one), _stacked(every, other), TIE))),
        )
        for one, other in combinations(LEARNERS, 2)
    ]
    return markdown_table(("", "probability"), table)


def _few(every: Means) -> int:
    """Number of trainings of each learner, if too few for a comparison; else 0."""
    num = min(values.shape[1] for (_, one), values in every.items() if one in LEARNERS)
    return num * (num < _ENOUGH)


def _apart(every: Means) -> str:
    """Pairs that differ significantly on each task, and those that are equivalent."""
    if num := _few(every):
        return f"Each learner has {num} of {TRAININGS} trainings so far, too few for a comparison.\n"
    table: list[tuple[str, ...]] = []
    for task in compared(every):
        apart, alike = list[str](), list[str]()
        for pair in combinations(LEARNERS, 2):
            one, other = (every[task, learner].mean(axis=1) for learner in pair)
            found = estimate(one - other)
            if found.low > 0.0 or found.high < 0.0:
                apart.append(" over ".join(pair if found.low > 0.0 else pair[::-1]))
            if found.low >= -TIE and found.high <= TIE:
                alike.append(" and ".join(pair))
        table.append((task, str(len(apart)), ", ".join(apart) or "–", ", ".join(alike) or "–"))
    return markdown_table(("task", "pairs", "significantly different", "equivalent"), table)


def _compute(curves: Sequence[Row]) -> str:
    """Mean agent-steps, decisions of a world and processor time of a training."""
    table: list[tuple[str, ...]] = []
    for competitor in LEARNERS:
        cells: list[str] = []
        for task in TASKS:
            if competitor not in TASKS[task].learners:
                cells.append("–")
                continue
            last = {
                row["training"]: row for row in curves if (row["task"], row["learner"]) == (task, competitor)
            }.values()
            steps, minutes = (float(np.mean(measured(last, name))) for name in ("agent_steps", "minutes"))
            worlds = steps / TASKS[task].num_vehicles
            cells.append(f"{steps / 1e6:.1f} M, {worlds / 1e6:.2f} M, {minutes:.1f} min")
        table.append((competitor, *cells))
    return markdown_table(("", *TASKS), table)


def _settings() -> str:
    """Settings that differ from the trainers' defaults."""
    table = [
        (each.name, each.trainer, ", ".join(f"`{name}` {value}" for name, value in each.settings.items()) or "none")
        for each in LEARNERS.values()
    ]
    return markdown_table(("", "trainer", "settings"), table)
