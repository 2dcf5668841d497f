"""``python -m research.learners``: learners x tasks x trainings by one protocol, and their page."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer
from filelock import FileLock, Timeout

from research import FOLDER
from research.episodes import Row
from research.learners.cells import EPISODES, Cell, beside, cells, check_protocol, make, read
from research.learners.page import write_page
from research.learners.protocol import LEARNERS, TASKS, TRAININGS
from research.learners.watch import Report
from uuv_marl.atomic import locked
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.errors import ResultsError

app = typer.Typer(add_completion=False)


@app.command()
def main(
    task: Annotated[list[str] | None, typer.Option(help=f"Only this one of {', '.join(TASKS)}; repeat it.")] = None,
    learner: Annotated[
        list[str] | None, typer.Option(help=f"Only this one of {', '.join(LEARNERS)}; repeat it.")
    ] = None,
    trainings: Annotated[int, typer.Option(min=1, help="Of each learner on each task.")] = TRAININGS,
    output: Annotated[Path, path_option("Folder for trainings, episodes, page and pictures.")] = Path(
        "results/learners"
    ),
) -> None:
    """Train every learner on every task, run what it learned in the final episodes, and write learners.md.

    Several processes may share the folder: run the command once for each core. Each takes the next training that
    no process has started, and the process that finds all done writes the page. An interrupted training starts again.

    Example: python -m research.learners --task hard_water --learner MAPPO --trainings 1
    """
    with explained(FOLDER):
        for name, known, what in ((task, TASKS, "task"), (learner, LEARNERS, "learner")):
            if unknown := [each for each in name or [] if each not in known]:
                raise ResultsError(f"{what} must be one of {', '.join(known)}, got {unknown[0]!r}")
        check_protocol(output)
        chosen = cells(task or [], learner or [], trainings)
        with working(f"Finished trainings are in {output}") as bar:
            for k, cell in enumerate(chosen):
                report = progress_line(
                    bar, f"{k + 1} of {len(chosen)}: {cell.learner.name} {cell.task.name} {cell.seed}"
                )
                _make(cell, cell.folder(output), report)
            if task is None and learner is None:
                _write(chosen, output, progress_line(bar, "controllers"))
        console.print(f"  {output}", highlight=False)


def _make(cell: Cell, folder: Path, report: Report) -> None:
    """Run a cell unless it is done, or another process runs it."""
    if (folder / EPISODES).exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    with suppress(Timeout), FileLock(folder.with_suffix(".lock"), timeout=0):
        make(cell, folder, report)


def _write(chosen: list[Cell], output: Path, report: Report) -> None:
    """Write the page if all trainings exist."""
    missing = [cell for cell in chosen if not (cell.folder(output) / EPISODES).exists()]
    if missing:
        console.print(f"  {len(missing)} trainings are not done, here or by another process; run the command again")
        return
    curves: list[Row] = []
    rows: list[Row] = []
    for cell in chosen:
        curve, final = read(cell, cell.folder(output))
        curves += curve
        rows += final
    rows += beside(output, report)
    with locked(output, wait_s=600.0):
        for path in write_page(output, curves, rows):
            console.print(f"  {path}", highlight=False)


if __name__ == "__main__":
    app()
