"""``python -m research.hard_water``: every policy on maps of hard water, and the page of them."""

from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.episodes import read_rows, write_rows
from research.hard_water.figures import draw_curves
from research.hard_water.page import report
from research.hard_water.sets import METRICS, SETS
from research.sets import run
from uuv_marl.atomic import locked, write_text
from uuv_marl.benchmark.style import house_style
from uuv_marl.cli.console import console, explained, path_option, progress_line, working

app = typer.Typer(add_completion=False)


@app.command()
def main(
    only: Annotated[
        list[str] | None, typer.Option(help="Run only this set, such as medium-gate-10. Repeat it for several sets.")
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=10_000, help="At most this many maps. Default: all.")] = None,
    learned: Annotated[Path, path_option("Folder of research.hard_water.learn.")] = Path("runs/hard_water"),
    output: Annotated[Path, path_option("Folder for results, page and picture.")] = Path("results/hard_water"),
) -> None:
    """Run every policy on maps of each tier, kind and size of swarm, and write the page with the learners' trainings.

    The folder gets hard_water.md, the rows of all episodes and a picture of the learners' curves. Ctrl-C keeps the
    finished episodes; the same command continues.

    Example: python -m research.hard_water --only medium-gate-10 --seeds 8
    """
    with explained(FOLDER):
        with working(f"The finished episodes are in {output}") as bar:
            told = progress_line(bar, "hard water")
            rows = run(output, SETS, only or [], seeds, METRICS, lambda what, share: told(share, what[-60:]))
            told(1.0)
        with locked(output, wait_s=60.0), house_style():
            write_rows(output / "hard_water.csv.gz", rows)
            trainings = sorted(path.parent for path in learned.glob("*/episodes.csv"))
            if trainings and not only:
                episodes = [row for folder in trainings for row in read_rows(folder / "episodes.csv")]
                curves = [{"learner": f.name, **row} for f in trainings for row in read_rows(f / "curve.csv")]
                write_rows(output / "hard_water_learners.csv.gz", episodes)
                write_rows(output / "hard_water_curves.csv", curves)
                write_text(output / "hard_water.md", report(rows, episodes))
                draw_curves(curves, output / "figures" / "hard_water_curves.png")
        console.print(f"  {output}", highlight=False)


if __name__ == "__main__":
    app()
