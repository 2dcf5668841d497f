"""Sets of episodes: missing episodes are run, and every finished one is kept."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from research import FOLDER
from research.episodes import Row, cells
from research.second import runnable
from uuv_marl.atomic import locked
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.suite import NOTHING, Case, Report, Suite
from uuv_marl.cli.console import console, explained, progress_line, working
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


def make_page(
    output: Path, sets: Sequence[EpisodeSet], only: Sequence[str] | None, seeds: int | None, metrics: Sequence[str],
    write_page: Callable[[Path, Sequence[Row]], Sequence[Path]],
) -> None:  # fmt: skip
    """``run`` as a command: with progress, then ``write_page`` from all rows, whose files are printed."""
    with explained(FOLDER):
        with working(f"The finished episodes are in {output}") as bar:
            progress = progress_line(bar, output.name)
            rows = run(output, sets, only or [], seeds, metrics, lambda what, share: progress(share, what[-60:]))
            progress(1.0)
        with locked(output, wait_s=60.0):
            for path in write_page(output, rows):
                console.print(f"  {path}", highlight=False)


def _rows(suite: Suite, policy: str, case: Case, metrics: Sequence[str]) -> Iterator[Row]:
    for run in suite.results(case).select(case.load().name, case.policy, suite.seeds_of(case)):
        place = {"set": case.name, "policy": policy, "seed": str(run.seed)}
        yield place | cells(run.metrics, metrics, DIGITS)
