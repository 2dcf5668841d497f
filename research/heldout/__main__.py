"""``python -m research.heldout``: evaluate every policy on held-out seeds."""

from pathlib import Path
from typing import Annotated

import typer

from research.heldout.page import write_page
from research.heldout.sets import METRICS, SETS
from research.sets import make_page
from uuv_marl.cli.console import path_option

app = typer.Typer(add_completion=False)


@app.command()
def main(
    only: Annotated[
        list[str] | None, typer.Option(help="Run only this set, such as random_field. Repeat it for several sets.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="At most this many seeds of a policy on a set. Default: all.")
    ] = None,
    output: Annotated[Path, path_option("Folder for results, page and pictures.")] = Path("results/heldout"),
) -> None:
    """Evaluate every policy on seeds that no training, no tuning and no choice has used.

    The sets are 1,000 random fields, the paper's scenarios, lost vehicles, swarms of 10 to 300, echoes of the surface,
    and other decision periods. The command writes heldout.md, heldout.csv.gz and a picture. All sets took about two
    hours in two processes, each with its own --only. Ctrl-C keeps the finished episodes; the same command continues.

    Example: python -m research.heldout --only single_obstacle --seeds 5
    """
    make_page(output, SETS, only, seeds, METRICS, write_page)


if __name__ == "__main__":
    app()
