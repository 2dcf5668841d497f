"""What the paper leaves out: each unknown with its range and meaning, and the error of a choice.

Only sections 5.1 and 5.2.1 (with Table 2) are used here; section 5.2.2 stays a prediction.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from research.data import read_toml
from research.paper.ledger import difference
from uuv_marl.benchmark.evaluate import Run, episodes
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.suite import Case
from uuv_marl.scenario import ScenarioError, load_scenario

Value = float | int | str

SEARCHED = ("single_obstacle", "tracking")
"""The search looks at these alone; the quick one first."""
SEEDS = (10_000, 10_001, 10_002, 10_003)
"""Seeds of the tuning range 10,000-99,999; the benchmark never uses them."""
OBJECTIVES = ("spacing_error", "distance_error", "time_error")
"""One per published claim: the spacing of 5.1 (the larger error of its two numbers), and Table 2's two columns."""
_POLICY = "bio_inspired"
_START_WIDTH_M = 200.0
"""Both start rectangles and the gap between them, across the first leg. Section 5.1."""


class Unknown(NamedTuple):
    """A number or a reading that the paper doesn't state."""

    default: Value
    """Value of the shipped scenarios."""
    meaning: str
    unit: str = ""
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    choices: Sequence[Value] = ()
    """Instead of a range."""
    fields: Sequence[str] = ()
    """Fields of the scenario; a field of the vehicle is multiplied."""


UNKNOWNS = {name: Unknown(**table) for name, table in read_toml("dynamics", "unknowns.toml").items()}
"""The space, as ``unknowns.toml`` lists it."""
DEFAULTS: dict[str, Value] = {name: unknown.default for name, unknown in UNKNOWNS.items()}


class Numbers(NamedTuple):
    """The paper's numbers under a setting, means over seeds; NaN where nothing was measured."""

    min_spacing_m: float = math.nan
    """Section 5.1."""
    mean_min_spacing_m: float = math.nan
    """Section 5.1."""
    min_obstacle_distance_m: float = math.nan
    """Table 2 and section 5.2.1."""
    task_time_s: float = math.nan
    """Table 2."""
    failed: float = 1.0
    """Share of runs that collide or never arrive, or that were not made since others had failed."""


_MEASURED_ON = {
    "min_spacing_m": "tracking",
    "mean_min_spacing_m": "tracking",
    "min_obstacle_distance_m": "single_obstacle",
    "task_time_s": "single_obstacle",
}
"""The scenario of each of the paper's ``Numbers``, in their order."""


def case(values: Mapping[str, Value], scenario: str, seeds: Sequence[int] | None = None) -> Case:
    """A scenario under a choice of the unknowns; ``DEFAULTS`` change nothing."""
    vehicle = load_scenario("tracking").vehicle
    overrides: dict[str, object] = {}
    for name, unknown in UNKNOWNS.items():
        for field in unknown.fields:
            section, _, own = field.partition(".")
            overrides[field] = getattr(vehicle, own) * float(values[name]) if section == "vehicle" else values[name]
    overrides["sonar.arrays.port.mounting_deg"] = -float(values["flank_mounting"])
    overrides["start.width_m"] = (_START_WIDTH_M - float(values["start_gap"])) / 2
    parameters = {"obstacle_term": values["obstacle_term"]}
    return Case(f"identified {scenario}", scenario, _POLICY, overrides, parameters, seeds)


def runs(of: Case) -> Iterator[Run]:
    """Episodes of a case."""
    return episodes(of.load(), of.policy, of.seeds or (), **of.parameters)


def measure(values: Mapping[str, Value], seeds: Sequence[int] = SEEDS) -> Numbers:
    """The paper's numbers of 5.1 and 5.2.1; the longer scenario is skipped where a swarm fails the other already."""
    metrics: dict[str, list[Metrics]] = {}
    for scenario in SEARCHED:
        try:
            metrics[scenario] = [run.metrics for run in runs(case(values, scenario, seeds))]
        except ScenarioError:
            return Numbers()
        if any(map(_fails, metrics[scenario])):
            break

    def mean(name: str, scenario: str) -> float:
        values = [value for m in metrics.get(scenario, ()) if (value := dict[str, Any](m)[name]) is not None]
        return sum(values) / len(values) if values else math.nan

    total, safe = len(SEARCHED) * len(seeds), sum(not _fails(m) for found in metrics.values() for m in found)
    return Numbers(*(mean(name, scenario) for name, scenario in _MEASURED_ON.items()), failed=(total - safe) / total)


def errors(numbers: Numbers) -> tuple[float, ...]:
    """How far the paper's numbers are missed, relative, by ``OBJECTIVES``; from 0 to 1, above 1 where runs fail.

    An obstacle distance between the paper's two for one case is not an error. Any swarm that always arrives without a
    collision is better in all three than any that doesn't.
    """
    if numbers.failed:
        return (round(1.0 + numbers.failed, 5),) * len(OBJECTIVES)
    smallest, mean, distance, time = (
        abs(difference(number, PAPER[scenario, _POLICY].values(name)))
        for number, (name, scenario) in zip(numbers, _MEASURED_ON.items(), strict=False)
    )
    return tuple(round(min(error, 1.0), 5) for error in (max(smallest, mean), distance, time))


def front(losses: np.ndarray) -> list[int]:
    """Rows of the Pareto front of losses, shape (trial, objective): none is as good in all and better in one."""
    no_worse = (losses[:, None, :] <= losses[None, :, :]).all(axis=2)
    better = (losses[:, None, :] < losses[None, :, :]).any(axis=2)
    return [int(row) for row in np.flatnonzero(~(no_worse & better).any(axis=0))]


def best(losses: np.ndarray) -> int:
    """Row with the smallest largest loss; of equals the smallest sum, then the first."""
    return int(np.lexsort((losses.sum(axis=1), losses.max(axis=1)))[0])


def _fails(metrics: Metrics) -> bool:
    return bool(metrics["collisions"]) or metrics["task_time_s"] is None
