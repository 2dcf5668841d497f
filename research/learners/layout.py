"""Curves and final episodes in the layout of marl-eval (Gorsane et al. 2022), so that its plots read them."""

from collections.abc import Mapping, Sequence
from typing import Any

from research.episodes import Row, grouped, measured
from research.learners.protocol import AGENT_STEPS, AGGREGATED, LEARNERS, MEASURES, TASKS

ENVIRONMENT = "uuv_marl"
_METRICS = ("share", "swarm_success", "collisions_per_vehicle")
_STEPS = [AGENT_STEPS * (k + 1) // MEASURES for k in range(MEASURES)]


def marl_eval(curves: Sequence[Row], rows: Sequence[Row]) -> dict[str, Any]:
    """By environment, task, algorithm and ``seed_K``: ``step_K`` and ``absolute_metrics``, lists of metrics.

    A step also has ``step_count``. Marl-eval draws all runs with one interval between steps, so for every run the steps
    are the tenths of the budget in agent-steps. Each has the measure nearest to it: a training that time ended sooner
    stays at its last one. The absolute metrics are those of the best policy in the final episodes. Marl-eval needs all
    algorithms on all tasks, so the challenge is left out.
    """
    layout: dict[str, dict[str, dict[str, Any]]] = {task: {learner: {} for learner in LEARNERS} for task in AGGREGATED}
    curves = [row for row in curves if row["task"] in AGGREGATED]
    for (task, learner, training), run in grouped(curves, "task", "learner", "training").items():
        layout[task][learner][f"seed_{training}"] = {f"step_{k}": _at(step, run) for k, step in enumerate(_STEPS)}
    first = {task: TASKS[task].tiers[0][0].name for task in AGGREGATED}
    final = [row for row in rows if row["training"] and row["set"] == first.get(row["task"])]
    for (task, learner, training), mine in grouped(final, "task", "learner", "training").items():
        layout[task][learner][f"seed_{training}"]["absolute_metrics"] = _means(mine)
    return {ENVIRONMENT: layout}


def _at(step: int, run: Sequence[Row]) -> dict[str, Any]:
    """A step of a training: its nearest measure."""
    row = min(run, key=lambda row: abs(int(row["agent_steps"]) - step))
    return {"step_count": step, **{name: [float(row[name])] for name in _METRICS}}


def _means(rows: Sequence[Row]) -> Mapping[str, list[float]]:
    values = {name: measured(rows, name) for name in _METRICS}
    return {name: [round(sum(each) / len(each), 6)] for name, each in values.items()}
