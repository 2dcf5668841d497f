"""Raw results in the layout of marl-eval (Gorsane et al. 2022): environment, task, algorithm, run, step."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from uuv_marl.heldout.episodes import Episode
from uuv_marl.heldout.trainings import Trained

ENVIRONMENT = "uuv_marl"


def write_marl_eval(episodes: Sequence[Episode], trained: Sequence[Trained], path: Path) -> None:
    """Validations as steps, held-out episodes of the best checkpoint as absolute metrics."""
    tasks = sorted({episode.set for episode in episodes if episode.training_seed is not None})
    data: dict[str, Any] = {ENVIRONMENT: {task: {} for task in tasks}}
    for task in tasks:
        for one in trained:
            mine = [e for e in episodes if (e.set, e.policy, e.training_seed) == (task, one.algorithm, one.seed)]
            if mine:
                runs = data[ENVIRONMENT][task].setdefault(one.algorithm, {})
                runs[f"seed_{one.seed}"] = {**_steps(one), "absolute_metrics": _absolute(mine)}
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def _steps(one: Trained) -> dict[str, Any]:
    return {
        f"step_{k}": {
            "step_count": validation.agent_steps,
            "elapsed_time": round(validation.seconds, 1),
            "validation_score": [round(validation.score, 4)],
            "validation_arrived": [round(validation.arrived, 4)],
        }
        for k, validation in enumerate(one.validations)
    }


def _absolute(episodes: Sequence[Episode]) -> dict[str, list[float]]:
    return {
        "success": [float(e.succeeded) for e in episodes],
        "efficiency": [0.0 if e.task_time_s is None else round(e.duration_s / e.task_time_s, 4) for e in episodes],
        "collisions": [float(e.collisions) for e in episodes],
    }
