"""What the reproduction is made of: cases, their runs in a folder, tidy tables, and parts with a picture each."""

import csv
import hashlib
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from uuv_marl.atomic import replacing
from uuv_marl.baselines import granted
from uuv_marl.baselines.bio_inspired import Gains
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.results import Results
from uuv_marl.scenario import Scenario, load_scenario

Float64 = NDArray[np.float64]
Trace = dict[str, NDArray[np.float32]]
Report = Callable[[float], None]
"""Called with the share of the work that is done."""
NOTHING: Mapping[str, object] = MappingProxyType({})


class Case(NamedTuple):
    """One policy on one scenario."""

    name: str
    """Names its folder; unique."""
    scenario: str
    policy: str = "bio_inspired"
    overrides: Mapping[str, object] = NOTHING
    """Fields of the scenario that are changed."""
    parameters: Mapping[str, object] = NOTHING
    """Of the policy."""
    routes: bool = False
    """Whether every seed's routes are kept."""

    def load(self) -> Scenario:
        """The scenario as it is run."""
        return granted(self.policy, load_scenario(self.scenario, overrides=self.overrides))


def folder_name(words: str) -> str:
    """A case's name from any words."""
    return "".join(c if c.isalnum() or c in ".-" else "_" for c in words)


def obstacle_gains(name: str, **gains: float) -> Case:
    """Figures 12 and 13: other obstacle gains on the single obstacle."""
    return Case(name, "single_obstacle", parameters={"gains": Gains(**gains)}, routes=True)


TRACKING = Case("tracking", "tracking", routes=True)
SINGLE = Case("single_obstacle", "single_obstacle", routes=True)
MULTI = Case("multi_obstacle", "multi_obstacle", routes=True)
# The paper names no values for figures 12 and 13. Assumed: a tenth and five times Table 1's zeta_o (ten times, and the
# swarm does not pass at all), half and twice its delta_o.
ZETA_SMALL = obstacle_gains("zeta_o-small", zeta_o=0.8)
ZETA_LARGE = obstacle_gains("zeta_o-large", zeta_o=40.0)
DELTA_SMALL = obstacle_gains("delta_o-small", delta_o=40.0)
DELTA_LARGE = obstacle_gains("delta_o-large", delta_o=160.0)
COMPARATORS = {
    policy: Case(policy, "single_obstacle", policy) for policy in ("sff", "sdc", "sff_informed", "sdc_informed")
}


class Study:
    """Runs of cases in a folder, kept as they are made, so that a stopped job goes on.

    Args:
        folder: one sub-folder for each case.
        seeds: benchmark seeds 0 to ``seeds - 1``.
    """

    def __init__(self, folder: Path, seeds: int) -> None:
        self.folder = folder
        self.seeds = range(seeds)
        self._open: dict[str, Results] = {}

    def run(self, cases: Iterable[Case], report: Report, seeds: Sequence[int] | None = None) -> None:
        """Run what is missing of these cases."""
        wanted, todo = self.seeds if seeds is None else seeds, list(cases)
        for k, case in enumerate(todo):
            results, scenario = self._results(case), case.load()
            missing = [seed for seed in wanted if not results.has(scenario.name, case.policy, seed)]
            for event in evaluate(scenario, case.policy, missing, **case.parameters):
                if isinstance(event, Run):
                    results.add(scenario.name, case.policy, event)
                else:
                    report((k + event.share) / len(todo))
            report((k + 1) / len(todo))

    def metric(self, case: Case, name: str, seeds: Sequence[int] | None = None) -> Float64:
        """A metric by seed; NaN where there is none."""
        rows = self._results(case).select(case.scenario, case.policy, self.seeds if seeds is None else seeds)
        metrics: list[Mapping[str, object]] = [row.metrics for row in rows]
        values = [each[name] for each in metrics]
        return np.array([value if isinstance(value, (int, float)) else np.nan for value in values], np.float64)

    def trace(self, case: Case, seed: int) -> Trace:
        """A run's time series and routes, see ``Results.trace``."""
        return self._results(case).trace(case.scenario, case.policy, seed)

    def traces(self, case: Case) -> list[Trace]:
        """Those of all seeds."""
        return [self.trace(case, seed) for seed in self.seeds]

    def _results(self, case: Case) -> Results:
        if case.name not in self._open:
            kept = self.seeds if case.routes else ()
            scenario = case.load()
            # What is changed names the folder, so that a changed case never finds the runs of the old one.
            changed = hashlib.sha256(repr((scenario, case.policy, sorted(case.parameters.items()))).encode())
            folder = self.folder / f"{case.name}.{changed.hexdigest()[:8]}"
            self._open[case.name] = Results(folder, [scenario], route_seeds=kept)
        return self._open[case.name]


Columns = dict[str, NDArray[Any]]
"""A table by column, all of one length; numbers or texts. NaN stands for nothing measured."""
_DIGITS = 6


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """A table as CSV, whole or not at all: texts in quotes, numbers with six significant digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cells = [[_written(value) for value in values.tolist()] for values in columns.values()]
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))


def read_columns(path: Path) -> Columns:
    """A table that ``write_columns`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file, quoting=csv.QUOTE_NONNUMERIC)
    return {name: np.array([row[k] for row in rows]) for k, name in enumerate(head)}


def stack(tables: Sequence[Columns]) -> Columns:
    """Tables of the same columns, one below the other."""
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def _written(value: Any) -> str | float | int:
    if isinstance(value, bool):
        return int(value)
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value


Tables = Mapping[str, Columns]


_WORDS = tomllib.loads(resources.files("uuv_marl.reproduce").joinpath("parts.toml").read_text(encoding="utf-8"))


class Part(NamedTuple):
    """A figure of the paper, or a study beyond it."""

    name: str
    """``figure-11``; names the picture, and the option ``--only``."""
    cases: tuple[Case, ...]
    """What must have been run."""
    tables: Callable[[Study, Report], Tables]
    """From the runs, by name; each becomes ``data/NAME.csv``."""
    draw: Callable[[Tables], Figure]
    """From the tables alone."""
    seeds: Sequence[int] | None = None
    """What its cases are run on; None for all of the study's."""
    seconds: float = 1.0
    """What its tables take besides the cases, roughly."""

    @property
    def title(self) -> str:
        """Stands above the picture, see ``parts.toml``."""
        return _WORDS[self.name]["title"]

    @property
    def caption(self) -> str:
        """Stands below the picture, see ``parts.toml``."""
        return _WORDS[self.name]["caption"]
