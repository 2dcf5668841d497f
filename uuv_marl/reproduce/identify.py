"""Identification: the choice of what the paper leaves out that comes nearest to its numbers of 5.1 and 5.2.1.

The result ships in ``identified/``. Section 5.2.2 was never looked at in the search: there it predicts. Beside it
stands a hypothesis that was found with all numbers in view.
"""

# pyright: reportUnknownMemberType=false
# Matplotlib and Optuna leave the types of their keyword arguments open.

import json
import platform
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, GREEN, ORANGE, legend, panels
from uuv_marl.reproduce import unknowns
from uuv_marl.reproduce.study import (
    MULTI,
    SINGLE,
    TRACKING,
    Case,
    Columns,
    Part,
    Report,
    Study,
    Tables,
    read_columns,
    stack,
    write_columns,
)
from uuv_marl.reproduce.unknowns import DEFAULTS, OBJECTIVES, SCENARIOS, SEEDS, UNKNOWNS, Numbers, Setting, Value

TRIALS = 600
STARTUP = 60
"""Trials drawn at random before the optimiser learns from them."""
GOAL = 0.05
_STUDY = "identify"
_SHIPPED = resources.files("uuv_marl.reproduce") / "identified"


class Identified(NamedTuple):
    """The shipped result."""

    values: dict[str, Value]
    """The chosen point, by the names of ``UNKNOWNS``."""
    setting: Setting
    """The same as overrides of a scenario and parameters of the policy."""
    errors: dict[str, float]
    """By objective, relative, means over the search's seeds."""
    reached: bool
    """Whether all errors are within 5 %."""
    front: list[dict[str, Any]]
    """Members of the Pareto front: number of the trial, values, numbers and errors."""


@cache
def identified() -> Identified:
    """The result that ships with the package."""
    data = json.loads((_SHIPPED / "identified.json").read_text(encoding="utf-8"))
    values = cast(dict[str, Value], data["chosen"]["values"])
    return Identified(
        values, unknowns.setting(values), data["chosen"]["errors"], data["all_within_5_percent"], data["front"]
    )


def identify(output: Path, trials: int, report: Callable[[int, float], None]) -> Path:
    """Search the unknowns; interrupted, the same call goes on with the same draws. Needs the extra ``tune``.

    Writes ``output/identified.json`` with the Pareto front and the point of the smallest largest error, and
    ``trials.csv`` with every trial, and keeps Optuna's journal beside them. ``report`` is called with the number of
    trials done and the smallest largest error so far.
    """
    import optuna  # noqa: PLC0415 - an extra
    from optuna.storages.journal import JournalFileBackend  # noqa: PLC0415

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    output.mkdir(parents=True, exist_ok=True)
    storage = optuna.storages.JournalStorage(JournalFileBackend(str(output / f"{_STUDY}.journal")))

    def objective(trial: optuna.Trial) -> tuple[float, float, float]:
        values = {name: _draw(trial, name) for name in UNKNOWNS}
        numbers = unknowns.measure(values)
        trial.set_user_attr("values", values)
        trial.set_user_attr("numbers", [None if np.isnan(number) else number for number in numbers])
        return unknowns.errors(numbers)

    directions = [optuna.study.StudyDirection.MINIMIZE for _ in OBJECTIVES]
    study = optuna.create_study(storage=storage, study_name=_STUDY, directions=directions, load_if_exists=True)
    complete, waiting = (optuna.trial.TrialState.COMPLETE,), (optuna.trial.TrialState.WAITING,)
    while (done := len(study.get_trials(states=complete))) < trials:
        if not done and not study.get_trials(states=waiting):
            study.enqueue_trial(dict(DEFAULTS))
        # One sampler seed per trial, and no heed of trials that were cut off: a resumed search draws what an
        # uninterrupted one draws.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            sampler = optuna.samplers.TPESampler(
                seed=done, multivariate=True, n_startup_trials=STARTUP, constant_liar=False
            )
        study = optuna.load_study(study_name=_STUDY, storage=storage, sampler=sampler)
        study.optimize(objective, n_trials=1)
        report(done + 1, min(max(trial.values) for trial in study.get_trials(states=complete)))
    finished = study.get_trials(states=complete)
    table = _table([t.user_attrs["values"] for t in finished], [t.user_attrs["numbers"] for t in finished])
    write_columns(output / "trials.csv", table)
    optimiser = f"Optuna {optuna.__version__}, multi-objective TPESampler(multivariate=True, "
    optimiser += f"n_startup_trials={STARTUP}), seeded by the number of trials before; the first trial is the defaults"
    path = output / "identified.json"
    write_text(path, json.dumps(_summary(table, optimiser), indent=1) + "\n")
    return path


def trials() -> Columns:
    """The shipped trials: a row each, its unknowns, the paper's numbers under them, and the errors."""
    with resources.as_file(_SHIPPED / "trials.csv") as path:
        return read_columns(path)


def pareto(table: Columns) -> tuple[list[int], int]:
    """Rows of the Pareto front among trials, and the chosen one: the smallest largest error."""
    losses = np.stack([table[name] for name in OBJECTIVES], axis=1)
    return unknowns.front(losses), unknowns.best(losses)


METRICS = ("min_spacing_m", "mean_min_spacing_m", "min_obstacle_distance_m", "task_time_s", "collisions")
HYPOTHESIS: dict[str, object] = {"sonar.arrays.bow.range_m": 190.0}
"""Found afterwards, with all numbers in view and against Table 1's D_i = 100 m: what would reconcile them."""
FEWER = {"swarm.num_vehicles": 45}
"""The same for section 5.1, which names no number of vehicles."""


def _sets(case: Case) -> dict[str, Case]:
    """A case under each set of parameters."""
    chosen = identified().setting
    posthoc = HYPOTHESIS | FEWER if case is TRACKING else HYPOTHESIS
    return {
        "default": case,
        "identified": Case(f"identified {case.name}", case.scenario, "bio_inspired", chosen.overrides, chosen.policy),
        "post hoc": Case(f"posthoc {case.name}", case.scenario, "bio_inspired", posthoc),
    }


SETS = tuple(_sets(case) for case in (TRACKING, SINGLE, MULTI))
"""By scenario; of the identified ones the last is predicted, since section 5.2.2 was never looked at."""


def tables(study: Study, _report: Report) -> Tables:
    """Every trial of the search, and every seed of all parameter sets."""
    rows: list[Columns] = [
        {
            "parameters": np.full(len(study.seeds), name),
            "scenario": np.full(len(study.seeds), case.scenario),
            "seed": np.arange(len(study.seeds)),
            **{metric: study.metric(case, metric) for metric in METRICS},
        }
        for sets in SETS
        for name, case in sets.items()
    ]
    return {"identification-trials": trials(), "identification": stack(rows)}


def draw(made: Tables) -> Figure:
    """The paper's numbers under every trial that arrives without a collision, beside the paper's own."""
    table = made["identification-trials"]
    members, chosen = pareto(table)
    safe = table["failed"] == 0
    spacing, obstacle = PAPER["tracking", "bio_inspired"], PAPER["single_obstacle", "bio_inspired"]
    mean, smallest = (spacing.mean_min_spacing_m,), (spacing.min_spacing_m,)
    figure, axes = panels(2, size=(5.25, 4.7))
    for ax, (x, x_paper, x_words), (y, y_paper, y_words) in (
        (axes[0], ("mean_min_spacing_m", mean, "tracking: time mean of the smallest spacing [m]"),
         ("min_obstacle_distance_m", obstacle.min_obstacle_distance_m or (),
          "single_obstacle: smallest distance to the obstacle [m]")),
        (axes[1], ("min_spacing_m", smallest, "tracking: smallest spacing [m]"),
         ("task_time_s", (obstacle.task_time_s,), "single_obstacle: task time [s]")),
    ):  # fmt: skip
        ax.plot(table[x][safe], table[y][safe], ".", color="0.72", label="trial")
        for rows, mark, colour, size, label in (
            (members, "o", BLUE, 6, "Pareto front"),
            ([0], "s", ORANGE, 9, "defaults"),
            ([chosen], "*", GREEN, 16, "chosen"),
        ):
            ax.plot(table[x][rows], table[y][rows], mark, color=colour, ms=size, mec=BLACK, mew=0.5, label=label)
        ax.add_patch(_box(x_paper, y_paper))
        ax.set_xlabel(x_words)
        ax.set_ylabel(y_words)
    legend(figure)
    return figure


def _box(across: Sequence[float | None], up: Sequence[float | None]) -> Rectangle:
    """The paper's numbers, 5 % wider: what a reproduction should hit."""
    (left, right), (low, high) = (
        (min(v for v in values if v) * (1 - GOAL), max(v for v in values if v) * (1 + GOAL)) for values in (across, up)
    )
    return Rectangle((left, low), right - left, high - low, fill=False, ec="black", ls="--", lw=1.3, label="paper, 5 %")


def _draw(trial: Any, name: str) -> Value:
    """One unknown of a trial, floats in four digits, so that what is written down is what was run."""
    unknown = UNKNOWNS[name]
    if unknown.choices:
        return trial.suggest_categorical(name, unknown.choices)
    if isinstance(unknown.default, int):
        return trial.suggest_int(name, int(unknown.low), int(unknown.high))
    return float(f"{trial.suggest_float(name, unknown.low, unknown.high, log=unknown.log):.4g}")


def _table(values: Sequence[Mapping[str, Value]], numbers: Sequence[Sequence[float | None]]) -> Columns:
    measured = [Numbers(*(np.nan if number is None else number for number in row)) for row in numbers]
    losses = [unknowns.errors(row) for row in measured]
    table: Columns = {"trial": np.arange(len(values))}
    table |= {name: np.array([row[name] for row in values]) for name in UNKNOWNS}
    table |= {name: np.array([getattr(row, name) for row in measured]) for name in Numbers._fields}
    return table | {name: np.array([row[k] for row in losses]) for k, name in enumerate(OBJECTIVES)}


def _summary(table: Columns, optimiser: str) -> dict[str, Any]:
    members, chosen = pareto(table)
    return {
        "objectives": "relative errors against the paper's 5.1 and 5.2.1 with Table 2, of means over seeds; "
        "spacing_error is the larger of two, distance_error is 0 between the paper's two numbers",
        "scenarios": list(SCENARIOS),
        "seeds": list(SEEDS),
        "trials": len(table["trial"]),
        "optimiser": optimiser,
        "versions": {
            "python": platform.python_version(),
            **{name: metadata.version(name) for name in ("uuv_marl", "numpy", "numba", "optuna")},
        },
        "space": {name: _described(name) for name in UNKNOWNS},
        "all_within_5_percent": bool(max(table[name][chosen] for name in OBJECTIVES) <= GOAL),
        "chosen": _member(table, chosen),
        "defaults": _member(table, 0),
        "front": [_member(table, row) for row in members],
    }


def _described(name: str) -> dict[str, Any]:
    unknown = UNKNOWNS[name]
    extent: dict[str, Any] = (
        {"choices": list(unknown.choices)}
        if unknown.choices
        else {"low": unknown.low, "high": unknown.high, "log": unknown.log}
    )
    return {"meaning": unknown.meaning, "unit": unknown.unit, "default": unknown.default, **extent}


def _member(table: Columns, row: int) -> dict[str, Any]:
    def part(names: Sequence[str]) -> dict[str, Any]:
        found = {name: table[name][row].item() for name in names}
        return {name: float(f"{value:.6g}") if isinstance(value, float) else value for name, value in found.items()}

    return {"trial": row, "values": part(list(UNKNOWNS)), "numbers": part(Numbers._fields), "errors": part(OBJECTIVES)}


PART = Part("identification", tuple(case for sets in SETS for case in sets.values()), tables, draw)
