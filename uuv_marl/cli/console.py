"""Shared parts of all commands: consoles, options, the progress bar, and error messages."""

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
    """Columns of the output: the terminal's (None), 88 in a notebook, else 100, as in docs and logs."""
    if sys.stdout.isatty():
        return None
    return 88 if "JPY_PARENT_PID" in os.environ else 100


console = Console(width=_width())
errors = Console(stderr=True)
Restart = Annotated[
    bool, typer.Option("--restart", help="Drop the runs of policies whose file has changed, and run these again.")
]
MANY_POLICIES = (
    "Name, checkpoint (runs/mine/best), module:Class or team (scout@30%+mappo). Repeat it for several. Default: {}"
)


def overrides_option(examples: str) -> Any:
    """The option ``--set``, with examples in Markdown."""
    return typer.Option("--set", metavar="FIELD=VALUE", help=f"Override a field, such as {examples}.")


_PACKAGE = str(Path(__file__).resolve().parent.parent)
_NOT_THE_USERS = (_PACKAGE, *(sysconfig.get_path(name) for name in ("stdlib", "platlib", "purelib")))
_MOST_FRAMES = 5


def say(words: object) -> None:
    """Print a text as it is, without line breaks and markup, so that its paths and commands can be copied."""
    console.print(str(words), markup=False, highlight=False, soft_wrap=True)


def print_everywhere() -> None:
    """Print a question mark for characters that the terminal's encoding lacks, instead of an error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def path(text: str | Path) -> Path:
    """A path of the command line; ``--help`` shows this function's name as the kind of value."""
    return user_path(text)


def path_option(help_text: str) -> Any:
    """An option for a path."""
    return typer.Option(parser=path, help=help_text)


def path_argument(help_text: str, **more: Any) -> Any:
    """An argument for a path, with further arguments of ``typer.Argument``."""
    return typer.Argument(parser=path, help=help_text, **more)


@contextmanager
def explained(*ours: str) -> Iterator[None]:
    """Turn an error that the user can correct into one message, with the lines of the user's own code.

    ``ours`` are folders, besides the package, whose code is not the user's.
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
        else:
            raise
        errors.print(f"[bold red]Error:[/] {escape(message)}", highlight=False, soft_wrap=True)
        for frame in frames[-_MOST_FRAMES:]:
            where = f"  {frame.filename}:{frame.lineno}, in {frame.name}\n    {frame.line}"
            errors.print(escape(where), highlight=False, soft_wrap=True)
        raise typer.Exit(2) from None


def _own_frames(error: BaseException | None, ours: tuple[str, ...]) -> list[traceback.FrameSummary]:
    """The part of an error's traceback in files outside this package and the libraries."""
    frames = traceback.extract_tb(error.__traceback__ if error else None)
    return [f for f in frames if Path(f.filename).is_file() and not f.filename.startswith((*_NOT_THE_USERS, *ours))]


def progress_bar() -> Progress:
    """A bar for each task, with the remaining time; nothing where the output is not a terminal."""
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console, disable=not console.is_terminal,
    )  # fmt: skip


def progress_line(bar: Progress, name: str, total: float = 1.0) -> Callable[..., None]:
    """A new line of the bar: a function of the finished part of ``total``, and of a text that replaces the name."""
    task = bar.add_task(name, total=total)
    return lambda done, words=name: bar.update(task, completed=done, description=words)


@contextmanager
def working(message: str, alone: Path | None = None) -> Iterator[Progress]:
    """The progress bar of a long task. Ctrl-C ends the command with a message, such as "The trials are in x".

    Args:
        message: a sentence without its full stop.
        alone: folder to lock against other commands.
    """
    try:
        with nullcontext() if alone is None else locked(alone), progress_bar() as bar:
            yield bar
    except KeyboardInterrupt:
        say(f"Stopped. {message}; give the same command to continue.")
        raise typer.Exit(130) from None


def overridden(overrides: Sequence[str]) -> dict[str, object]:
    """The fields that ``--set`` changes. Raises ScenarioError, also for a field given twice."""
    from uuv_marl.scenario import ScenarioError, parse_override

    changes: dict[str, object] = {}
    for field, value in map(parse_override, overrides):
        if field in changes:
            raise ScenarioError(f"--set {field} is given twice, as {changes[field]} and as {value}; leave one out")
        changes[field] = value
    return changes


def changes_of(overrides: Sequence[str]) -> dict[str, object]:
    """The fields that ``--set`` changes in a policy's scenario. Raises ScenarioError or PolicyError."""
    changes = overridden(overrides)
    for field in {"sonar.channels", "actuators.yaw_damping_nms"} & set(changes):
        raise PolicyError(f"{field} can't be set here: every policy has its own (uuv-marl list policies); leave it out")
    return changes


def find_modules(names: Sequence[str]) -> None:
    """Add the current folder to the import path if one of these names or overrides may name a ``module:Class``."""
    if any(":" in name or ".toml" in name for name in names):
        sys.path.append("")  # last, so that no file of this folder hides an installed module
