"""``python -m research.paper``: reproduce the paper's figures 7 to 15 and Table 2, with a ledger."""

from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.paper.reproduce import reproduce
from uuv_marl.cli.console import console, explained, path_option, progress_line, working

app = typer.Typer(add_completion=False)


@app.command()
def main(
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="Make only this part, such as figure-11, table-2, sensitivity or ledger. Repeat it for several parts."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=10_000, help="Number of seeds; they count from 0.")] = 20,
    output: Annotated[Path, path_option("Folder for figures, ledger and page.")] = Path("results/reproduce"),
) -> None:
    """Reproduce the paper's figures 7 to 15 and Table 2, with a ledger of what is reproduced.

    It writes pictures (folder figures), the data behind each (folder data), the ledger (ledger.json, ledger.md) and a
    summary (paper.md). It also studies what the paper does not: readings that fail, sensitivities,
    stability, time steps, swarm sizes and lost vehicles. It takes about ten minutes on two cores. Ctrl-C keeps the
    finished runs, and the same command continues.

    Example: python -m research.paper --only figure-11 --only table-2 --seeds 5
    """
    with explained(FOLDER):
        with working(f"The finished runs are in {output}", alone=output) as bar:
            report = progress_line(bar, "reproduce")
            written = reproduce(output, seeds, only or [], lambda what, share: report(share, what[:60]))
            report(1.0)
        for path in written:
            console.print(f"  {path}", highlight=False)


if __name__ == "__main__":
    app()
