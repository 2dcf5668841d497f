"""``uuv-marl heldout`` evaluates learned policies on what they were never trained on."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, working


def heldout(
    only: Annotated[
        list[str] | None, typer.Option(help="Run only this set, such as random_field. Repeat it for several sets.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="Most seeds of a set. Without it a set has 20 to 500.")
    ] = None,
    trainings: Annotated[
        Path | None, typer.Option(help="Folder that holds outputs of uuv-marl train, one for each algorithm and seed.")
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder for results, page and pictures.")] = Path("results/heldout"),
) -> None:
    """Evaluate the shipped learned policies beside the hand-made ones, on what no training has seen.

    The sets are 500 random fields, the paper's scenarios, lost vehicles, swarms of 10 to 200, echoes of the surface,
    and other decision periods. It writes report.md, episodes.csv and pictures; with --trainings it also compares
    algorithms over training seeds, and writes marl_eval.json. All sets took 40 minutes in two processes, each with its
    own --only. Ctrl-C keeps the finished episodes, and the same command continues.

    Example: uuv-marl heldout --only single_obstacle --seeds 5
    """
    with explained():
        from uuv_marl.atomic import locked
        from uuv_marl.studies.heldout.episodes import episodes_of
        from uuv_marl.studies.heldout.job import run
        from uuv_marl.studies.heldout.page import write_page

        with working(f"The finished episodes are in {output}") as bar:
            task = bar.add_task("held out", total=1.0)
            results, trained = run(
                output, trainings, only or [], seeds,
                lambda what, share: bar.update(task, completed=share, description=what[-60:]),
            )  # fmt: skip
            bar.update(task, completed=1.0, description="held out")
        with locked(output, wait_s=60.0):
            for path in write_page(output, episodes_of(results, trained), trained):
                console.print(f"  {path}", highlight=False)
