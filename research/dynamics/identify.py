"""Identification: the choice of what the paper leaves out that comes nearest to its numbers of 5.1 and 5.2.1.

The result ships in ``identified/``. Section 5.2.2 was never looked at in the search: there it predicts.
"""

# pyright: reportUnknownMemberType=false
# Matplotlib and Optuna leave the types of their keyword arguments open.

import json
import platform
from collections.abc import Callable, Sequence
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from research.columns import Columns, columns, read_columns, write_columns, written
from research.dynamics import unknowns
from research.dynamics.unknowns import DEFAULTS, OBJECTIVES, SEARCHED, SEEDS, UNKNOWNS, Numbers, Value
from research.paper.cases import SCENARIOS
from research.part import Part, Share, Tables
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, GREEN, ORANGE, legend, panels
from uuv_marl.benchmark.suite import Suite
from uuv_marl.benchmark.tuning import search

TRIALS = 600
STARTUP = 60
"""Trials drawn at random before the optimiser learns from them."""
GOAL = 0.05
_SHIPPED = resources.files("research.dynamics") / "identified"


@cache
def identified() -> dict[str, Any]:
    """The result that ships with the package, as ``_summary`` makes it."""
    return json.loads((_SHIPPED / "identified.json").read_text(encoding="utf-8"))


def identify(output: Path, trials: int, report: Callable[[int, float], None]) -> Path:
    """Search the unknowns; an interrupted search continues with the same random numbers. Needs the extra ``tune``.

    Writes ``output/identified.json`` with the Pareto front and the point of the smallest largest error, and
    ``trials.csv`` with every trial, and keeps Optuna's journal beside them. ``report`` is called with the number of
    trials done and the smallest largest error so far.
    """
    import optuna  # noqa: PLC0415 - an extra

    def objective(trial: optuna.Trial) -> tuple[float, ...]:
        values = {name: _draw(trial, name) for name in UNKNOWNS}
        numbers = unknowns.measure(values)
        trial.set_user_attr("values", values)
        trial.set_user_attr("numbers", [None if np.isnan(number) else number for number in numbers])
        return unknowns.errors(numbers)

    def sampler(seed: int) -> optuna.samplers.BaseSampler:
        # Without constant_liar interrupted trials are ignored, so a resumed search draws the same numbers.
        return optuna.samplers.TPESampler(seed=seed, multivariate=True, n_startup_trials=STARTUP, constant_liar=False)

    finished = search(output, "identify", trials, objective, sampler, report, len(OBJECTIVES), DEFAULTS)
    table = _table([trial.user_attrs for trial in finished])
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
SETS = tuple(
    (name, case)
    for default in SCENARIOS
    for name, case in (
        ("default", default),
        ("identified", unknowns.case(identified()["chosen"]["values"], default.scenario)),
    )
)
"""By scenario; of the identified ones the last is predicted, since section 5.2.2 was never looked at."""


def tables(suite: Suite, _report: Share) -> Tables:
    """Every trial of the search, and every seed of all parameter sets."""
    rows = [
        {"parameters": name, "scenario": case.scenario, "seed": seed, **dict(zip(METRICS, values, strict=True))}
        for name, case in SETS
        for seed, *values in zip(suite.seeds, *(suite.metric(case, metric) for metric in METRICS), strict=True)
    ]
    return {"identification-trials": trials(), "identification": columns(rows)}


def draw(computed: Tables) -> Figure:
    """The paper's numbers under every trial that arrives without a collision, beside the paper's own."""
    table = computed["identification-trials"]
    members, chosen = pareto(table)
    safe = table["failed"] == 0
    spacing, obstacle = PAPER["tracking", "bio_inspired"], PAPER["single_obstacle", "bio_inspired"]
    figure, axes = panels(2, size=(5.25, 4.7))
    for ax, (x, x_words), (y, y_words) in (
        (axes[0], ("mean_min_spacing_m", "tracking: time mean of the smallest spacing [m]"),
         ("min_obstacle_distance_m", "single_obstacle: smallest distance to the obstacle [m]")),
        (axes[1], ("min_spacing_m", "tracking: smallest spacing [m]"),
         ("task_time_s", "single_obstacle: task time [s]")),
    ):  # fmt: skip
        ax.plot(table[x][safe], table[y][safe], ".", color="0.72", label="trial")
        for rows, mark, colour, size, label in (
            (members, "o", BLUE, 6, "Pareto front"),
            ([0], "s", ORANGE, 9, "defaults"),
            ([chosen], "*", GREEN, 16, "chosen"),
        ):
            ax.plot(table[x][rows], table[y][rows], mark, color=colour, ms=size, mec=BLACK, mew=0.5, label=label)
        ax.add_patch(_box(spacing.values(x), obstacle.values(y)))
        ax.set(xlabel=x_words, ylabel=y_words)
    return legend(figure)


def _box(across: Sequence[float], up: Sequence[float]) -> Rectangle:
    """The paper's numbers, 5 % wider: the target of a reproduction."""
    (left, right), (low, high) = ((min(values) * (1 - GOAL), max(values) * (1 + GOAL)) for values in (across, up))
    return Rectangle((left, low), right - left, high - low, fill=False, ec="black", ls="--", lw=1.3, label="paper, 5 %")


def _draw(trial: Any, name: str) -> Value:
    """One unknown of a trial, floats rounded to four digits, as they are written."""
    unknown = UNKNOWNS[name]
    if unknown.choices:
        return trial.suggest_categorical(name, unknown.choices)
    if isinstance(unknown.default, int):
        return trial.suggest_int(name, int(unknown.low), int(unknown.high))
    return float(f"{trial.suggest_float(name, unknown.low, unknown.high, log=unknown.log):.4g}")


def _table(trial_rows: Sequence[dict[str, Any]]) -> Columns:
    """The table of each trial's values and numbers."""
    numbers = [Numbers(*(np.nan if number is None else number for number in one["numbers"])) for one in trial_rows]
    return columns(
        {"trial": k, **one["values"], **each._asdict(), **dict(zip(OBJECTIVES, unknowns.errors(each), strict=True))}
        for k, (one, each) in enumerate(zip(trial_rows, numbers, strict=True))
    )


def _summary(table: Columns, optimiser: str) -> dict[str, Any]:
    members, chosen = pareto(table)
    return {
        "objectives": "relative errors against the paper's 5.1 and 5.2.1 with Table 2, of means over seeds; "
        "spacing_error is the larger of two, distance_error is 0 between the paper's two numbers",
        "scenarios": list(SEARCHED),
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
    extent = ("choices",) if UNKNOWNS[name].choices else ("low", "high", "log")
    return {key: getattr(UNKNOWNS[name], key) for key in ("meaning", "unit", "default", *extent)}


def _member(table: Columns, row: int) -> dict[str, Any]:
    parts = {"values": UNKNOWNS, "numbers": Numbers._fields, "errors": OBJECTIVES}
    return {"trial": row} | {
        part: {name: written(table[name][row].item()) for name in names} for part, names in parts.items()
    }


PART = Part("identification", tuple(case for _, case in SETS), tables, draw)
