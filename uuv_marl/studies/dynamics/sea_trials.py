"""Every vehicle of the catalogue under the main policies, on the paper's obstacle and on random fields in its scale.

``tools/ship_sea_trials.py`` runs it and keeps the episodes as a table, from which docs/sea-trials.md is made.
"""

import csv
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter

from uuv_marl.atomic import replacing
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import load_scenario, load_vehicle, vehicle_names
from uuv_marl.scenario.scale import PAPER_LENGTH_M
from uuv_marl.studies.suite import Case, Report, Suite

SCENARIOS = ("sea_trial", "random_field")
POLICIES = (
    "bio_inspired", "bio_inspired_plus", "guarded:bio_inspired_plus", "sff", "sdc", "scout",
    "scout,preset=plus", "scout,preset=lead", "mappo", "trimmed_scout",
)  # fmt: skip
SEEDS = 20
_PAPERS = "literature_185"


class Episode(NamedTuple):
    """One episode; lengths in m, times in s, None where there is nothing to measure."""

    scenario: str
    vehicle: str
    policy: str
    seed: int
    task_time_s: float | None
    """None where the swarm did not arrive."""
    duration_s: float
    """What l(t) takes."""
    collisions: int
    min_obstacle_distance_m: float | None
    min_spacing_m: float
    effort: float
    """Mean squared action, share of full force."""


MEASURED = Episode._fields[4:]
"""What the simulation gives; the fields before say which episode it is."""


def case(scenario: str, vehicle: str, policy: str) -> Case:
    """A policy with a vehicle. Trained policies may run on vehicles that they were not trained on."""
    other = {"any_vehicle": True} if vehicle != _PAPERS and isinstance(policy_class(policy), Trained) else {}
    changes = {"vehicle": vehicle, "scale": "vehicle"}
    return Case(f"{scenario}.{vehicle}", scenario, policy, changes, other, range(SEEDS), shared=True)


def run(folder: Path, path: Path, report: Report) -> None:
    """Run what is missing, and write all episodes as CSV, a row each.

    Args:
        folder: holds a benchmark's results of each scenario and vehicle; a stopped run goes on there.
        path: the file.
        report: called as it goes on.
    """
    suite = Suite(folder, traces=False)
    every = [case(*place) for place in itertools.product(SCENARIOS, vehicle_names(), POLICIES)]
    suite.run(every, report)
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Episode._fields)
        table.writerows(row for one in every for row in _rows(suite, one))


def _rows(suite: Suite, one: Case) -> Iterator[list[object]]:
    for row in suite.results(one).select(one.scenario, one.policy, suite.seeds_of(one)):
        yield [one.scenario, one.overrides["vehicle"], one.policy, row.seed, *written(row.metrics)]


def written(metrics: Metrics) -> list[str]:
    """What stands in the file for what was measured of an episode, six significant digits."""
    values = [dict[str, Any](metrics)[name] for name in MEASURED]
    return ["" if v is None else f"{v:.6g}" if isinstance(v, float) else str(v) for v in values]


def read(path: Path) -> list[Episode]:
    """The episodes that ``run`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = [{name: text or None for name, text in row.items()} for row in csv.DictReader(file)]
    return TypeAdapter(list[Episode]).validate_python(rows)


def table(episodes: Sequence[Episode], scenario: str) -> list[Sequence[str]]:
    """Rows of a scenario's table, a head first: a row for each vehicle and policy over all seeds."""
    rows: list[Sequence[str]] = [
        ("vehicle", "policy", "arrived", "without a collision", "collisions in all", "to the obstacle [m]", "[hulls]",
         "between vehicles [m]", "[hulls]", "time over l(t)'s", "effort")
    ]  # fmt: skip
    for vehicle in vehicle_names():
        hull = float(load_vehicle(vehicle)["vehicle"]["length_m"] or PAPER_LENGTH_M)
        for policy in POLICIES:
            mine = [e for e in episodes if (e.scenario, e.vehicle, e.policy) == (scenario, vehicle, policy)]
            rows.append((f"`{vehicle}`", f"`{policy}`", *_summary(mine, hull)))
    return rows


def _summary(episodes: Sequence[Episode], hull_m: float) -> tuple[str, ...]:
    """Cells of a policy's row, with a hull's length [m]."""
    arrived = [e for e in episodes if e.task_time_s is not None]
    clean = sum(not e.collisions for e in arrived)
    obstacle = min((e.min_obstacle_distance_m for e in episodes if e.min_obstacle_distance_m is not None), default=None)
    apart, num = min(e.min_spacing_m for e in episodes), len(episodes)
    late = float(np.mean([(e.task_time_s or 0.0) / e.duration_s for e in arrived])) if arrived else None
    return (
        f"{len(arrived)} of {num}", f"{clean} of {num}", f"{sum(e.collisions for e in episodes)}",
        "–" if obstacle is None else f"{obstacle:.2f}", "–" if obstacle is None else f"{obstacle / hull_m:.1f}",
        f"{apart:.2f}", f"{apart / hull_m:.1f}", "–" if late is None else f"{late:.3f}",
        f"{np.mean([e.effort for e in episodes]):.3f}",
    )  # fmt: skip


def scales() -> list[Sequence[str]]:
    """Rows of every vehicle's scale and of what it makes of ``sea_trial``, a head first."""
    rows: list[Sequence[str]] = [
        ("vehicle", "L", "V", "full thrust over 3,000 N", "course [m]", "for [s]", "vehicles start apart [m]",
         "obstacle's radius [m]", "bow sonar [m]", "a decision every [s]", "arrives")
    ]  # fmt: skip
    for name in vehicle_names():
        one = load_scenario("sea_trial", overrides={"vehicle": name, "scale": "vehicle"})
        scale, course = one.scale, one.trajectory
        rows.append(
            (f"`{name}`", f"{scale.length:.3g}", f"{scale.speed:.3g}", f"{scale.force:.3g}",
             f"{course.duration_s * course.speed_mps:.0f}", f"{course.duration_s:.0f}", f"{one.start.spacing_m:.1f}",
             f"{one.obstacles[0].radius_m:.1f}", f"{one.sonar.arrays[0].range_m:.0f}",
             f"{one.timing.decision_period_s:.3g}", "in passage" if one.arrival.by == "passage" else "at rest")
        )  # fmt: skip
    return rows
