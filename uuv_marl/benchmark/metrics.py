"""Definitions of the metrics. Distances are taken from the start to the end of an episode."""

from typing import NotRequired

import numpy as np

from uuv_marl.benchmark.success import SuccessRecorder
from uuv_marl.errors import ScenarioError
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks import Follow, Task
from uuv_marl.tasks.measures import MEASURED, Measures, Success
from uuv_marl.types import Bool, Float32, Float64


class Metrics(Measures, Success):
    """The metrics of one run; docs/benchmark.md defines every key."""

    task: NotRequired[dict[str, float | None]]
    """The task's own measures (``uuv_marl.tasks.Task.metrics``); absent in ``follow``, whose own are the others."""


def shares_of(metrics: Metrics, headline: str) -> tuple[float, bool]:
    """An episode's headline, and swarm success; in ``follow`` arrival without a collision."""
    own = metrics.get("task", {})
    if "swarm_success" not in own:
        swarm_success = metrics["task_time_s"] is not None and not metrics["collisions"]
        return float(swarm_success), swarm_success
    share = own.get(headline)
    return (own["success_share"] if share is None else share) or 0.0, own["swarm_success"] == 1.0


def measure(swarm: Swarm) -> dict[str, Float64]:
    """Measures of a swarm in its current state, (world,) or (world, obstacle); docs/benchmark.md defines them."""
    facts, state, constraints = swarm.facts, swarm.state, swarm.scenario.constraints
    alive = state.alive
    living = np.maximum(alive.sum(axis=1), 1)
    psi = state.eta[:, :, 2]
    order = np.hypot((np.cos(psi) * alive).sum(axis=1), (np.sin(psi) * alive).sum(axis=1)) / living
    any_alive = alive.any(axis=1)
    within = {
        "within_s_l": np.where(alive, facts.away, 0.0).max(axis=1) <= constraints.s_l_m,
        "within_s_o": facts.obstacle_clearance.min(axis=1) >= constraints.s_o_m,
        "within_s_u": facts.min_spacing >= constraints.s_u_m,
    }
    return {
        "time_s": facts.time_s.copy(),
        "min_spacing_m": facts.min_spacing.copy(),
        "max_spacing_m": facts.max_spacing.copy(),
        "centre_error_m": np.hypot(*(facts.centre - swarm.mean_reference[:, :2]).T),
        "order_parameter": np.where(any_alive, order, np.nan),
        **{name: (any_alive & holds).astype(np.float64) for name, holds in within.items()},
        "effort": (facts.effort * alive).sum(axis=1) / living,
        "saturation": facts.saturated.copy(),
        "obstacle_distance_m": facts.obstacle_clearance.copy(),
    }


class MetricsRecorder:
    """Collects samples of a batch of worlds, and computes a world's metrics at the end of its episode."""

    def __init__(self, swarm: Swarm) -> None:
        self._swarm = swarm
        self._samples: list[dict[str, Float64]] = []
        self._collisions = np.zeros(swarm.num_worlds, np.int64)
        self._success = SuccessRecorder(swarm) if isinstance(swarm.task, Follow) else None

    def update(self, active: Bool) -> None:
        """Measure the swarm after a reset or step of the ``active`` worlds."""
        self._samples.append(measure(self._swarm))
        self._collisions += np.where(active, self._swarm.facts.collisions, 0)
        if self._success:
            self._success.update(active)

    def series(self, world: int) -> dict[str, Float32]:
        """A world's samples over time: those of ``measure``."""
        columns = {name: values.astype(np.float32) for name, values in self._table(world).items()}
        num = int(self._swarm.world_map.num_obstacles[world])
        return columns | {"obstacle_distance_m": columns["obstacle_distance_m"][:, :num].copy()}

    def metrics(self, world: int, clamps: int) -> Metrics:
        """A world's metrics, as in ``results.json``; None for values that do not exist."""
        facts = self._swarm.facts
        table = self._table(world)
        all_three = table["within_s_l"] * table["within_s_o"] * table["within_s_u"]
        own = _own(self._swarm.task, world)
        judged = self._success.metrics(world) if self._success else Success()
        times = facts.arrival_s[world] if self._swarm.task.has_goal else np.full(4, np.nan)
        arrived, within_1_m, within_5_m, within_10_m = map(_number, times)
        metrics: Metrics = {
            "task_time_s": arrived,
            "time_within_1_m_s": within_1_m,
            "time_within_5_m_s": within_5_m,
            "time_within_10_m_s": within_10_m,
            "duration_s": float(self._swarm.duration_s[world]),
            "min_obstacle_distance_m": _number(table["obstacle_distance_m"].min()),
            "min_spacing_m": _number(table["min_spacing_m"].min()),
            "mean_min_spacing_m": _mean(table["min_spacing_m"]),
            "max_spacing_m": _number(
                np.max(table["max_spacing_m"], where=np.isfinite(table["max_spacing_m"]), initial=-np.inf)
            ),
            "centre_error_m": _mean(table["centre_error_m"]),
            "order_parameter": _mean(table["order_parameter"]),
            "collisions": int(self._collisions[world]),
            "constraint_share": {
                "all": float(all_three.mean()),
                "s_l": float(table["within_s_l"].mean()),
                "s_o": float(table["within_s_o"].mean()),
                "s_u": float(table["within_s_u"].mean()),
            },
            "effort": float(table["effort"][1:].mean()),
            "clamps": clamps,
            "saturation_share": float(table["saturation"][1:].mean()),
            "vehicles_lost": int((~self._swarm.state.alive[world]).sum()),
            **judged,
        }
        if own:
            metrics["task"] = own
        return metrics

    def _table(self, world: int) -> dict[str, Float64]:
        """A world's samples over time, shape (time,) or (time, obstacle) each."""
        return {name: np.array([sample[name][world] for sample in self._samples]) for name in self._samples[0]}


def _own(task: Task, world: int) -> dict[str, float | None]:
    """A task's own metrics. Raises ScenarioError where a name is taken, or a required name is missing."""
    own, name = task.metrics(world), type(task).__name__
    needed = set[str]() if isinstance(task, Follow) else {"success_share", "swarm_success", task.headline}
    if taken := sorted(own.keys() & MEASURED - needed):
        raise ScenarioError(f"task {name} can't give {', '.join(taken)} in metrics: the name is taken; choose another")
    if missing := sorted(needed - own.keys()):
        raise ScenarioError(f"task {name} must give {', '.join(missing)} in metrics; add to super().metrics(world)")
    return own


def _mean(values: Float64) -> float | None:
    """Mean over the finite samples."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else None


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
