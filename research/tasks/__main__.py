"""``python -m research.tasks``: every policy on a task that is not the paper's, and the task's page."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.episodes import Row, read_rows, write_rows
from research.sets import run
from research.tasks.figures import draw_curves
from research.tasks.page import report
from research.tasks.studies import STUDIES
from uuv_marl.atomic import locked, write_text
from uuv_marl.benchmark.style import house_style
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
    output: Annotated[Path, path_option("Folder for results, page and picture.")] = Path("results/tasks"),
) -> None:
    """Run every policy on the sets of a task, and write its page with the trainings that lie in OUTPUT/learned/TASK.

    The folder gets TASK.md, the rows of all episodes and a picture of the learners' curves. Ctrl-C keeps the finished
    episodes; the same command continues.

    Example: python -m research.tasks hard_water --only hard_water-gate --seeds 8
    """
    with explained(FOLDER):
        if task not in STUDIES:
            raise ResultsError(f"task must be one of {', '.join(STUDIES)}, got {task!r}")
        with working(f"The finished episodes are in {output}") as bar:
            told, sets = progress_line(bar, task), list(STUDIES[task].sets.values())
            rows = run(
                output, sets, only or [], seeds, STUDIES[task].metrics, lambda what, share: told(share, what[-60:])
            )
            told(1.0)
        if not only:
            with locked(output, wait_s=60.0), house_style():
                _write(task, output, rows)
        console.print(f"  {output}", highlight=False)


def _write(task: str, output: Path, rows: Sequence[Row]) -> None:
    """The page, its rows and its picture."""
    trainings = sorted(path.parent for path in (output / "learned" / task).glob("*/episodes.csv"))
    if not trainings:
        raise ResultsError(f"{output / 'learned' / task} holds no training; run python -m research.tasks.learn {task}")
    episodes = [row for folder in trainings for row in read_rows(folder / "episodes.csv")]
    curves = [{"learner": folder.name, **row} for folder in trainings for row in read_rows(folder / "curve.csv")]
    write_rows(output / f"{task}.csv.gz", rows)
    write_rows(output / f"learned_{task}.csv.gz", episodes)
    write_rows(output / f"curves_{task}.csv", curves)
    write_text(output / f"{task}.md", report(task, rows, episodes))
    draw_curves(curves, STUDIES[task].headline, output / "figures" / f"{task}_curves.png")


if __name__ == "__main__":
    app()
