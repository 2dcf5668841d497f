"""``python -m research.tasks``: run every policy on a task other than the paper's, and write the task's page."""

from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.episodes import write_rows
from research.sets import run
from research.tasks.page import report
from research.tasks.studies import STUDIES
from uuv_marl.atomic import locked, write_text
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.errors import ResultsError

app = typer.Typer(add_completion=False)


@app.command()
def main(
    task: Annotated[str, typer.Argument(help=f"One of {', '.join(STUDIES)}.")],
    only: Annotated[
        list[str] | None, typer.Option(help="Run only this set, such as hard_water-gate. Repeat it for several sets.")
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=10_000, help="At most this many seeds. Default: all.")] = None,
    output: Annotated[Path, path_option("Folder for results and page.")] = Path("results/tasks"),
) -> None:
    """Run every policy on the sets of a task, and write its page from them.

    The folder gets TASK.md and all rows. Ctrl-C keeps the finished episodes; the same command continues.

    Example: python -m research.tasks hard_water --only hard_water-gate --seeds 8
    """
    with explained(FOLDER):
        if task not in STUDIES:
            raise ResultsError(f"task must be one of {', '.join(STUDIES)}, got {task!r}")
        with working(f"The finished episodes are in {output}") as bar:
            progress, sets = progress_line(bar, task), list(STUDIES[task].sets.values())
            rows = run(
                output, sets, only or [], seeds, STUDIES[task].metrics, lambda what, share: progress(share, what[-60:])
            )
            progress(1.0)
        if not only:
            with locked(output, wait_s=60.0):
                write_rows(output / f"{task}.csv.gz", rows)
                write_text(output / f"{task}.md", report(task, rows))
        console.print(f"  {output}", highlight=False)


if __name__ == "__main__":
    app()
