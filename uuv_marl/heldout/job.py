"""The evaluation as a job: what is missing of every set is run, here, and every finished episode is kept."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from uuv_marl.atomic import locked
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.results import Results, ResultsError
from uuv_marl.benchmark.runner import run_missing
from uuv_marl.heldout.sets import ACROSS, SETS, HeldOut
from uuv_marl.heldout.trainings import Trained, find_trainings

Report = Callable[[str, float], None]
"""What is being done, and the share of the whole that is."""


def run(
    output: Path, trainings: Path | None, only: Sequence[str], seeds: int | None, report: Report
) -> tuple[dict[str, Results], list[Trained]]:
    """Run what is missing.

    Args:
        output: folder with a benchmark's results for every set.
        trainings: folder of trainings (``find_trainings``), or None.
        only: names of sets; empty for all.
        seeds: at most so many of every set; all if None.
        report: called as it goes on.

    Returns:
        Results by set, and the trainings.

    Raises:
        ResultsError: there is no such set, or a folder holds other results.
    """
    known = [held.name for held in SETS]
    for name in only:
        if name not in known:
            raise ResultsError(f"there is no set {name!r}; there are {', '.join(known)}")
    trained = [] if trainings is None else find_trainings(trainings)
    chosen = [held for held in SETS if not only or held.name in only]
    jobs = [(held, held.policies, cut(held.seeds, seeds)) for held in chosen]
    jobs += [(held, held.others, cut(held.fewer, seeds)) for held in chosen if held.others]
    across = {held.name: held for held in ACROSS if held.name in [h.name for h in chosen]}
    if trained:
        names = tuple(str(one.policy) for one in trained)
        jobs += [(held, names, cut(held.seeds, seeds)) for held in across.values()]
    for _, policies, _ in jobs:
        for policy in policies:
            policy_class(policy)
    results: dict[str, Results] = {}
    weights = [_weight(*job) for job in jobs]
    with ExitStack() as locks:
        for k, (held, policies, count) in enumerate(jobs):
            scenario = held.load()
            if held.name not in results:
                locks.enter_context(locked(output / held.name))
                results[held.name] = Results(output / held.name, [scenario])
            before, own = sum(weights[:k]) / sum(weights), weights[k] / sum(weights)

            def note(what: str, share: float, before: float = before, own: float = own) -> None:
                report(what, before + own * share)

            run_missing(results[held.name], [scenario], policies, range(count), _overall(policies, note))
    return results, trained


def _overall(policies: Sequence[str], report: Report) -> Callable[[str, str, float], None]:
    """From the shares of scenario and policy that ``run_missing`` reports to one share."""
    shares: dict[str, float] = {}

    def note(scenario: str, policy: str, share: float) -> None:
        shares[policy] = share
        report(f"{scenario}: {policy}", sum(shares.values()) / len(policies))

    return note


def cut(count: int, most: int | None) -> int:
    """A number of seeds, bounded where that is asked for."""
    return count if most is None else min(count, most)


def _weight(held: HeldOut, policies: Sequence[str], count: int) -> float:
    """About how much work that is."""
    return held.load().swarm.num_vehicles * count * len(policies)
