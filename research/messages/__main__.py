"""``python -m research.messages``: policies that send messages, with fewer bits, longer rounds and losses."""

from pathlib import Path
from typing import Annotated

import typer

from research.messages.page import write_page
from research.messages.sets import METRIC, SETS
from research.sets import make_page
from uuv_marl.cli.console import path_option

app = typer.Typer(add_completion=False)


@app.command()
def main(
    only: Annotated[list[str] | None, typer.Option(help="Run only this set. Repeat it for several.")] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="At most this many seeds of a policy on a set. Default: all.")
    ] = None,
    output: Annotated[Path, path_option("Folder for results, page and pictures.")] = Path("results/messages"),
) -> None:
    """Run policies that send messages with modems of few bits, long rounds and losses, and write messages.md.

    Ctrl-C keeps the finished episodes; the same command continues. All sets take 15 minutes of one core.

    Example: python -m research.messages --only few_informed-8-12-0 --seeds 5
    """
    make_page(output, SETS, only, seeds, [METRIC], write_page)


if __name__ == "__main__":
    app()
