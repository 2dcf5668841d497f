"""Cells: a learner's training on a task with a seed, and the final episodes of its policy."""

import shutil
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from research.data import read_text
from research.episodes import Row, read_rows, write_rows
from research.learners.protocol import AGENT_STEPS, LEARNERS, MINUTES, PROTOCOL, TASKS, EvaluationSet, Learner, Task
from research.learners.squashed import squashed
from research.learners.watch import Report, Trainer, TrainingRequest
from uuv_marl.atomic import write_text
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.benchmark import evaluate
from uuv_marl.benchmark.metrics import Metrics, shares_of
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import Scenario, load_scenario

CURVE, EPISODES = "curve.csv", "episodes.csv"
_TRAINERS = {"own": "research.learners.own", "sb3": "research.learners.sb3", "benchmarl": "research.learners.isac"}
_TRAINED = 0.8
"""Share of the training in a cell's progress; assumed."""
WEIGHTS_FOLDER = Path(__file__).resolve().parent / "policies"
"""Folder of the shipped weights, so that their rows can be run again."""


class Cell(NamedTuple):
    """One training."""

    task: Task
    learner: Learner
    seed: int

    def folder(self, output: Path) -> Path:
        """Folder of the cell."""
        return output / "cells" / self.task.name / f"{self.learner.name}-{self.seed}"

    def policy(self, path: Path) -> str:
        """Name of its policy, by the path of its weights."""
        return squashed(path, self.task.channels) if self.learner.trainer == "benchmarl" else str(path.resolve())

    @property
    def shipped_weights(self) -> Path:
        """Path of its shipped weights, which may not exist."""
        return WEIGHTS_FOLDER / f"{self.task.name}-{self.learner.name}-{self.seed}.safetensors"


def check_protocol(output: Path) -> None:
    """Write the protocol into a new folder. Raises ResultsError if the folder has another one."""
    path, protocol = output / PROTOCOL, read_text("learners", PROTOCOL)
    if not path.exists():
        output.mkdir(parents=True, exist_ok=True)
        write_text(path, protocol)
    elif tomllib.loads(path.read_text(encoding="utf-8")) != tomllib.loads(protocol):
        raise ResultsError(f"{output} was made by another protocol, see {path}; remove it, or give another --output")


def cells(tasks: list[str], learners: list[str], trainings: int) -> list[Cell]:
    """All cells of these tasks and learners, the first seed of each first."""
    chosen = [
        (TASKS[task], LEARNERS[name])
        for task in tasks or TASKS
        for name in learners or LEARNERS
        if name in TASKS[task].learners
    ]
    return [Cell(task, learner, seed) for seed in range(trainings) for task, learner in chosen]


def trainer_of(learner: Learner) -> Trainer:
    """Import the trainer of a learner."""
    learn: Trainer = import_module(_TRAINERS[learner.trainer]).learn
    return learn


def emptied(folder: Path) -> None:
    """Empty a folder."""
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def make(cell: Cell, folder: Path, report: Report) -> None:
    """Train a cell and run its policy; existing files are kept."""
    if not (folder / CURVE).exists():
        emptied(folder)  # of an interrupted training
        spent: Report = lambda share: report(_TRAINED * share)  # noqa: E731
        asked = TrainingRequest(cell.task, cell.seed, folder, cell.learner.settings, AGENT_STEPS, MINUTES, spent)
        curve = trainer_of(cell.learner)(asked)
        write_rows(folder / CURVE, curve)
    if not (folder / EPISODES).exists():
        policy = cell.policy(folder / WEIGHTS_FILE)
        rows = every(cell.task, policy, lambda share: report(_TRAINED + (1.0 - _TRAINED) * share))
        write_rows(folder / EPISODES, rows)


def every(task: Task, policy: str, report: Report) -> Iterator[Row]:
    """A policy's rows on all sets of a task."""
    for k, each in enumerate(task.sets):
        report(k / len(task.sets))
        yield from episodes(policy, each, each.episodes)


def episodes(policy: str, each: EvaluationSet, seeds: range) -> Iterator[Row]:
    """Rows of a policy on the episodes of a set, by seed."""
    scenario = with_policy_requirements(policy, load_scenario(each.scenario, overrides=each.overrides))
    rows = [
        {"set": each.name, "seed": str(run.seed), **measures(run.metrics, scenario)}
        for run in evaluate.episodes(scenario, policy, seeds)
    ]
    yield from sorted(rows, key=lambda row: int(row["seed"]))


MEASURES = (
    "share", "swarm_success", "collisions_per_vehicle", "min_obstacle_distance_m", "min_spacing_m", "time_ratio",
)  # fmt: skip


def measures(metrics: Metrics, scenario: Scenario) -> dict[str, str]:
    """Headline, swarm success, collisions per vehicle, smallest distances [m], and time ratio [1], as texts."""
    share, success = shares_of(metrics, scenario.task_class.headline)
    ratio = metrics["task"].get("time_ratio") if "task" in metrics else None
    if "task" not in metrics and metrics["task_time_s"] is not None:
        ratio = metrics["task_time_s"] / metrics["duration_s"]
    collisions = metrics["collisions"] / scenario.swarm.num_vehicles
    values = (share, float(success), collisions, metrics["min_obstacle_distance_m"], metrics["min_spacing_m"], ratio)
    return {name: "" if v is None else f"{v:.3g}" for name, v in zip(MEASURES, values, strict=True)}


def read(cell: Cell, folder: Path) -> tuple[list[Row], list[Row]]:
    """Curve and episodes of a cell, each row with its task, learner and training."""
    place = {"task": cell.task.name, "learner": cell.learner.name, "training": str(cell.seed)}
    curve, final = (read_rows(folder / name) for name in (CURVE, EPISODES))
    return [{**place, **row} for row in curve], [{**place, **row} for row in final]


def beside(output: Path, report: Report) -> list[Row]:
    """Episodes of the policies to compare with; finished ones are read."""
    todo = [(task, policy) for task in TASKS.values() for policy in task.policies]
    rows: list[Row] = []
    for k, (task, policy) in enumerate(todo):
        report(k / len(todo))
        path = output / "policies" / f"{task.name}-{policy}.csv"
        if not path.exists():
            write_rows(path, every(task, policy, lambda _: None))
        rows += [{"task": task.name, "learner": policy, "training": "", **row} for row in read_rows(path)]
    report(1.0)
    return rows
