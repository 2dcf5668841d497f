"""``python -m research.messages``: policies that send messages, with fewer bits, longer rounds and losses."""

from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.messages.page import write_page
from research.messages.sets import TASKS
from research.sets import run
from uuv_marl.atomic import locked
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.errors import ResultsError

app = typer.Typer(add_completion=False)


@app.command()
def main(
    only: Annotated[
        list[str] | None,
        typer.Option(help="Run only this task. Repeat it for several."),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="At most this many seeds of a policy on a set. Default: all.")
    ] = None,
    output: Annotated[Path, path_option("Folder for results, page and pictures.")] = Path("results/messages"),
) -> None:
    """Run policies that send messages with modems of few bits, long rounds and losses, and write messages.md.

    Ctrl-C keeps the finished episodes; the same command continues. All sets take about 40 minutes of one core.

    Example: python -m research.messages --only few_informed --seeds 5
    """
    with explained(FOLDER):
        if unknown := {*(only or [])} - {task.task for task in TASKS}:
            raise ResultsError(f"only must be one of {', '.join(task.task for task in TASKS)}, got {unknown.pop()!r}")
        chosen = [task for task in TASKS if not only or task.task in only]
        with working(f"The finished episodes are in {output}") as bar:
            report = progress_line(bar, "messages")
            rows = [
                {"set": row["set"], "policy": row["policy"], "seed": row["seed"], "share": row[task.metric]}
                for task in chosen
                for row in run(
                    output, [*task.sets()], [], seeds, [task.metric], lambda what, share: report(share, what[-60:])
                )
            ]
            report(1.0)
        with locked(output, wait_s=60.0):
            for path in write_page(output, rows):
                console.print(f"  {path}", highlight=False)


if __name__ == "__main__":
    app()
