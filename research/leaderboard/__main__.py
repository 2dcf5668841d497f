"""``python -m research.leaderboard``: make an entry, check one, and write the page of all."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from research import FOLDER
from research.leaderboard.entry import check, load, made, save
from research.leaderboard.page import by_set, report
from research.tasks.page import with_interval
from research.tasks.studies import STUDIES
from uuv_marl.atomic import write_text
from uuv_marl.cli.console import console, explained, path_option, working

app = typer.Typer(add_completion=False)


@app.command("make")
def make(
    policy: Annotated[str, typer.Argument(help="Checkpoint, module:Class or name.")],
    task: Annotated[str, typer.Option(help=f"One of {', '.join(STUDIES)}.")],
    output: Annotated[Path, path_option("File of the entry.")],
    name: Annotated[str, typer.Option(help="Name in the table. Default: the policy's.")] = "",
) -> None:
    """Run a policy on the medium tier of a task, seeds 0 to 99 of each kind of map, and write its entry.

    Example: python -m research.leaderboard make runs/mine/best --task hard_water --name mine --output mine.json
    """
    with explained(FOLDER), working("Nothing was kept"):
        entry = made(policy, task, name)
        save(entry, output)
    headline = STUDIES[task].headline
    mean = with_interval(by_set([dict(row) for row in entry.episodes], headline))
    console.print(f"  {headline.replace('_', ' ')} {mean}: {output}", highlight=False)


@app.command("check")
def check_entry(
    entry: Annotated[Path, typer.Argument(help="File of the entry.")],
    policy: Annotated[str, typer.Argument(help="Its policy: checkpoint, module:Class or name.")],
    sample: Annotated[int, typer.Option(min=1, help="Episodes that are run again.")] = 20,
) -> None:
    """Compare the policy's digest with that of an entry, and run a sample of its episodes again, digit by digit.

    Example: python -m research.leaderboard check mine.json runs/mine/best
    """
    with explained(FOLDER), working("Nothing was changed"):
        told = load(entry)
        number = len(told.episodes)
        check(told, policy, [*map(int, np.random.default_rng().choice(number, min(sample, number), replace=False))])
    console.print(f"  {entry}: {min(sample, number)} of {number} episodes agree in every digit", highlight=False)


@app.command("page")
def page(
    output: Annotated[Path, path_option("The page.")] = Path("docs/leaderboard.md"),
) -> None:
    """Write the page from the episodes that ship and all entries.

    Example: python -m research.leaderboard page
    """
    with explained(FOLDER):
        write_text(output, report())
        console.print(f"  {output}", highlight=False)


if __name__ == "__main__":
    app()
