"""Raw results as marl-eval reads them (Gorsane et al. 2022): environment, task, algorithm, run, step.

Its reader wants the same metrics in every step and in ``absolute_metrics``, the same steps in every run, and the same
names of runs for every algorithm. So what is measured while training and what is measured afterwards are two
environments, and runs are numbered: ``run_1`` has the smallest training seed. Metrics to normalise must be in all
environments that the reader is given: for ``score`` give it the second alone.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from research.heldout.across import tasks
from research.heldout.episodes import ByPolicy, Episode
from research.heldout.trainings import Trained, Validation

ENVIRONMENT = "uuv_marl"
"""Held-out episodes of the policy that counts; its only step holds their means, at the steps of that checkpoint."""
VALIDATION = "uuv_marl_validation"
"""Validations while training; the absolute metrics are those of the policy that counts."""


def write_marl_eval(episodes: Sequence[Episode], trained: Sequence[Trained], path: Path) -> None:
    """Of the trainings that have episodes; as many runs of each algorithm, and validations of each run, as all have."""
    evaluated = {(e.policy, e.training_seed) for e in episodes}
    runs: dict[str, list[Trained]] = {}
    for one in trained:
        if (one.algorithm, one.seed) in evaluated and not one.ablation:
            runs.setdefault(one.algorithm, []).append(one)
    fewest, steps = min(map(len, runs.values())), min(len(one.validations) for one in trained if not one.ablation)
    data: dict[str, Any] = {ENVIRONMENT: {held.name: {} for held in tasks(episodes)}, VALIDATION: {"validation": {}}}
    by_policy = ByPolicy(episodes)
    for algorithm, found in runs.items():
        named = {f"run_{k + 1}": one for k, one in enumerate(found[:fewest])}
        data[VALIDATION]["validation"][algorithm] = {name: _training(one, steps) for name, one in named.items()}
        for task, algorithms in data[ENVIRONMENT].items():
            algorithms[algorithm] = {name: _evaluation(one, task, by_policy) for name, one in named.items()}
    path.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _training(one: Trained, steps: int) -> dict[str, Any]:
    validations = one.validations[:steps]
    made = {f"step_{k + 1}": {"step_count": v.agent_steps, **_validated(v)} for k, v in enumerate(validations)}
    return made | {"absolute_metrics": _validated(one.policy_at)}


def _validated(one: Validation) -> dict[str, list[float]]:
    return {"score": [round(one.score, 4)], "arrived": [round(one.arrived, 4)], "elapsed_time": [round(one.seconds, 1)]}


def _evaluation(one: Trained, task: str, episodes: ByPolicy) -> dict[str, Any]:
    mine = episodes.select(task, one.algorithm, one.seed)
    metrics = {
        "success": [float(e.succeeded) for e in mine],
        "efficiency": [round(e.efficiency, 4) for e in mine],
        "collisions": [float(e.collisions) for e in mine],
    }
    # Eight digits: the mean of 200 numbers of four digits has seven, and a tie would be rounded by how a Python adds.
    means = {name: [round(sum(values) / len(values), 8)] for name, values in metrics.items()}
    return {"step_1": {"step_count": one.policy_at.agent_steps, **means}, "absolute_metrics": metrics}
