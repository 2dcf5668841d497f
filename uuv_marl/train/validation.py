"""How good a checkpoint is: deterministic episodes on validation seeds, through the benchmark's own ``evaluate``."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from uuv_marl.baselines import granted
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.env import TRAINING_SEEDS
from uuv_marl.train.training import Training

VALIDATION_SEEDS = TRAINING_SEEDS[1]
"""The first of the validation seeds: up to 999,999, which no training uses."""
SAFE_OBSTACLE_M = 13.0
SAFE_SPACING_M = 6.5
"""Distances below these cost: a little more than what we want of the worst seed."""


class ValidationResult(NamedTuple):
    """Over all episodes."""

    score: float
    """Minus the mean cost, see ``validation_cost``."""
    arrived: float
    """Share of episodes."""
    collisions: int
    """Contacts."""
    lateness_s: float | None
    """Mean over arrivals, of the task time beyond l(t)'s own."""
    min_spacing_m: float | None
    """Smallest spacing of the worst episode [m]."""
    min_obstacle_distance_m: float | None
    """Smallest distance to an obstacle of the worst episode [m]."""


def validate(policy: Path, training: Training) -> ValidationResult:
    """Run a checkpoint on a training's validation seeds: with each size of swarm, and under each of its conditions."""
    metrics: list[Metrics] = []
    scenario = training.loaded_for_validation
    for n, count in training.validation:
        seeds = range(VALIDATION_SEEDS, VALIDATION_SEEDS + count)
        metrics += _run(policy, load_scenario(scenario, num_vehicles=n), seeds)
    for k, changes in enumerate(training.validation_conditions):
        metrics += _run(policy, load_scenario(scenario, overrides=changes), [VALIDATION_SEEDS + 1000 + k])
    return validation_result(metrics)


def _run(policy: Path, scenario: Scenario, seeds: Sequence[int]) -> list[Metrics]:
    events = evaluate(granted(str(policy), scenario), str(policy), seeds)
    return [event.metrics for event in events if isinstance(event, Run)]


def validation_result(metrics: Sequence[Metrics]) -> ValidationResult:
    """The result of these episodes."""
    times = [late for late in map(lateness, metrics) if late is not None]
    return ValidationResult(
        score=-sum(map(validation_cost, metrics)) / len(metrics),
        arrived=sum(map(succeeded, metrics)) / len(metrics),
        collisions=sum(m["collisions"] for m in metrics),
        lateness_s=sum(times) / len(times) if times else None,
        min_spacing_m=_least(m["min_spacing_m"] for m in metrics),
        min_obstacle_distance_m=_least(m["min_obstacle_distance_m"] for m in metrics),
    )


def validation_cost(metrics: Metrics) -> float:
    """Cost of an episode [1]: lateness in minutes (2 if it never arrives), 2 with a collision, and short distances.

    In a task other than ``follow`` lateness gives way to twice the share of vehicles that failed.
    """
    late = lateness(metrics)
    own = metrics.get("task", {}).get("untouched_share")
    if own is not None:
        late = 120.0 * (1.0 - own)
    total = 2.0 if late is None else min(late / 60.0, 2.0)
    total += 2.0 * min(metrics["collisions"], 1)
    distances = metrics["min_obstacle_distance_m"], metrics["min_spacing_m"]
    for distance, safe in zip(distances, (SAFE_OBSTACLE_M, SAFE_SPACING_M), strict=True):
        if distance is not None:
            total += min(max(1.0 - distance / safe, 0.0), 1.0)
    return total


def succeeded(metrics: Metrics) -> bool:
    """Whether an episode was a success: the swarm arrived, or in a task other than ``follow`` ``whole`` is 1."""
    return metrics["task"].get("whole") == 1.0 if "task" in metrics else metrics["task_time_s"] is not None


def lateness(metrics: Metrics) -> float | None:
    """Task time beyond the time that l(t) takes [s]; None where the swarm never arrived."""
    time = metrics["task_time_s"]
    return None if time is None else time - metrics["duration_s"]


def _least(values: Iterable[float | None]) -> float | None:
    return min((value for value in values if value is not None), default=None)
