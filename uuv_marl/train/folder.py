"""The folder of a training: its description, a row per iteration, and the last checkpoint, complete at any time."""

import json
import re
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import TypeAdapter

from uuv_marl import __version__
from uuv_marl.atomic import locked, write_text, writing
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.registry import policy_class
from uuv_marl.errors import PolicyError, ResultsError, RewardError, ScenarioError, TrainingError
from uuv_marl.modules import file_digest
from uuv_marl.scenario.overrides import leaves
from uuv_marl.train.training import LEARNER, Training

_CHECKPOINT_NAME = re.compile(r"\d{6,}(\.partial)?")
"""Names of checkpoints; everything else under ``checkpoints`` is the user's."""
_HIDDEN = re.compile(r"\..*|config\.partial\.json")
"""Files that a start may leave if it is killed before it writes its settings."""
_LIBRARIES = ("torch", "numpy", "numba", "safetensors")

Say = Callable[[str], object]
"""Called with messages about the progress of a training."""

Stop = Callable[[], bool]
"""Called after every iteration; the training ends with a checkpoint once it returns True."""


class Record(NamedTuple):
    """One iteration, a row of ``progress.csv``."""

    iteration: int = 0
    agent_steps: int = 0
    seconds: float = 0.0
    """Processor time of the training so far, validations apart."""
    reward: float | None = None
    """Mean per decision and vehicle in this iteration, less the cost of collisions."""
    kl: float | None = None
    """Divergence from the policy that sampled, or from the expert while it is imitated, to the updated policy."""
    explained: float | None = None
    """Share of the returns' variance that the critic explains."""
    best: float | None = None
    """Score of the best validation so far."""
    swarm_success: float | None = None
    """From this iteration's ``validation.Validation``, as the next three; None without one."""
    share: float | None = None
    collisions: float | None = None
    time_s: float | None = None

    def spent(self, training: Training) -> float:
        """The part of the budget that is spent, in its unit: agent-steps, or seconds."""
        return self.agent_steps if training.steps else self.seconds


class TrainingFolder:
    """``config.json``, ``progress.csv`` and ``checkpoints/`` of a training, see ``opened``.

    Nothing is written before ``begin``.

    Args:
        path: a new or empty folder, or that of an earlier training.
        training: description of a new training; None to resume the one in the folder.

    Raises:
        ResultsError: the folder is in use, or holds no training to resume.
    """

    def __init__(self, path: Path, training: Training | None) -> None:
        self.path, self._checkpoints, self._table = path, path / "checkpoints", path / "progress.csv"
        self.until = 0.0
        """The budget of the latest run: agent-steps, or seconds."""
        self.record = Record()
        """The last iteration with a checkpoint; iteration 0 where there is none."""
        self.resume_note = ""
        """Message that says where a resumed training starts."""
        if training is None:
            self.training, version_note = self._read()
            self.resume_note = self._find() + version_note
            return
        self.training, self.until = training, training.budget
        if path.exists() and not (path.is_dir() and self._holds_nothing()):
            raise ResultsError(f"{path} is not empty; give --resume to continue it, or another --output")

    def _holds_nothing(self) -> bool:
        """Whether the folder is empty, or only holds a training that ended before its first checkpoint."""
        names = {inner.name for inner in self.path.iterdir() if not _HIDDEN.fullmatch(inner.name)}
        started = {"config.json", self._table.name, self._checkpoints.name}
        return not names or (names <= started and "config.json" in names and not self._found())

    def _found(self) -> list[Path]:
        """Folders of checkpoints that are complete."""
        return [path for path in self._checkpoints.glob("*") if path.name.isdecimal() and _ours(path)]

    def _read(self) -> tuple[Training, str]:
        """The training that the folder holds, and a message if other versions ran it before."""
        try:
            config = json.loads((self.path / "config.json").read_text(encoding="utf-8"))
            before, saved_versions = dict(config["scenarios"]), dict(config["versions"])
            self.until, training = float(config["until"]), Training(**config["training"])
            scenarios_now = _inputs(training)
        except (ScenarioError, PolicyError, RewardError, TrainingError) as error:
            raise ResultsError(
                f"the training in {self.path} can't be loaded here: {error}; resume it where it was started"
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ResultsError(
                f"{self.path} holds no training to resume (config.json: {error}); leave out --resume, and give an "
                "empty --output"
            ) from None
        for name, content in scenarios_now.items():
            then, now = leaves(before.get(name, content)), leaves(content)
            if field := next((field for field in {**now, **then} if then.get(field) != now.get(field)), None):
                raise ResultsError(
                    f"{self.path} was started with {field} = {then.get(field)}, and {field} is {now.get(field)} now; "
                    f"restore {name}, or start again with another --output"
                )
        other = [f"{name} {old}" for name, old in saved_versions.items() if old != versions().get(name)]
        note = f"; earlier parts ran with {', '.join(other)}, so the result is not bit-identical" if other else ""
        return training, note

    def _find(self) -> str:
        """Find the last checkpoint; where the training starts, as a message."""
        if not (checkpoints := self._found()):
            return f"{self.path} holds no checkpoint yet: starting from the beginning"
        last = max(checkpoints, key=lambda path: int(path.name))
        try:
            self.record = TypeAdapter(Record).validate_json((last / "record.json").read_bytes())
            if self.record.iteration != int(last.name):
                raise ValueError
        except (OSError, ValueError) as error:
            raise ResultsError(
                f"{last} is incomplete (record.json: {getattr(error, 'strerror', None) or 'damaged'}); copy the whole "
                "folder again, or delete it to continue from what is left"
            ) from None
        return f"resuming from iteration {self.record.iteration}, {self.record.agent_steps:,} agent-steps"

    def budget_with(self, minutes: float | None, steps: float | None) -> float:
        """The total budget of a resumed training in its own unit: agent-steps, or seconds.

        Raises:
            TrainingError: the given budget has the other unit.
        """
        kind, other = ("steps", "minutes") if self.training.steps else ("minutes", "steps")
        budgets = {"minutes": minutes and 60.0 * minutes, "steps": steps}
        if budgets[other] is not None:
            raise TrainingError(f"the training in {self.path} has a budget of {kind}; give --{kind}, not --{other}")
        return float(budgets[kind] or self.until)

    @property
    def checkpoint(self) -> Path | None:
        """Folder of the last checkpoint."""
        return self._checkpoints / f"{self.record.iteration:06d}" if self.record.iteration else None

    def begin(self, until: float) -> None:
        """Prepare the folder for the next iteration, and write the settings, budget and versions."""
        config = {
            "training": self.training.model_dump(mode="json"),
            "scenarios": _inputs(self.training),
            "until": until,
            "versions": versions(),
        }
        write_text(self.path / "config.json", json.dumps(config, indent=1) + "\n")
        with writing(self._checkpoints):
            self._checkpoints.mkdir(exist_ok=True)
        # Iterations after the last checkpoint run again.
        rows = [row for row in self.rows() if int(row[0]) <= self.record.iteration]
        write_text(self._table, "".join(map(_line, [Record._fields, *rows])))

    def note(self, record: Record) -> None:
        """Append the row of an iteration."""
        with writing(self._table), self._table.open("a", encoding="utf-8") as file:
            file.write(_line(record))

    def keep(self, record: Record, save: Callable[[Path], object]) -> None:
        """Write a checkpoint by ``save(folder)``, then delete older ones.

        Raises:
            ResultsError: it can't be written; the previous one stays unchanged.
        """
        folder = self._checkpoints / f"{record.iteration:06d}"
        partial = folder.with_suffix(".partial")
        with writing(folder):
            shutil.rmtree(partial, ignore_errors=True)
            save(partial.resolve())
            (partial / "record.json").write_text(json.dumps(record._asdict()) + "\n", encoding="utf-8")
            shutil.rmtree(folder, ignore_errors=True)
            partial.rename(folder)  # atomic
        self.record = record
        for other in self._checkpoints.iterdir():
            if other != folder and _ours(other):
                shutil.rmtree(other, ignore_errors=True)

    def rows(self) -> list[list[str]]:
        """Rows of ``progress.csv``, without its header and damaged lines."""
        lines = self._table.read_text(encoding="utf-8", errors="replace").splitlines() if self._table.exists() else []
        rows = [line.split(",") for line in lines]
        return [row for row in rows if len(row) == len(Record._fields) and row[0].isdecimal()]


@contextmanager
def opened(path: Path, training: Training | None, say: Say) -> Iterator[TrainingFolder]:
    """The folder of a training, locked for the block; arguments as for ``TrainingFolder``.

    ``say`` is called with where a resumed training starts.

    Raises:
        ResultsError: the folder is in use, holds no training to resume, or can't be written.
    """
    TrainingFolder(path, training)  # refuses before anything is written
    with locked(path):
        folder = TrainingFolder(path, training)
        if folder.resume_note:
            say(folder.resume_note)
        yield folder


def _inputs(training: Training) -> dict[str, Any]:
    """Inputs of a training beyond its description, by name: its scenarios, and digests of what it uses.

    These are checkpoints, and the files of tasks, rewards and policies that are not of the package.
    """
    contents: dict[str, Any] = {part.name: part.scenario.model_dump(mode="json") for part in training.parts}
    for scenario in (part.scenario for part in training.parts):
        if ":" in scenario.task.name:
            contents[scenario.task.name] = {"task": f"{scenario.task.name} ({file_digest(scenario.task_class)})"}
    if training.reward and ":" in training.reward:
        training.reward_for(training.loaded)  # imports its module
        module = sys.modules[training.reward.partition(":")[0]]
        contents[training.reward] = {"reward": f"{training.reward} ({file_digest(module)})"}
    others = training.team(LEARNER).members[:-1] if training.others else ()
    for role, name in [("expert", training.expert), *(("others", member) for member in others)]:
        policy_type = policy_class(name) if name else None
        if isinstance(policy_type, Trained):
            contents[name] = {role: f"{name} ({policy_type.checkpoint.digest})"}
        elif ":" in name:
            contents[name] = {role: f"{name} ({file_digest(policy_type)})"}
    return contents


def versions() -> dict[str, str]:
    """Versions of this package and of the libraries that a training depends on."""
    return {"uuv_marl": __version__, **{library: version(library) for library in _LIBRARIES}}


def _ours(path: Path) -> bool:
    return bool(_CHECKPOINT_NAME.fullmatch(path.name)) and path.is_dir() and not path.is_symlink()


def _line(row: Sequence[object]) -> str:
    return ",".join("" if value is None else str(value) for value in row) + "\n"
