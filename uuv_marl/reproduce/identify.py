"""Identification: the choice of what the paper leaves out that comes nearest to its numbers of 5.1 and 5.2.1.

The result ships in ``identified/``. Section 5.2.2 was never looked at in the search: there it predicts.
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
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.figures import COLOURS
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.reproduce import unknowns
from uuv_marl.reproduce.columns import Columns, read_columns, write_columns
from uuv_marl.reproduce.unknowns import DEFAULTS, OBJECTIVES, SCENARIOS, SEEDS, UNKNOWNS, Numbers, Setting, Value

TRIALS = 600
STARTUP = 60
"""Trials drawn at random before the optimiser learns from them."""
GOAL = 0.05
_STUDY = "identify"


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
    data = json.loads(_shipped("identified.json").read_text(encoding="utf-8"))
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
    with resources.as_file(_shipped("trials.csv")) as path:
        return read_columns(path)


def pareto(table: Columns) -> tuple[list[int], int]:
    """Rows of the Pareto front among trials, and the chosen one: the smallest largest error."""
    losses = np.stack([table[name] for name in OBJECTIVES], axis=1)
    return unknowns.front(losses), unknowns.best(losses)


def draw(table: Columns) -> Figure:
    """The paper's numbers under every trial that arrives without a collision, beside the paper's own."""
    members, chosen = pareto(table)
    figure = Figure(figsize=(10.5, 5.0), layout="constrained")
    left, right = cast(Sequence[Axes], figure.subplots(1, 2))
    spacing, obstacle = PAPER["tracking", "bio_inspired"], PAPER["single_obstacle", "bio_inspired"]
    distances = obstacle.min_obstacle_distance_m or ()
    _panel(left, table, members, chosen, ("mean_min_spacing_m", "min_obstacle_distance_m"))
    _box(left, (spacing.mean_min_spacing_m,), distances)
    left.set_xlabel("tracking: time mean of the smallest spacing [m]")
    left.set_ylabel("single_obstacle: smallest distance to the obstacle [m]")
    _panel(right, table, members, chosen, ("min_spacing_m", "task_time_s"))
    _box(right, (spacing.min_spacing_m,), (obstacle.task_time_s,))
    right.set_xlabel("tracking: smallest spacing [m]")
    right.set_ylabel("single_obstacle: task time [s]")
    failing = int((table["failed"] > 0).sum())
    figure.suptitle(
        f"Identification, {len(table['trial'])} trials, {failing} of them not shown (a collision, or no arrival); "
        f"means over {len(SEEDS)} seeds",
        fontsize=10,
    )
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9)
    return figure


def _panel(ax: Axes, table: Columns, members: Sequence[int], chosen: int, names: tuple[str, str]) -> None:
    x, y = (table[name] for name in names)
    safe = table["failed"] == 0
    ax.plot(x[safe], y[safe], ".", color="0.72", ms=4, label="trial")
    ax.plot(x[members], y[members], "o", color=COLOURS[0], ms=6, mec="white", mew=0.5, label="Pareto front")
    ax.plot(x[0], y[0], "s", color=COLOURS[1], ms=9, mec="black", label="defaults")
    ax.plot(x[chosen], y[chosen], "*", color=COLOURS[2], ms=16, mec="black", label="chosen")
    ax.grid(alpha=0.25)


def _box(ax: Axes, across: Sequence[float | None], up: Sequence[float | None]) -> None:
    """The paper's numbers, 5 % wider: what a reproduction should hit."""
    (left, right), (low, high) = (
        (min(v for v in values if v) * (1 - GOAL), max(v for v in values if v) * (1 + GOAL)) for values in (across, up)
    )
    box = Rectangle((left, low), right - left, high - low, fill=False, ec="black", ls="--", lw=1.3, label="paper, 5 %")
    ax.add_patch(box)


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


def _shipped(name: str) -> Any:
    return resources.files("uuv_marl.reproduce") / "identified" / name
