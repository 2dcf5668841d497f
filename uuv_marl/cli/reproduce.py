"""``uuv-marl reproduce`` and ``identify``: the paper again, and what it leaves open."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, extra, working


def reproduce(
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="A part, such as figure-11, table-2, sensitivity or ledger; repeat for several. Default: all."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=10_000, help="Seeds 0 to SEEDS - 1.")] = 20,
    output: Annotated[Path, typer.Option(help="Folder of figures, data, ledger and page.")] = Path("results/reproduce"),
) -> None:
    """The paper's figures 7 to 15 and Table 2 again, and a ledger of what matches.

    Writes `figures/*.png`, the data behind each (`data/*.csv`), ledger.json, ledger.md and report.md, which tells the
    story. Beyond the paper: readings that fail, sensitivities, stability, time steps, swarm sizes, lost vehicles.
    Takes about ten minutes on two cores. Ctrl-C keeps the finished runs; the same command goes on.

    Example: uuv-marl reproduce --only figure-11 --only table-2 --seeds 5
    """
    with explained():
        from uuv_marl.atomic import locked
        from uuv_marl.reproduce.job import reproduce as run

        with locked(output), working(f"The finished runs are in {output}") as bar:
            task = bar.add_task("reproduce", total=1.0)
            written = run(
                output, seeds, only or [],
                lambda what, share: bar.update(task, completed=share, description=what[:60]),
            )  # fmt: skip
            bar.update(task, completed=1.0, description="reproduce")
        for path in written:
            console.print(f"  {path}", highlight=False)


def identify(
    trials: Annotated[int, typer.Option(min=1, help="Evaluations, of four seeds on two scenarios each.")] = 400,
    output: Annotated[Path, typer.Option(help="Folder of the trials.")] = Path("results/identify"),
) -> None:
    """Search what the paper leaves open against sections 5.1 and 5.2.1; 5.2.2 stays a prediction.

    Needs the extra "tune". Takes about an hour. Ctrl-C keeps the finished trials; the same command goes on. The
    shipped result is in uuv_marl/reproduce/identified. The trials' journal may hold pickled data: go on with none that
    you do not trust.
    """
    with explained():
        from uuv_marl.atomic import locked

        with extra("tune", "identification"), locked(output), working(f"The finished trials are in {output}") as bar:
            from uuv_marl.reproduce.identify import identify as search

            task = bar.add_task("identify", total=trials)
            path = search(
                output, trials,
                lambda done, best: bar.update(task, completed=done, description=f"largest error {best:.1%}"),
            )  # fmt: skip
        console.print(f"{path}", highlight=False)
