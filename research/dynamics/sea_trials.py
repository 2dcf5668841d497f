"""Every vehicle of the catalogue under the main policies, on the paper's obstacle and on random fields in its scale.

``python -m research.dynamics.sea_trials FOLDER`` runs it and writes its rows, of which docs/vehicles.md shows a table.
"""

import itertools
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from research.episodes import Row, cells, select, succeeded, write_rows
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.suite import Case, Report, Suite
from uuv_marl.scenario import load_scenario, vehicle_names

SCENARIOS = ("sea_trial", "random_field")
POLICIES = (
    "bio_inspired", "bio_inspired_plus", "guarded:bio_inspired_plus", "sff", "sdc", "scout",
    "scout,preset=plus", "scout,preset=lead", "mappo",
)  # fmt: skip
SEEDS = 20
METRICS = ("task_time_s", "collisions")
"""What is kept of an episode."""
DIGITS = ".6g"
_PAPERS = "literature_185"


def case(scenario: str, vehicle: str, policy: str) -> Case:
    """A policy with a vehicle. Trained policies may run on vehicles that they were not trained on."""
    other = {"any_vehicle": True} if vehicle != _PAPERS and isinstance(policy_class(policy), Trained) else {}
    changes = {"vehicle": vehicle, "scale": "vehicle"}
    return Case(f"{scenario}.{vehicle}", scenario, policy, changes, other, range(SEEDS), shared=True)


def run(folder: Path, report: Report) -> Path:
    """Run what is missing, and write all episodes, a row each.

    Args:
        folder: holds a benchmark's results of each scenario and vehicle; a stopped run goes on there.
        report: called as it goes on.
    """
    suite, path = Suite(folder, traces=False), folder / "sea-trials.csv.gz"
    every = [case(*place) for place in itertools.product(SCENARIOS, vehicle_names(), POLICIES)]
    suite.run(every, report)
    write_rows(path, (row for one in every for row in _rows(suite, one)))
    return path


def _rows(suite: Suite, one: Case) -> Iterator[Row]:
    for run in suite.results(one).select(one.scenario, one.policy, suite.seeds_of(one)):
        place = {"scenario": one.scenario, "vehicle": str(one.overrides["vehicle"]), "policy": one.policy}
        yield place | {"seed": str(run.seed)} | cells(run.metrics, METRICS, DIGITS)


def table(episodes: Sequence[Row]) -> list[Sequence[str]]:
    """How many episodes arrive untouched, a head first: a row for each policy, a column for each vehicle."""
    rows: list[Sequence[str]] = [("policy", *(f"`{name}`" for name in vehicle_names()))]
    for policy in POLICIES:
        of = select(episodes, policy=policy)
        found = [[select(of, vehicle=name, scenario=where) for where in SCENARIOS] for name in vehicle_names()]
        counts = (", ".join(f"{sum(map(succeeded, mine))}" for mine in both) for both in found)
        rows.append((f"`{policy}`", *counts))
    return rows


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


if __name__ == "__main__":
    print(run(Path(sys.argv[1]), lambda what, share: print(f"{share:.3f} {what}", flush=True)))
