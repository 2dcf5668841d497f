"""Curves and final episodes in the layout of marl-eval (Gorsane et al. 2022), so that its plots read them."""

from collections.abc import Mapping, Sequence
from typing import Any

from research.episodes import Row, measured
from research.learners.protocol import LEARNERS, TASKS

ENVIRONMENT = "uuv_marl"
_METRICS = ("share", "whole", "contacts")


def marl_eval(curves: Sequence[Row], rows: Sequence[Row]) -> dict[str, Any]:
    """By environment, task, algorithm and ``seed_K``: ``step_K`` and ``absolute_metrics``, lists of metrics.

    A step also has ``step_count`` and ``elapsed_time`` [s]. The absolute metrics are those of the best policy in the
    final episodes.
    """
    found: dict[str, dict[str, dict[str, Any]]] = {task: {name: {} for name in LEARNERS} for task in TASKS}
    for row in curves:
        run = found[row["task"]][row["learner"]].setdefault(f"seed_{row['training']}", {})
        run[f"step_{len(run)}"] = {
            "step_count": int(row["agent_steps"]), "elapsed_time": 60.0 * float(row["minutes"]),
            **{name: [float(row[name])] for name in _METRICS},
        }  # fmt: skip
    first = {task: each.tiers[0][0].name for task, each in TASKS.items()}
    final: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        if row["training"] and row["set"] == first[row["task"]]:
            final.setdefault((row["task"], row["learner"], row["training"]), []).append(row)
    for (task, learner, training), mine in final.items():
        found[task][learner][f"seed_{training}"]["absolute_metrics"] = _means(mine)
    return {ENVIRONMENT: found}


def _means(rows: Sequence[Row]) -> Mapping[str, list[float]]:
    values = {name: measured(rows, name) for name in _METRICS}
    return {name: [round(sum(each) / len(each), 6)] for name, each in values.items()}
