"""Sets of episodes: missing episodes are run, and every finished one is kept."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from research.episodes import Row, cells
from research.second import runnable
from uuv_marl.atomic import locked
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.suite import NOTHING, Case, Report, Suite
from uuv_marl.errors import ResultsError

DIGITS = ".3f"
"""Lengths and times to a millimetre and a millisecond."""


class EpisodeSet(NamedTuple):
    """Episodes of one kind: policies on a scenario over seeds."""

    name: str
    scenario: str
    seeds: Mapping[str, range]
    """By policy."""
    overrides: Mapping[str, object] = NOTHING

    def cases(self, most: int | None) -> dict[str, Case]:
        """Cases by the name of the policy in tables, with at most ``most`` seeds each."""
        return {
            policy: Case(self.name, self.scenario, runnable(policy), self.overrides, shared=True, seeds=seeds[:most])
            for policy, seeds in self.seeds.items()
        }


def run(
    output: Path, sets: Sequence[EpisodeSet], only: Sequence[str], seeds: int | None, metrics: Sequence[str],
    report: Report,
) -> list[Row]:  # fmt: skip
    """Run the missing episodes of the sets named in ``only`` (all if empty), at most ``seeds`` of a policy on a set.

    Raises:
        ResultsError: there is no such set, or a folder holds other results.
    """
    known = [each.name for each in sets]
    for name in only:
        if name not in known:
            raise ResultsError(f"there is no set {name!r}; there are {', '.join(known)}")
    planned = [pair for each in sets if not only or each.name in only for pair in each.cases(seeds).items()]
    cases = [case for _, case in planned]
    for policy in {case.policy for case in cases}:
        policy_class(policy)  # raises now, not after hours of other runs
    suite = Suite(output, traces=False)
    with ExitStack() as locks:
        for folder in dict.fromkeys(output / case.folder for case in cases):
            locks.enter_context(locked(folder))
        suite.run(cases, report)
    return [row for policy, case in planned for row in _rows(suite, policy, case, metrics)]


def _rows(suite: Suite, policy: str, case: Case, metrics: Sequence[str]) -> Iterator[Row]:
    for run in suite.results(case).select(case.load().name, case.policy, suite.seeds_of(case)):
        place = {"set": case.name, "policy": policy, "seed": str(run.seed)}
        yield place | cells(run.metrics, metrics, DIGITS)
