"""Files of episodes, and how each of their rows is made again."""

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from research.columns import written as six_digits
from research.dynamics import identify, sea_trials
from research.heldout import episodes as heldout
from research.heldout.sets import SETS
from research.heldout.trainings import find_trainings
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.results import FILE, Content, knowledge, read_content
from uuv_marl.benchmark.robustness import job as robustness
from uuv_marl.benchmark.robustness.axes import AXES, CALM
from uuv_marl.benchmark.suite import NOTHING, Case
from uuv_marl.errors import PolicyError, ResultsError, ScenarioError
from uuv_marl.scenario import Scenario, load_scenario


class NoEpisodesError(ResultsError):
    """A table that holds no episodes."""


Cells = Mapping[str, str]
"""A row by its columns, as it stands in the file."""


class Source(NamedTuple):
    """What a row is made of, beside its seed."""

    scenario: Scenario
    """The scenario before it grants what the policy declares."""
    policy: str
    parameters: Mapping[str, object] = NOTHING
    """Parameters of the policy."""


class Kind(NamedTuple):
    """A kind of file, for all of its rows."""

    keys: Sequence[str]
    """Columns that say which episode a row is; one of them is ``seed``."""
    measured: Sequence[str]
    """All other columns, which the simulation gives."""
    source: Callable[[Cells], Source]
    """Raises ScenarioError, PolicyError or ResultsError where a row can't be made again here."""
    written: Callable[[Cells, Metrics], Sequence[str]]
    """What would stand in the measured columns."""


class Row(NamedTuple):
    """A row of a file."""

    file: Path
    line: int
    """Line of the file, from 1, the head; in a ``results.json`` the place in the list of runs, from 1."""
    kind: Kind
    cells: Cells

    @property
    def where(self) -> str:
        """File and line."""
        return f"{self.file}:{self.line}"

    @property
    def name(self) -> str:
        """Which episode it is."""
        return ", ".join(f"{key} {self.cells[key]}" for key in self.kind.keys if self.cells[key])

    @property
    def place(self) -> str:
        """The set or scenario."""
        return self.cells["set" if "set" in self.kind.keys else "scenario"]


def rows_of(file: Path) -> list[Row]:
    """All rows of a file. Raises NoEpisodesError where it holds something else, ResultsError where it is broken."""
    if file.name == FILE:
        return list(_of_results(file))
    try:
        with file.open(newline="", encoding="utf-8") as opened:
            table = csv.reader(opened)
            lines = [(table.line_num, line) for line in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultsError(f"{file} can't be read ({error}); give a file of episodes") from None
    head = lines[0][1] if lines else []
    kind = _kinds(file).get(tuple(head))
    if kind is None:
        raise NoEpisodesError(
            f"{file} is no file of episodes, its columns are {', '.join(head) or 'missing'}; give an episodes.csv of "
            f"heldout or robustness, sea-trials.csv, identification.csv or a benchmark's {FILE}"
        )
    for number, line in lines[1:]:
        if len(line) != len(head):
            raise ResultsError(f"{file}:{number} has {len(line)} cells under {len(head)} columns; mend or remove it")
    return [Row(file, number, kind, dict(zip(head, line, strict=True))) for number, line in lines[1:]]


@cache
def _kinds(file: Path) -> dict[tuple[str, ...], Kind]:
    """The kinds of table by their heads."""
    kinds = (
        Kind(heldout.Episode._fields[:4], heldout.Episode._fields[4:], partial(_heldout, file), _heldout_written),
        Kind(("scenario", "axis", "level", "policy", "seed"), robustness.METRICS, _robustness, _robustness_written),
        Kind(("scenario", "vehicle", "policy", "seed"), sea_trials.MEASURED, _sea_trial, _sea_trial_written),
        Kind(("parameters", "scenario", "seed"), identify.METRICS, _identified, _identified_written),
    )  # fmt: skip
    return {(*kind.keys, *kind.measured): kind for kind in kinds}


def _of(case: Case) -> Source:
    return Source(case.load(), case.policy, case.parameters)


def _heldout(file: Path, cells: Cells) -> Source:
    held = next((held for held in SETS if held.name == cells["set"]), None)
    if held is None:
        raise ResultsError(f"there is no set {cells['set']!r} in this version")
    policy, training_seed = cells["policy"], cells["training_seed"]
    if training_seed:
        policy = _trained(file.parent / "trainings", policy, training_seed)
    return _of(Case(held.name, held.scenario, policy, held.overrides))


def _trained(folder: Path, algorithm: str, seed: str) -> str:
    """Where the weights of a training are that an evaluation used; they lie beside its file."""
    missing = f"weights do not ship: {folder} has no training of {algorithm} with seed {seed}"
    try:
        found = [one for one in find_trainings(folder) if (one.algorithm, str(one.seed)) == (algorithm, seed)]
    except (ResultsError, OSError, ValueError, KeyError):
        found = []
    if not found:
        raise ResultsError(missing)
    return str(found[0].policy)


def _heldout_written(cells: Cells, metrics: Metrics) -> Sequence[str]:
    held = next(held for held in SETS if held.name == cells["set"])
    limit_s = load_scenario(held.scenario, overrides=held.overrides).time_limit.of(metrics["duration_s"])
    return heldout.written(heldout.episode_of(held.name, cells["policy"], None, 0, limit_s, metrics))[4:]


def _robustness(cells: Cells) -> Source:
    scenario, axis, level = cells["scenario"], cells["axis"], cells["level"]
    levels = {CALM: ("0",)} | {name: tuple(map(str, found.levels)) for name, found in AXES.items()}
    if level not in levels.get(axis, ()):
        raise ResultsError(f"there is no level {level!r} of axis {axis!r} in this version")
    return _of(robustness.case_of(scenario, axis, int(level), cells["policy"]))


def _robustness_written(_: Cells, metrics: Metrics) -> Sequence[str]:
    values = [dict[str, Any](metrics)[name] for name in robustness.METRICS]
    return ["" if value is None else f"{value:.6g}" for value in values]


def _sea_trial(cells: Cells) -> Source:
    return _of(sea_trials.case(cells["scenario"], cells["vehicle"], cells["policy"]))


def _sea_trial_written(_: Cells, metrics: Metrics) -> Sequence[str]:
    return sea_trials.written(metrics)


def _identified(cells: Cells) -> Source:
    cases = {(name, case.scenario): case for name, case in identify.SETS}
    case = cases.get((cells["parameters"], cells["scenario"]))
    if case is None:
        raise ResultsError(f"there are no parameters {cells['parameters']!r} of {cells['scenario']!r} in this version")
    return _of(case)


def _identified_written(_: Cells, metrics: Metrics) -> Sequence[str]:
    values = [dict[str, Any](metrics)[name] for name in identify.METRICS]
    return [str(six_digits(float("nan" if value is None else value))) for value in values]


def _of_results(file: Path) -> Iterator[Row]:
    """The runs of a benchmark's ``results.json``, each metric in full."""
    content = read_content(file, "give one of this version")
    source = partial(_benchmarked, content)
    for number, run in enumerate(content["runs"], start=1):
        keys = {"scenario": run.scenario, "policy": run.policy, "seed": str(run.seed)}
        metrics = _flat(run.metrics)
        yield Row(file, number, Kind(tuple(keys), tuple(metrics), source, _benchmarked_written), keys | metrics)


def _benchmarked_written(cells: Cells, metrics: Metrics) -> Sequence[str]:
    now = _flat(metrics)
    return [now.get(name, "") for name in cells if name not in ("scenario", "policy", "seed")]


def _flat(metrics: Metrics) -> dict[str, str]:
    """Every metric as its text in JSON."""
    values: dict[str, Any] = dict(metrics)
    values |= {f"constraint_share.{name}": share for name, share in values.pop("constraint_share").items()}
    return {name: json.dumps(value) for name, value in values.items()}


def _benchmarked(content: Content, cells: Cells) -> Source:
    policy, told = cells["policy"], content["scenarios"][cells["scenario"]]
    try:
        scenario = Scenario.model_validate_json(json.dumps(told))
    except ValueError as error:
        raise ScenarioError(f"the scenario has the fields of another version ({error})") from None
    if knowledge(policy)["source"] != content["policies"][policy]["source"]:
        raise PolicyError(f"the file of {policy!r} has changed since the run")
    return Source(scenario, policy)
