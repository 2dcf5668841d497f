"""Entries: a policy's episodes on a task, with what identifies the policy and the code that ran it."""

import hashlib
import inspect
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import pydantic

from research.episodes import Row, cells
from research.sets import DIGITS
from research.tasks.page import tier_sets
from research.tasks.studies import SEEDS, STUDIES
from uuv_marl.atomic import write_text
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.making import policy_requirements
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.results import source_fingerprint
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import load_scenario
from uuv_marl.scenario.messages import explain
from uuv_marl.train.folder import versions

Class = Literal["controller", "network", "oracle"]
_ORACLES = {"path", "link"}
"""Channels that no vehicle could have."""


class Entry(pydantic.BaseModel, frozen=True, extra="forbid"):
    """A policy's episodes on the medium tier of a task."""

    name: str
    """Name in the table."""
    task: Literal["hard_water", "two_swarms", "few_informed", "silent_targets"]
    policy_class: Class
    talks: bool
    """Whether it sends messages."""
    channels: tuple[str, ...]
    """What it observes beyond the sonar and its own motion."""
    digest: str
    """SHA-256 of the checkpoint's tensors, or of the module that holds the class."""
    code: str
    """Fingerprint of the package's code."""
    versions: Mapping[str, str]
    """Of the package and the libraries."""
    episodes: tuple[Mapping[str, str], ...]
    """Set, seed and metrics of each."""


class Kind(NamedTuple):
    """What a policy is, by its requirements."""

    policy_class: Class
    talks: bool
    channels: tuple[str, ...]
    digest: str


def kind_of(policy: str) -> Kind:
    """Class, channels and digest of a policy by its name. Raises PolicyError if the name is unknown."""
    required, made_of = policy_requirements(policy), policy_class(policy)
    trained = isinstance(made_of, Trained)
    source = "" if trained else inspect.getsource(inspect.getmodule(made_of) or made_of)
    return Kind(
        "oracle" if _ORACLES & {*required.channels} else "network" if trained else "controller",
        bool(required.message_entries), tuple(required.channels),
        made_of.checkpoint.digest if trained else hashlib.sha256(source.encode()).hexdigest(),
    )  # fmt: skip


def made(policy: str, task: str, name: str = "") -> Entry:
    """Run a policy on the medium tier of a task.

    Raises:
        ResultsError: there is no such task.
        PolicyError: the policy can't run there.
    """
    if task not in STUDIES:
        raise ResultsError(f"task must be one of {', '.join(STUDIES)}, got {task!r}")
    rows = [row for each in tier_sets(task) for row in _rows(policy, task, each, range(SEEDS))]
    fields = {**kind_of(policy)._asdict(), "code": source_fingerprint(), "versions": versions(), "episodes": rows}
    return Entry.model_validate({"name": name or policy, "task": task, **fields})


def _rows(policy: str, task: str, each: str, seeds: Sequence[int]) -> Iterator[Row]:
    episode_set = STUDIES[task].sets[each]
    scenario = with_policy_requirements(policy, load_scenario(episode_set.scenario, overrides=episode_set.overrides))
    for run in sorted(episodes(scenario, policy, seeds), key=lambda run: run.seed):
        yield {"set": each, "seed": str(run.seed)} | cells(run.metrics, STUDIES[task].metrics, DIGITS)


def check(entry: Entry, policy: str, sample: Sequence[int]) -> None:
    """Run some episodes of an entry again, by their index.

    Raises:
        ResultsError: the policy is another one than the entry's, an episode is missing or is there twice, or differs.
    """
    now = kind_of(policy)
    for field, value in now._asdict().items():
        if getattr(entry, field) != value:
            raise ResultsError(f"{field} of {entry.name} is {getattr(entry, field)}, and of {policy} {value}")
    wanted = [(each, str(seed)) for each in tier_sets(entry.task) for seed in range(SEEDS)]
    if [(row["set"], row["seed"]) for row in entry.episodes] != wanted:
        raise ResultsError(f"{entry.name} must have the episodes {wanted[0]} to {wanted[-1]} once each, in this order")
    for k in sample:
        row = entry.episodes[k]
        (again,) = _rows(policy, entry.task, row["set"], [int(row["seed"])])
        if other := [f"{key} {row.get(key)}, now {value}" for key, value in again.items() if row.get(key) != value]:
            raise ResultsError(f"{entry.name}, set {row['set']}, seed {row['seed']} differs: {'; '.join(other)}")


def save(entry: Entry, path: Path) -> None:
    """Write an entry as JSON."""
    write_text(path, json.dumps(entry.model_dump(mode="json"), indent=1) + "\n")


def load(path: Path) -> Entry:
    """Read the file of ``save``. Raises ResultsError if it is none."""
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path} is no entry: {error}") from None
    try:
        return Entry.model_validate(fields)
    except pydantic.ValidationError as error:
        raise ResultsError(f"{path} is no entry: {explain(error, fields, Entry)}") from None
