"""Suites: cases whose missing runs are run and kept in a folder, so that a stopped job can be resumed."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.benchmark.results import Results, Trace, file_name
from uuv_marl.benchmark.runner import run_missing
from uuv_marl.scenario import Scenario, load_scenario

Report = Callable[[str, float], None]
"""Called with the current task, and the share of the work that is done."""
NOTHING: Mapping[str, object] = MappingProxyType({})


class Case(NamedTuple):
    """A policy on a scenario over seeds."""

    name: str
    """Name of its folder."""
    scenario: str
    policy: str = "bio_inspired"
    overrides: Mapping[str, object] = NOTHING
    """Changed fields of the scenario."""
    parameters: Mapping[str, object] = NOTHING
    """Parameters of the policy."""
    seeds: Sequence[int] | None = None
    """None for all of the suite's."""
    routes: bool = False
    """Whether trajectories of the suite's seeds are kept."""
    shared: bool = False
    """Whether cases with this name are policies on one scenario, with runs in one folder."""

    def load(self) -> Scenario:
        """The scenario without the policy's requirements."""
        return load_scenario(self.scenario, overrides=self.overrides)

    @property
    def folder(self) -> str:
        """Folder name; unless shared, with a hash of the case, so that a changed case never finds old runs."""
        case = (self.load(), self.policy, sorted(self.parameters.items()))
        return self.name if self.shared else file_name(self.name, case)


class Suite:
    """Runs of cases in a folder.

    Args:
        folder: one sub-folder for each case, with a benchmark's results.
        seeds: benchmark seeds 0 to ``seeds - 1``, for cases that name none.
        traces: whether time series are kept.
    """

    def __init__(self, folder: Path, seeds: int = 1, traces: bool = True) -> None:
        self.folder, self._traces = folder, traces
        self.seeds = range(seeds)
        self._open: dict[str, Results] = {}

    def run(self, cases: Sequence[Case], report: Report, *, restart: bool = False) -> None:
        """Run what is missing of these cases.

        ``restart`` drops the runs of policies whose file has changed.

        Raises:
            ResultsError: the folder holds other results, or those of a policy before its file changed.
        """
        work = [case.load().swarm.num_vehicles * len(self.seeds_of(case)) for case in cases]
        for k, case in enumerate(cases):

            def note(_scenario: str, policy: str, share: float, k: int = k, name: str = case.name) -> None:
                report(f"{name}: {policy}", (sum(work[:k]) + share * work[k]) / sum(work))

            if restart:
                self.results(case).forget_changed(case.policy)
            seeds = self.seeds_of(case)
            run_missing(self.results(case), [case.load()], [case.policy], seeds, note, **case.parameters)

    def seeds_of(self, case: Case) -> Sequence[int]:
        """The seeds of a case."""
        return self.seeds if case.seeds is None else case.seeds

    def metric(self, case: Case, name: str) -> NDArray[np.float64]:
        """A metric by seed, shape (seed,); NaN where it is None."""
        rows = self.results(case).select(case.scenario, case.policy, self.seeds_of(case))
        return np.array([dict[str, Any](row.metrics)[name] for row in rows], np.float64)

    def trace(self, case: Case, seed: int) -> Trace:
        """A run's time series and trajectories, see ``load_trace``."""
        return self.results(case).trace(case.scenario, case.policy, seed)

    def traces(self, case: Case) -> list[Trace]:
        """The traces of all seeds."""
        return [self.trace(case, seed) for seed in self.seeds_of(case)]

    def results(self, case: Case) -> Results:
        """The results in the case's folder."""
        if case.folder not in self._open:
            routes = self.seeds if case.routes else ()
            self._open[case.folder] = Results(self.folder / case.folder, [case.load()], routes, self._traces)
        return self._open[case.folder]
