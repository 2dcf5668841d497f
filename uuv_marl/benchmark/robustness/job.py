"""Run what is missing of the suite, and write all episodes as one table."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from uuv_marl.atomic import replacing
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.benchmark.frame import import_pandas
from uuv_marl.benchmark.robustness.axes import AXES, CALM, overrides
from uuv_marl.benchmark.runner import distinct_names
from uuv_marl.benchmark.suite import Case, Report, Suite
from uuv_marl.scenario import ScenarioError, load_scenario

EPISODES = "episodes.csv"
METRICS = (
    "success_share", "safe_share", "done_share", "swarm_success", "vehicles_faulty", "collisions",
    "min_obstacle_distance_m", "min_spacing_m", "centre_error_m", "task_time_s", "effort",
)  # fmt: skip
"""Metrics of an episode that are kept, besides the tasks' main ones; docs/benchmark.md defines them."""
DIGITS = ".6g"


class Plan(NamedTuple):
    """The episodes to run."""

    axes: Sequence[str]
    levels: Sequence[int]
    """Levels to run besides level 0."""
    scenarios: Sequence[str]
    policies: Sequence[str]
    seeds: int
    """Benchmark seeds 0 to ``seeds - 1``."""


SHIPPED = Plan(tuple(AXES), (1, 3, 5), ("random_field",), (
    "bio_inspired", "bio_inspired_plus", "scout", "scout,preset=plus", "scout,preset=lead", "scout,preset=wary",
    "mappo",
), 20)  # fmt: skip
"""The plan of docs/robustness.md, which also has comparators, on 10 seeds."""
QUICK = SHIPPED._replace(
    axes=("W1", "S4", "S7", "S9", "N1", "A1", "F3", "X"), scenarios=("single_obstacle", "random_field"), seeds=5,
    policies=("bio_inspired", "bio_inspired_plus", "mappo"),
)  # fmt: skip
"""A first look, in about ten minutes."""


def cells(plan: Plan) -> list[tuple[str, int, Case]]:
    """Axis, level and case of every cell of a plan, level 0 of each scenario first."""
    places = [(axis, level) for axis in plan.axes for level in plan.levels if level in AXES[axis].levels]
    return [
        (axis, level, case_of(scenario, axis, level, policy)._replace(seeds=range(plan.seeds)))
        for scenario in plan.scenarios
        for axis, level in [(CALM, 0), *places]
        for policy in plan.policies
        if axis == CALM or AXES[axis].concerns(policy, load_scenario(scenario))
    ]  # fmt: skip


def case_of(scenario: str, axis: str, level: int, policy: str) -> Case:
    """A policy on a scenario at one level of an axis."""
    name = f"{load_scenario(scenario).name}.{axis}.{level}"
    return Case(name, scenario, policy, overrides(axis, level, scenario), shared=True)


def run(folder: Path, plan: Plan, report: Report, *, restart: bool = False) -> Path:
    """Run what is missing of a plan, and write all its episodes to ``EPISODES``, a row each; the file.

    The folder ``cells`` holds a benchmark's results of each scenario, axis and level; see also ``Suite.run``.

    Raises:
        PolicyError: a policy does not exist, or cannot be run on one of the scenarios.
        ScenarioError: two scenarios have the same name, or an axis has none of the levels.
        ResultsError: the folder holds other results.
    """
    scenarios = [load_scenario(scenario) for scenario in plan.scenarios]
    distinct_names(scenarios, "report")
    for axis in plan.axes:
        if not {*plan.levels} & {*AXES[axis].levels}:
            levels = ", ".join(map(str, AXES[axis].levels))
            raise ScenarioError(f"axis {axis} has the levels {levels}, and none of them is to be run; give --level")
    planned = cells(plan)
    for _, _, case in planned:
        make_policy(case.policy, with_policy_requirements(case.policy, case.load()))  # raises now, not after hours
    suite = Suite(folder / "cells", traces=False)
    suite.run([case for _, _, case in planned], report, restart=restart)
    path = folder / EPISODES
    names = list(dict.fromkeys((*METRICS, *(scenario.task_class.headline for scenario in scenarios))))
    rows = [row for cell in planned for row in _rows(suite, names, *cell)]
    with replacing(path) as partial:
        frame = import_pandas("uuv-marl robustness").DataFrame.from_records(rows)
        frame.to_csv(partial, index=False, float_format=f"%{DIGITS}")
    return path


def _rows(suite: Suite, names: Sequence[str], axis: str, level: int, case: Case) -> Iterator[dict[str, Any]]:
    for row in suite.results(case).select(case.load().name, case.policy, suite.seeds_of(case)):
        metrics: dict[str, Any] = {**row.metrics, **row.metrics.get("task", {})}
        place = {"scenario": row.scenario, "axis": axis, "level": level, "policy": row.policy}
        yield {**place, "seed": row.seed, **{name: metrics.get(name) for name in names}}


def read_episodes(path: Path) -> Any:
    """Read the file of ``run`` as a pandas data frame."""
    return import_pandas("uuv-marl robustness").read_csv(path, dtype={"axis": str, "policy": str, "scenario": str})
