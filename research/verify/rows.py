"""Files of episodes, and the scenario and policy of each of their rows."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from research.episodes import Row as Cells
from research.episodes import cells as cells_of
from research.episodes import read_text
from research.heldout import sets as heldout
from research.learners import cells as learners
from research.learners.protocol import LEARNERS, TASKS
from research.messages import sets as messages
from research.paper import report as paper
from research.second import runnable
from research.sets import DIGITS
from research.tasks import studies
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.results import FILE, Content, policy_info, read_content
from uuv_marl.benchmark.robustness import job as robustness
from uuv_marl.benchmark.robustness.axes import AXES, CALM
from uuv_marl.benchmark.suite import Case
from uuv_marl.errors import PolicyError, ResultsError, ScenarioError
from uuv_marl.scenario import Scenario, load_scenario

_OF_LEARNERS = ("task", "learner", "training", "set", "seed")


class NoEpisodesError(ResultsError):
    """A table that holds no episodes."""


class Source(NamedTuple):
    """Scenario and policy of a row."""

    scenario: Scenario
    """The scenario without the policy's requirements."""
    policy: str


class Kind(NamedTuple):
    """A kind of file, for all of its rows."""

    keys: Sequence[str]
    """Columns that identify an episode; one of them is ``seed``."""
    measured: Sequence[str]
    """All other columns, from the simulation."""
    source: Callable[[Cells], Source]
    """Raises ScenarioError, PolicyError or ResultsError where a row can't be made again here."""
    written: Callable[[Cells, Metrics], Sequence[str]]
    """From a row and its metrics today to the texts of the measured columns."""


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
        """The episode in words."""
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
        table = csv.reader(io.StringIO(read_text(file), newline=""))
        lines = [(table.line_num, line) for line in table]
    except (OSError, EOFError, ValueError, csv.Error) as error:
        raise ResultsError(f"{file} can't be read ({error}); give a file of episodes") from None
    head = lines[0][1] if lines else []
    kind = _kind(head)
    if kind is None:
        raise NoEpisodesError(
            f"{file} holds no episodes: its columns are {', '.join(head) or 'missing'}; give a .csv.gz of docs, "
            f"an episodes.csv of uuv-marl robustness or a benchmark's {FILE}"
        )
    for number, line in lines[1:]:
        if len(line) != len(head):
            raise ResultsError(f"{file}:{number} has {len(line)} cells under {len(head)} columns; correct or remove it")
    return [Row(file, number, kind, dict(zip(head, line, strict=True))) for number, line in lines[1:]]


def _kind(head: Sequence[str]) -> Kind | None:
    """The kind of table that has these columns: those that identify an episode, then metrics."""
    kinds: tuple[tuple[tuple[str, ...], Callable[[Cells], Source], str], ...] = (
        (("set", "policy", "seed"), _set, DIGITS),
        (("scenario", "axis", "level", "policy", "seed"), _robustness, robustness.DIGITS),
        (("scenario", "policy", "seed"), _paper, paper.DIGITS),
    )
    if tuple(head) == (*_OF_LEARNERS, *learners.MEASURES):
        return Kind(_OF_LEARNERS, learners.MEASURES, _learned, _learned_written)
    known = {*Metrics.__annotations__, *studies.METRICS}
    for keys, source, digits in kinds:
        measured = tuple(head[len(keys) :])
        if tuple(head[: len(keys)]) == keys and measured and {*measured} <= known:
            return Kind(keys, measured, source, partial(_written, measured, digits))
    return None


def _written(measured: Sequence[str], digits: str, _: Cells, metrics: Metrics) -> Sequence[str]:
    of_task = [name for name in measured if name in metrics or name in metrics.get("task", {})]
    made = cells_of(metrics, of_task, digits)
    return [made.get(name, "") for name in measured]


def _of(case: Case) -> Source:
    return Source(case.load(), case.policy)


def _set(cells: Cells) -> Source:
    episode_set = next(
        (each for each in (*heldout.SETS, *studies.SETS, *messages.SETS) if each.name == cells["set"]), None
    )
    if episode_set is None:
        raise ResultsError(f"there is no set {cells['set']!r} in this version")
    return _of(Case(episode_set.name, episode_set.scenario, runnable(cells["policy"]), episode_set.overrides))


def _learned(cells: Cells) -> Source:
    task = TASKS.get(cells["task"])
    each = next((each for each in task.sets if each.name == cells["set"]), None) if task else None
    if task is None or each is None:
        raise ResultsError(f"there is no set {cells['set']!r} of task {cells['task']!r} in this version")
    policy = cells["learner"]
    if cells["training"]:
        if policy not in LEARNERS or not cells["training"].isdecimal():
            raise ResultsError(f"there is no training {cells['training']!r} of a learner {policy!r} in this version")
        cell = learners.Cell(task, LEARNERS[policy], int(cells["training"]))
        if not cell.shipped_weights.exists():
            raise PolicyError("no policy of this training is kept; python -m research.learners trains it again")
        policy = cell.policy(cell.shipped_weights)
    return Source(load_scenario(each.scenario, overrides=each.overrides), policy)


def _learned_written(cells: Cells, metrics: Metrics) -> Sequence[str]:
    return list(learners.measures(metrics, _learned(cells).scenario).values())


def _robustness(cells: Cells) -> Source:
    scenario, axis, level = cells["scenario"], cells["axis"], cells["level"]
    levels = {CALM: ("0",)} | {name: tuple(map(str, data.levels)) for name, data in AXES.items()}
    if level not in levels.get(axis, ()):
        raise ResultsError(f"there is no level {level!r} of axis {axis!r} in this version")
    return _of(robustness.case_of(scenario, axis, int(level), cells["policy"]))


def _paper(cells: Cells) -> Source:
    return _of(paper.case_of(cells["scenario"], cells["policy"]))


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
    policy, scenario_data = cells["policy"], content["scenarios"][cells["scenario"]]
    if ":" in (task := str(scenario_data["task"]["name"])):  # its module would be executed
        raise ScenarioError(f"task {task!r} is not part of the package")
    try:
        scenario = Scenario.model_validate_json(json.dumps(scenario_data))
    except ValueError as error:
        raise ScenarioError(f"the scenario has the fields of another version ({error})") from None
    if policy_info(policy)["source"] != content["policies"][policy]["source"]:
        raise PolicyError(f"the file of {policy!r} has changed since the run")
    return Source(scenario, policy)
