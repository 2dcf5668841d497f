"""What all commands share: the consoles, the progress bar, and errors that say what to do."""

import errno
import io
import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from uuv_marl.atomic import locked
from uuv_marl.errors import USER_ERRORS, PolicyError
from uuv_marl.extras import extra as extra  # noqa: PLC0414 - commands take all that they share from here
from uuv_marl.paths import user_path


def _width() -> int | None:
    """Columns: those of the terminal (None), those that fit a notebook, else 100, as docs and logs have."""
    if sys.stdout.isatty():
        return None
    return 88 if "JPY_PARENT_PID" in os.environ else 100  # Jupyter gives it to all that a kernel starts


console = Console(width=_width())
errors = Console(stderr=True)
Restart = Annotated[
    bool, typer.Option("--restart", help="Drop the runs of policies whose file has changed since, and run these again.")
]

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
_PACKAGE = str(Path(__file__).resolve().parent.parent)
_NOT_THE_USERS = (_PACKAGE, *(sysconfig.get_path(name) for name in ("stdlib", "platlib", "purelib")))
_MOST_FRAMES = 5


def say(words: object) -> None:
    """Print words with paths and commands in them, which no end of a line and no brackets may change."""
    console.print(str(words), markup=False, highlight=False, soft_wrap=True)


def print_everywhere() -> None:
    """Print a question mark for what the terminal's encoding lacks: no finished work fails while it is told of."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def path(text: str | Path) -> Path:
    """A path of the command line; ``--help`` shows this function's name as the kind of value."""
    return user_path(text)


def path_option(help_text: str) -> Any:
    """An option that takes a path, with its help."""
    return typer.Option(parser=path, help=help_text)


def path_argument(help_text: str, **more: Any) -> Any:
    """An argument that takes a path, with its help, and more of what ``typer.Argument`` takes."""
    return typer.Argument(parser=path, help=help_text, **more)


@contextmanager
def explained(*ours: str) -> Iterator[None]:
    """Turn what a user can mend into one message: no traceback but the lines of the user's own code.

    Args:
        ours: folders, beside the package, whose code is not the user's.
    """
    try:
        yield
    except typer.Exit:
        raise
    except Exception as error:
        frames = _own_frames(error, ours) or _own_frames(error.__cause__, ours)
        if isinstance(error, USER_ERRORS):
            message = str(error)
        elif frames:
            message = f"{type(error).__name__}: {error}"
        elif isinstance(error, OSError) and error.errno in _FULL:
            message = (
                f"{error.filename or 'a file'} can't be written ({error.strerror}); what was finished before is safe"
            )
        else:
            raise
        errors.print(f"[bold red]Error:[/] {escape(message)}", highlight=False, soft_wrap=True)
        for frame in frames[-_MOST_FRAMES:]:
            where = f"  {frame.filename}:{frame.lineno}, in {frame.name}\n    {frame.line}"
            errors.print(escape(where), highlight=False, soft_wrap=True)
        raise typer.Exit(2) from None


def _own_frames(error: BaseException | None, ours: tuple[str, ...]) -> list[traceback.FrameSummary]:
    """The part of an error's traceback that lies in files which belong to neither this package nor a library."""
    frames = traceback.extract_tb(error.__traceback__ if error else None)
    return [f for f in frames if Path(f.filename).is_file() and not f.filename.startswith((*_NOT_THE_USERS, *ours))]


def progress_bar() -> Progress:
    """A bar for each task, with the time that is left; nothing where output is no terminal."""
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console, disable=not console.is_terminal,
    )  # fmt: skip


def progress_line(bar: Progress, name: str, total: float = 1.0) -> Callable[..., None]:
    """A new line of the bar: to be called with how much of ``total`` is done, and with words in place of the name."""
    task = bar.add_task(name, total=total)
    return lambda done, words=name: bar.update(task, completed=done, description=words)


@contextmanager
def working(message: str, alone: Path | None = None) -> Iterator[Progress]:
    """The progress bar of a long work. Ctrl-C ends the command and says what is kept: "The trials are in x".

    Args:
        kept: a sentence without its end.
        alone: the folder that no other command may write to meanwhile.
    """
    try:
        with nullcontext() if alone is None else locked(alone), progress_bar() as bar:
            yield bar
    except KeyboardInterrupt:
        say(f"Stopped. {message}; the same command continues.")
        raise typer.Exit(130) from None


def overridden(overrides: Sequence[str]) -> dict[str, object]:
    """The fields that ``--set`` changes. Raises ScenarioError, also where one is given twice."""
    from uuv_marl.scenario import ScenarioError, parse_override

    changes: dict[str, object] = {}
    for field, value in map(parse_override, overrides):
        if field in changes:
            raise ScenarioError(f"--set {field} is given twice, as {changes[field]} and as {value}; leave one out")
        changes[field] = value
    return changes


def changes_of(overrides: Sequence[str]) -> dict[str, object]:
    """The fields that ``--set`` changes in scenarios that policies run on. Raises ScenarioError, PolicyError."""
    changes = overridden(overrides)
    for field in {"sonar.channels", "actuators.yaw_damping_nms"} & set(changes):
        raise PolicyError(f"{field} can't be set here: every policy has its own (uuv-marl list policies); leave it out")
    return changes


def find_modules(names: Sequence[str]) -> None:
    """Let ``module:Class`` be looked for in the current folder too, where a name or a file may ask for one.

    Args:
        names: of policies, scenarios and tasks, or whole overrides.
    """
    if any(":" in name or ".toml" in name for name in names):
        sys.path.append("")  # last, so that no file of this folder takes the place of an installed module
