"""The evaluation as a job: what is missing of every set is run, here, and every finished episode is kept."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from research.heldout.episodes import Episode, episodes_of
from research.heldout.sets import SETS
from research.heldout.trainings import Trained, find_trainings
from uuv_marl.atomic import locked
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.suite import Report, Suite
from uuv_marl.errors import ResultsError


def run(
    output: Path, trainings: Path | None, only: Sequence[str], seeds: int | None, report: Report, anew: bool = False
) -> tuple[list[Episode], list[Trained]]:
    """Run what is missing.

    Args:
        output: folder with a benchmark's results for every set; what else it holds is left out.
        trainings: folder of trainings (``find_trainings``), or None.
        only: names of sets; empty for all.
        seeds: at most so many of every set; all if None.
        report: called as it goes on.
        anew: drop the runs of trainings whose policy has changed since, and make them again.

    Returns:
        All episodes asked for, and the trainings.

    Raises:
        ResultsError: there is no such set, or a folder holds other results.
    """
    known = [held.name for held in SETS]
    for name in only:
        if name not in known:
            raise ResultsError(f"there is no set {name!r}; there are {', '.join(known)}")
    trained = [] if trainings is None else find_trainings(trainings)
    names = [str(one.policy) for one in trained]
    cases = [case for held in SETS if not only or held.name in only for case in held.cases(names, seeds)]
    for policy in {case.policy for case in cases}:
        policy_class(policy)  # refused now, not after hours of others' runs
    suite = Suite(output, traces=False)
    with ExitStack() as locks:
        for folder in dict.fromkeys(output / case.folder for case in cases):
            locks.enter_context(locked(folder))
        suite.run(cases, report, anew=anew)
    return episodes_of(suite, cases, trained), trained
