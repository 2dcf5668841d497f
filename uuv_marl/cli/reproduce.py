"""``uuv-marl reproduce`` makes the paper's figures again; ``identify`` searches the parameters that it leaves open."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, extra, working


def reproduce(
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="Make only this part, such as figure-11, table-2, sensitivity or ledger. Repeat it for several parts."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=10_000, help="Number of seeds; they count from 0.")] = 20,
    output: Annotated[Path, typer.Option(help="Folder for figures, ledger and page.")] = Path("results/reproduce"),
) -> None:
    """Make the paper's figures 7 to 15 and Table 2 again, and a ledger of what matches.

    It writes pictures (folder figures), the data behind each (folder data), the ledger (ledger.json, ledger.md) and a
    page that tells the story (report.md). It also studies what the paper does not: readings that fail, sensitivities,
    stability, time steps, swarm sizes and lost vehicles. It takes about ten minutes on two cores. Ctrl-C keeps the
    finished runs, and the same command continues.

    Example: uuv-marl reproduce --only figure-11 --only table-2 --seeds 5
    """
    with explained():
        from uuv_marl.studies.reproduce import reproduce as run

        with working(f"The finished runs are in {output}", alone=output) as bar:
            task = bar.add_task("reproduce", total=1.0)
            written = run(
                output, seeds, only or [],
                lambda what, share: bar.update(task, completed=share, description=what[:60]),
            )  # fmt: skip
            bar.update(task, completed=1.0, description="reproduce")
        for path in written:
            console.print(f"  {path}", highlight=False)


def identify(
    trials: Annotated[int, typer.Option(min=1, help="Evaluations; each runs four seeds on two scenarios.")] = 400,
    output: Annotated[Path, typer.Option(help="Folder for the trials.")] = Path("results/identify"),
) -> None:
    """Search the parameters that the paper leaves open, so that sections 5.1 and 5.2.1 are met.

    Section 5.2.2 is not looked at and stays a prediction. This needs the extra "tune" and takes about an hour. Ctrl-C
    keeps the finished trials, and the same command continues. The shipped result is in
    uuv_marl/studies/dynamics/identified. The trials' journal may hold pickled data, so continue none that you do not
    trust.
    """
    with explained():
        with extra("tune", "identification"), working(f"The finished trials are in {output}", alone=output) as bar:
            from uuv_marl.studies.dynamics.identify import identify as search

            task = bar.add_task("identify", total=trials)
            path = search(
                output, trials,
                lambda done, best: bar.update(task, completed=done, description=f"largest error {best:.1%}"),
            )  # fmt: skip
        console.print(f"{path}", highlight=False)
