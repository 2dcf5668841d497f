"""The evaluation as a job: what is missing of every set is run, here, and every finished episode is kept."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from research.episodes import Row, cells
from research.heldout.sets import SETS
from uuv_marl.atomic import locked
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.suite import Case, Report, Suite
from uuv_marl.errors import ResultsError

METRICS = ("task_time_s", "collisions", "min_obstacle_distance_m", "min_spacing_m")
"""What is kept of an episode."""
DIGITS = ".3f"
"""Lengths and times to a millimetre and a millisecond."""


def run(output: Path, only: Sequence[str], seeds: int | None, report: Report) -> list[Row]:
    """Run what is missing, and give the episodes that were asked for.

    Args:
        output: folder with a benchmark's results for every set; what else it holds is left out.
        only: names of sets; empty for all.
        seeds: at most so many of every set; all if None.
        report: called as it goes on.

    Raises:
        ResultsError: there is no such set, or a folder holds other results.
    """
    known = [held.name for held in SETS]
    for name in only:
        if name not in known:
            raise ResultsError(f"there is no set {name!r}; there are {', '.join(known)}")
    planned = [case for held in SETS if not only or held.name in only for case in held.cases(seeds)]
    for policy in {case.policy for case in planned}:
        policy_class(policy)  # refused now, not after hours of others' runs
    suite = Suite(output, traces=False)
    with ExitStack() as locks:
        for folder in dict.fromkeys(output / case.folder for case in planned):
            locks.enter_context(locked(folder))
        suite.run(planned, report)
    return [row for case in planned for row in _rows(suite, case)]


def _rows(suite: Suite, case: Case) -> Iterator[Row]:
    for run in suite.results(case).select(case.load().name, case.policy, suite.seeds_of(case)):
        place = {"set": case.name, "policy": case.policy, "seed": str(run.seed)}
        yield place | cells(run.metrics, METRICS, DIGITS)
