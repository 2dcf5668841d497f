"""What all commands share: the consoles, the progress bar, and errors that say what to do."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from uuv_marl.errors import ClusterError, PolicyError, ResultsError, ScenarioError

# Piped output keeps a width at which tables are legible.
console = Console(width=None if sys.stdout.isatty() else 130)
errors = Console(stderr=True)


@contextmanager
def explained() -> Iterator[None]:
    """Turn what a user can mend into one message, without a traceback."""
    try:
        yield
    except (ScenarioError, PolicyError, ResultsError, ClusterError) as error:
        errors.print(f"[bold red]Error:[/] {escape(str(error))}", highlight=False)
        raise typer.Exit(2) from None


@contextmanager
def extra(name: str, what: str) -> Iterator[None]:
    """Say which extra to install where a library is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise PolicyError(
            f"{what} needs {error.name}: install the extra, in the checkout: pip install -e '.[{name}]'"
        ) from None


def progress_bar() -> Progress:
    """A bar for each task, with the time that is left."""
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console,
    )  # fmt: skip
