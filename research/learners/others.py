"""``python -m research.learners.others``: make the rows of an external policy, or check them digit by digit."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from research import FOLDER
from research.episodes import Row, read_rows, write_rows
from research.learners.cells import MEASURES, OTHERS, episodes, every
from research.learners.protocol import TASKS, Task
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.errors import ResultsError

app = typer.Typer(add_completion=False)


@app.command()
def main(
    policy: Annotated[str, typer.Argument(help="Name, checkpoint or module:Class.")],
    rows: Annotated[Path, typer.Argument(help="File of its episodes, .csv or .csv.gz.")],
    task: Annotated[str, typer.Option(help=f"One of {', '.join(TASKS)}.")],
    sample: Annotated[int, typer.Option(min=1, help="Rows that are run again.")] = 20,
    output: Annotated[Path, path_option("Folder of the comparison.")] = Path("results/learners"),
) -> None:
    """Make the rows of a policy on a task if the file is not there; else run a sample of them again.

    If all of the sample agree, the rows go into OUTPUT/others, and python -m research.learners puts them on the
    page, marked as checked.

    Example: python -m research.learners.others runs/sb3 sb3.csv --task hard_water
    """
    with explained(FOLDER):
        if task not in TASKS:
            raise ResultsError(f"task must be one of {', '.join(TASKS)}, got {task!r}")
        with working("Nothing was kept") as bar:
            report = progress_line(bar, rows.name)
            if not rows.exists():
                write_rows(rows, every(TASKS[task], policy, report))
                console.print(f"  {rows}", highlight=False)
                return
            rows_given = read_rows(rows)
            check_complete(rows_given, TASKS[task])
            drawn = np.random.default_rng().choice(len(rows_given), min(sample, len(rows_given)), replace=False)
            for k, at in enumerate(map(int, drawn)):
                report(k / len(drawn))
                check_equal(rows_given[at], policy, TASKS[task])
            report(1.0)
        path = output / OTHERS / task / f"{rows.name.removesuffix('.gz').removesuffix('.csv')}.csv"
        write_rows(path, rows_given)
        console.print(f"  {len(drawn)} of {len(rows_given)} rows agree in every digit: {path}", highlight=False)


def check_complete(rows: list[Row], task: Task) -> None:
    """Raise ResultsError for rows that lack an episode, have one twice, or belong to something else."""
    columns = ["set", "seed", *MEASURES]
    got = list(rows[0]) if rows else []
    if got != columns:
        raise ResultsError(f"the columns must be {', '.join(columns)}, got {', '.join(got) or 'no rows'}")
    for name in {row["set"] for row in rows} - {each.name for each in task.sets}:
        raise ResultsError(f"set must be one of {', '.join(each.name for each in task.sets)}, got {name!r}")
    for each in task.sets:
        seeds = [row["seed"] for row in rows if row["set"] == each.name]
        if sorted(seeds) != sorted(map(str, each.episodes)):
            raise ResultsError(
                f"set {each.name} must have the seeds {each.episodes[0]} to {each.episodes[-1]} once each, "
                f"got {len(seeds)} rows"
            )


def check_equal(row: Row, policy: str, task: Task) -> None:
    """Run the episode of a row again. Raises ResultsError if it differs."""
    seed, each = int(row["seed"]), next(each for each in task.sets if each.name == row["set"])
    (again,) = episodes(policy, each, range(seed, seed + 1))
    if other := [f"{key} {row.get(key)}, now {value}" for key, value in again.items() if row.get(key) != value]:
        raise ResultsError(f"set {each.name}, seed {seed} differs: {'; '.join(other)}")


if __name__ == "__main__":
    app()
