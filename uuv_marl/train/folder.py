"""A training on disk: its settings, a row per iteration, and the last checkpoint, whole at any time."""

import csv
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from uuv_marl.benchmark.results import ResultsError


class Row(Protocol):
    """A NamedTuple that is a row of ``progress.csv``."""

    @property
    def iteration(self) -> int:
        """From 1; 0 before the first."""
        ...

    @property
    def _fields(self) -> tuple[str, ...]: ...

    def _asdict(self) -> dict[str, Any]: ...


R = TypeVar("R", bound=Row)


class Record(NamedTuple):
    """One iteration, a row of ``progress.csv``."""

    iteration: int = 0
    agent_steps: int = 0
    """Sampled so far; one is one decision of one vehicle."""
    episode_return: float | None = None
    """Mean over the episodes that ended in this iteration, and over vehicles; None where none ended."""
    episode_length: float | None = None
    """Decisions, mean over the same episodes."""
    seconds: float = 0.0
    """Spent on training so far."""


class TrainingFolder(Generic[R]):
    """``config.json``, ``progress.csv`` and ``checkpoints/`` of a training.

    Nothing is written before ``begin``.

    Args:
        path: new or empty, or with ``resume`` that of an earlier training.
        settings: what must be the same throughout a training, as JSON can hold it.
        resume: go on with what the folder holds.
        start: the record before the first iteration, all of whose fields have defaults.

    Raises:
        ResultsError: the folder is used, holds no training, or one of other settings.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any], resume: bool, start: R) -> None:
        self.path = path
        self._settings: dict[str, Any] = json.loads(json.dumps(settings))
        self._sessions: list[dict[str, Any]] = []
        self._start = start
        self.record = start
        """The last iteration that is kept; iteration 0 where there is none."""
        if resume:
            self._resume()
        elif path.exists() and (not path.is_dir() or any(path.iterdir())):
            raise ResultsError(f"{path} is not empty; give --resume to go on with it, or another --output")

    def _resume(self) -> None:
        try:
            config = json.loads((self.path / "config.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ResultsError(
                f"{self.path} holds no training to resume ({error}); leave out --resume, and give an empty --output"
            ) from None
        for name, value in self._settings.items():
            if config["settings"].get(name) != value:
                raise ResultsError(
                    f"{self.path} was trained with another {name}; give the same options, or another --output"
                )
        self._sessions = config["sessions"]
        finished = [path for path in self._checkpoints.glob("*/record.json") if path.parent.suffix != ".partial"]
        if finished:
            self.record = type(self._start)(**json.loads(max(finished).read_text(encoding="utf-8")))

    @property
    def _checkpoints(self) -> Path:
        return self.path / "checkpoints"

    @property
    def checkpoint(self) -> Path | None:
        """Where the last iteration's checkpoint is."""
        return self._checkpoints / f"{self.record.iteration:06d}" if self.record.iteration else None

    def begin(self, session: Mapping[str, Any]) -> None:
        """Make the folder ready for the next iteration, and note how it comes about: seeds, versions."""
        try:
            self._checkpoints.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(f"{self.path} can't be written ({error.strerror}); give another --output") from None
        config = {"settings": self._settings, "sessions": [*self._sessions, dict(session)]}
        (self.path / "config.json").write_text(json.dumps(config, indent=1) + "\n", encoding="utf-8")
        # An iteration whose checkpoint was cut off will come again.
        kept = [row for row in self._rows() if int(row[0]) <= self.record.iteration]
        with self._table.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([self._start._fields, *kept])

    def keep(self, record: R, save: Callable[[Path], object]) -> None:
        """A row, then the checkpoint, which ``save`` writes into the folder it is given; older ones go."""
        with self._table.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(record._asdict().values())
        folder = self._checkpoints / f"{record.iteration:06d}"
        partial = folder.with_suffix(".partial")
        shutil.rmtree(partial, ignore_errors=True)
        save(partial.resolve())
        (partial / "record.json").write_text(json.dumps(record._asdict()) + "\n", encoding="utf-8")
        partial.rename(folder)  # whole from the moment when it is there
        self.record = record
        for other in self._checkpoints.iterdir():
            if other != folder:
                shutil.rmtree(other)

    @property
    def _table(self) -> Path:
        return self.path / "progress.csv"

    def _rows(self) -> Sequence[list[str]]:
        if not self._table.exists():
            return []
        with self._table.open(newline="", encoding="utf-8") as file:
            return list(csv.reader(file))[1:]
