"""``uuv-marl heldout``: learned policies on what they were never trained on."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, working


def heldout(
    only: Annotated[
        list[str] | None, typer.Option(help="A set, such as random_field; repeat for several. Default: all.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="At most so many of every set; 100 to 500 are usual.")
    ] = None,
    trainings: Annotated[
        Path | None, typer.Option(help="Folder of outputs of uuv-marl train, one for each algorithm and seed.")
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of results, page and pictures.")] = Path("results/heldout"),
) -> None:
    """Evaluate the shipped learned policies beside the hand-made ones, on what no training has seen.

    500 random fields, the paper's scenarios, lost vehicles, swarms of 10 to 200, echoes of the surface, other decision
    periods. Writes report.md, episodes.csv, pictures, and with --trainings the comparison over training seeds, also as
    marl_eval.json. Took 40 minutes as two processes, each with its --only. Ctrl-C keeps the finished episodes; the same
    command goes on.

    Example: uuv-marl heldout --only single_obstacle --seeds 5
    """
    with explained():
        from uuv_marl.atomic import locked
        from uuv_marl.heldout.episodes import episodes_of
        from uuv_marl.heldout.job import run
        from uuv_marl.heldout.page import write_page

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
