"""Cells: a learner's training on a task with a seed, and what its policy does in the final episodes."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from research.episodes import Row, measured, read_rows, write_rows
from research.learners.protocol import AGENT_STEPS, LEARNERS, MINUTES, TASKS, Learner, Task
from research.learners.squashed import FILE
from research.learners.watch import Report, Trainer
from research.sets import EpisodeSet
from uuv_marl.baselines import granted
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.validation import shares_of

CURVE, EPISODES = "curve.csv", "episodes.csv"
_TRAINERS = {"own": "research.learners.own", "sb3": "research.learners.sb3", "benchmarl": "research.learners.masac"}
_TRAINED = 0.8
"""Share of a cell's progress that the training is; assumed."""


class Cell(NamedTuple):
    """One training."""

    task: Task
    learner: Learner
    seed: int

    def folder(self, output: Path) -> Path:
        """Where it lies."""
        return output / "cells" / self.task.name / f"{self.learner.name}-{self.seed}"

    def policy(self, folder: Path) -> str:
        """The name of what it made."""
        path = folder.resolve() / FILE
        return f"research.learners.squashed:Squashed,path={path}" if self.learner.by == "benchmarl" else str(path)


def cells(tasks: list[str], learners: list[str], trainings: int) -> list[Cell]:
    """All cells of these tasks and learners, the first seed of each first."""
    chosen = [(TASKS[task], LEARNERS[name]) for task in tasks or TASKS for name in learners or LEARNERS]
    return [Cell(task, learner, seed) for seed in range(trainings) for task, learner in chosen]


def make(cell: Cell, folder: Path, report: Report) -> None:
    """Train it, and run its policy; what is there already stays."""
    if not (folder / CURVE).exists():
        for path in sorted(folder.rglob("*"), reverse=True):  # of a training that was cut off
            if path.name.startswith("."):
                continue
            path.rmdir() if path.is_dir() else path.unlink()
        learn: Trainer = import_module(_TRAINERS[cell.learner.by]).learn
        curve = learn(cell.task, cell.seed, folder, {**cell.learner.settings}, AGENT_STEPS, MINUTES,
                      lambda share: report(_TRAINED * share))  # fmt: skip
        write_rows(folder / CURVE, curve)
    if not (folder / EPISODES).exists():
        write_rows(folder / EPISODES, _episodes(cell, folder, report))


def _episodes(cell: Cell, folder: Path, report: Report) -> Iterator[Row]:
    sets = [each for tier in cell.task.tiers for each in tier]
    for k, each in enumerate(sets):
        report(_TRAINED + (1.0 - _TRAINED) * k / len(sets))
        yield from episodes(cell.policy(folder), each, next(iter(each.seeds.values())))


def episodes(policy: str, each: EpisodeSet, seeds: range) -> Iterator[Row]:
    """What a policy does in a set's episodes."""
    scenario = granted(policy, load_scenario(each.scenario, overrides=each.overrides))
    for run in evaluate(scenario, policy, seeds):
        if isinstance(run, Run):
            yield {"set": each.name, "seed": str(run.seed), **_measures(run.metrics, scenario)}


def _measures(metrics: Metrics, scenario: Scenario) -> dict[str, str]:
    """Headline, whole swarms, contacts of a vehicle, smallest distances [m], and time over the reference's [1]."""
    share, whole = shares_of(metrics, scenario.task_class.headline)
    ratio = metrics["task"].get("time_ratio") if "task" in metrics else None
    if "task" not in metrics and metrics["task_time_s"] is not None:
        ratio = metrics["task_time_s"] / scenario.task_class.longest_s(scenario)
    told = {
        "share": share, "whole": float(whole), "contacts": metrics["collisions"] / scenario.swarm.num_vehicles,
        "to_obstacles": metrics["min_obstacle_distance_m"], "to_others": metrics["min_spacing_m"], "time": ratio,
    }  # fmt: skip
    return {name: "" if value is None else f"{value:.3g}" for name, value in told.items()}


def read(cell: Cell, folder: Path) -> tuple[list[Row], list[Row]]:
    """Its curve and its episodes, each row with the cell's place."""
    place = {"task": cell.task.name, "learner": cell.learner.name, "training": str(cell.seed)}
    curve, final = (read_rows(folder / name) for name in (CURVE, EPISODES))
    return [{**place, **row} for row in curve], [{**place, **row} for row in final]


def beside(output: Path, report: Report) -> list[Row]:
    """Episodes of the policies that stand beside learners; those that were run before are read."""
    todo = [(task, policy) for task in TASKS.values() for policy in task.policies]
    found: list[Row] = []
    for k, (task, policy) in enumerate(todo):
        report(k / len(todo))
        path = output / "policies" / f"{task.name}-{policy}.csv"
        if not path.exists():
            sets = [each for tier in task.tiers for each in tier]
            write_rows(path, [row for each in sets for row in episodes(policy, each, each.seeds[policy])])
        found += [{"task": task.name, "learner": policy, "training": "", **row} for row in read_rows(path)]
    report(1.0)
    return found


def result(rows: list[Row], name: str = "share") -> float:
    """A measure of one training on one set, mean over its episodes."""
    values = measured(rows, name)
    return sum(values) / len(values) if values else float("nan")
