"""A training on disk: its settings, a row per iteration, and the last checkpoint, whole at any time."""

import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import TypeAdapter

from uuv_marl import __version__
from uuv_marl.atomic import locked, write_text, writing
from uuv_marl.errors import ResultsError
from uuv_marl.scenario.overrides import plain

_MADE_HERE = re.compile(r"\d{6,}(\.partial)?")
"""Names of checkpoints; everything else under ``checkpoints`` is the user's."""
_HIDDEN = re.compile(r"\..*|config\.partial\.json")
"""What a first start may leave behind that was killed before it wrote its settings."""

R = TypeVar("R", bound=Any)
"""A NamedTuple with ``iteration`` and ``agent_steps``: a row of ``progress.csv``."""
Say = Callable[[str], object]
"""Tells whoever started a training how it goes on."""


def quiet(_: str) -> None:
    """Says nothing."""


class TrainingFolder(Generic[R]):
    """``config.json``, ``progress.csv`` and ``checkpoints/`` of a training; ``opened`` makes one.

    Nothing is written before ``begin``.

    Args:
        path: new or empty, or with ``resume`` that of an earlier training.
        settings: what must be the same throughout a training, as JSON can hold it once it is plain.
        resume: go on with what the folder holds.
        start: the record before the first iteration, all of whose fields have defaults.

    Raises:
        ResultsError: the folder is used, holds no training, or one of other settings.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any], resume: bool, start: R) -> None:
        self.path = path
        self._settings: dict[str, Any] = json.loads(json.dumps(plain(settings)))
        self._sessions: list[dict[str, Any]] = []
        self._start = start
        self.record: R = start
        """The last iteration that is kept; iteration 0 where there is none."""
        self.found = ""
        """What a resume goes on from, in words."""
        if resume:
            self._resume()
        elif path.exists() and not (path.is_dir() and all(_HIDDEN.fullmatch(inner.name) for inner in path.iterdir())):
            raise ResultsError(f"{path} is not empty; give --resume to continue it, or another --output")

    def _resume(self) -> None:
        try:
            config = json.loads((self.path / "config.json").read_text(encoding="utf-8"))
            before, self._sessions = dict(config["settings"]), list(config["sessions"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ResultsError(
                f"{self.path} holds no training to resume (config.json: {error}); leave out --resume, and give an "
                "empty --output"
            ) from None
        other = _differences(before, self._settings)
        if other:
            field, then, now = other[0]
            remedy = ", or another --output"
            if field == "steps":
                remedy = ", or more: noise and rates anneal over them"
            raise ResultsError(
                f"{self.path} was begun with {field} = {then}, and {field} is {now} now; give the same options{remedy}"
            )
        self._find()

    def _find(self) -> None:
        """The last whole checkpoint."""
        broken = ""
        made = [path for path in self._checkpoints.glob("*") if path.name.isdecimal() and _ours(path)]
        for path in sorted(made, reverse=True):
            try:
                text = (path / "record.json").read_text(encoding="utf-8")
                record = TypeAdapter(type(self._start)).validate_json(text)
                if record.iteration != int(path.name):
                    raise ValueError
            except (OSError, ValueError) as error:
                broken = f"{path} is incomplete (record.json: {getattr(error, 'strerror', None) or 'damaged'}); "
            else:
                self.record = record
                done = f"iteration {record.iteration}, {record.agent_steps:,} agent-steps"
                self.found = f"{broken}going on from {done}"
                return
        if broken:
            raise ResultsError(f"{broken}copy it again as a whole, or delete it to start at the beginning")
        self.found = f"{self.path} holds no checkpoint yet: starting at the beginning"

    @property
    def _checkpoints(self) -> Path:
        return self.path / "checkpoints"

    @property
    def checkpoint(self) -> Path | None:
        """Where the last iteration's checkpoint is."""
        return self._checkpoints / f"{self.record.iteration:06d}" if self.record.iteration else None

    def begin(self, session: Mapping[str, Any], libraries: Sequence[str]) -> None:
        """Make the folder ready for the next iteration, and note how it comes about: seeds, versions."""
        now = {"agent_steps": self.record.agent_steps, **session, "versions": versions(libraries)}
        config = plain({"settings": self._settings, "sessions": [*self._sessions, now]})
        write_text(self.path / "config.json", json.dumps(config, indent=1) + "\n")
        with writing(self._checkpoints):
            self._checkpoints.mkdir(exist_ok=True)
        lines = self._table.read_text(encoding="utf-8", errors="replace").splitlines() if self._table.exists() else []
        rows = [line.split(",") for line in lines]
        # An iteration whose checkpoint was cut off will come again.
        kept = [row for row in rows if row[0].isdecimal() and int(row[0]) <= self.record.iteration]
        write_text(self._table, "".join(map(_line, [self._start._fields, *kept])))

    def note(self, record: R) -> None:
        """A row for an iteration."""
        with writing(self._table), self._table.open("a", encoding="utf-8") as file:
            file.write(_line(record))

    def keep(self, record: R, save: Callable[[Path], object]) -> None:
        """A checkpoint, which ``save`` writes into the folder it is given; older ones go, once it is whole.

        Raises:
            ResultsError: it can't be written; the one before is as it was.
        """
        folder = self._checkpoints / f"{record.iteration:06d}"
        partial = folder.with_suffix(".partial")
        with writing(folder):
            shutil.rmtree(partial, ignore_errors=True)
            save(partial.resolve())
            (partial / "record.json").write_text(json.dumps(record._asdict()) + "\n", encoding="utf-8")
            shutil.rmtree(folder, ignore_errors=True)  # where it was incomplete
            partial.rename(folder)  # whole from the moment when it is there
        self.record = record
        for other in self._checkpoints.iterdir():
            if other != folder and _ours(other):
                shutil.rmtree(other, ignore_errors=True)

    @property
    def _table(self) -> Path:
        return self.path / "progress.csv"


@contextmanager
def opened(
    path: Path, settings: Mapping[str, Any], resume: bool, start: R, say: Say = quiet
) -> Iterator[TrainingFolder[R]]:
    """The folder of a training, for the block alone.

    Args:
        path: new or empty, or with ``resume`` that of an earlier training.
        settings: what must be the same throughout a training, as JSON can hold it once it is plain.
        resume: go on with what the folder holds.
        start: the record before the first iteration, all of whose fields have defaults.
        say: told from where a resume goes on.

    Raises:
        ResultsError: the folder is used, by another process too, holds no training, or one of other settings, or it
            can't be written.
    """
    TrainingFolder(path, settings, resume, start)  # refuses before anything is written
    with locked(path):
        folder = TrainingFolder(path, settings, resume, start)
        if folder.found:
            say(folder.found)
        yield folder


def begun_with(path: Path) -> dict[str, Any]:
    """The settings that a training was begun with; empty where there is none that can be read."""
    try:
        return dict(json.loads((path / "config.json").read_text(encoding="utf-8"))["settings"])
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def steps_before(path: Path) -> int:
    """Agent-steps to which a training was to go when it was run last; 0 where none can be read."""
    try:
        config = json.loads((path / "config.json").read_text(encoding="utf-8"))
        return int(config["sessions"][-1].get("steps", config["settings"]["steps"]))
    except (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError):
        return 0


def versions(libraries: Sequence[str]) -> dict[str, str]:
    """Versions of this package and of libraries."""
    return {"uuv_marl": __version__, **{library: version(library) for library in libraries}}


def _ours(path: Path) -> bool:
    return bool(_MADE_HERE.fullmatch(path.name)) and path.is_dir() and not path.is_symlink()


def _line(row: Sequence[object]) -> str:
    return ",".join("" if value is None else str(value) for value in row) + "\n"


def _differences(then: Any, now: Any, field: str = "") -> list[tuple[str, object, object]]:
    """Where settings are not what they were: field, before, now."""
    if isinstance(then, dict) and isinstance(now, dict):
        names = ((name, f"{field}.{name}" if field else name) for name in {**now, **then})
        return [found for name, path in names for found in _differences(then.get(name), now.get(name), path)]
    return [] if then == now else [(field, then, now)]
