"""``uuv-marl reproduce``, ``identify`` and ``heldout``: the paper again, what it leaves open, and every policy anew."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import Anew, console, explained, extra, path_option, shown, working


def reproduce(
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="Make only this part, such as figure-11, table-2, sensitivity or ledger. Repeat it for several parts."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=10_000, help="Number of seeds; they count from 0.")] = 20,
    output: Annotated[Path, path_option("Folder for figures, ledger and page.")] = Path("results/reproduce"),
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
            report = shown(bar, "reproduce")
            written = run(output, seeds, only or [], lambda what, share: report(share, what[:60]))
            report(1.0)
        for path in written:
            console.print(f"  {path}", highlight=False)


def identify(
    trials: Annotated[int, typer.Option(min=1, help="Evaluations; each runs four seeds on two scenarios.")] = 400,
    output: Annotated[Path, path_option("Folder for the trials.")] = Path("results/identify"),
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

            report = shown(bar, "identify", trials)
            path = search(output, trials, lambda done, best: report(done, f"largest error {best:.1%}"))
        console.print(f"{path}", highlight=False)


def heldout(
    only: Annotated[
        list[str] | None, typer.Option(help="Run only this set, such as random_field. Repeat it for several sets.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="At most this many seeds of a policy on a set. Default: all.")
    ] = None,
    trainings: Annotated[
        Path | None, path_option("Folder that holds outputs of uuv-marl train, one for each algorithm and seed.")
    ] = None,
    anew: Anew = False,
    output: Annotated[Path, path_option("Folder for results, page and pictures.")] = Path("results/heldout"),
) -> None:
    """Evaluate every policy on seeds that no training, no tuning and no choice has used.

    The sets are 1,000 random fields, the paper's scenarios, lost vehicles, swarms of 10 to 300, echoes of the surface,
    and other decision periods. The command writes report.md, episodes.csv and pictures; with --trainings it also
    compares algorithms over training seeds, and writes marl_eval.json. All sets took about two hours in two processes,
    each with its own --only. Ctrl-C keeps the finished episodes, and the same command continues.

    Example: uuv-marl heldout --only single_obstacle --seeds 5
    """
    with explained():
        from uuv_marl.atomic import locked
        from uuv_marl.studies.heldout.job import run
        from uuv_marl.studies.heldout.page import write_page

        with working(f"The finished episodes are in {output}") as bar:
            report = shown(bar, "held out")
            episodes, trained = run(
                output, trainings, only or [], seeds, lambda what, share: report(share, what[-60:]), anew
            )
            report(1.0)
        with locked(output, wait_s=60.0):
            for path in write_page(output, episodes, trained):
                console.print(f"  {path}", highlight=False)
