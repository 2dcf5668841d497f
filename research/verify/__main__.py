"""``python -m research.verify``: shipped episodes run again, and compared digit by digit."""

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from research import FOLDER
from research.verify import check
from research.verify.check import Verdict
from research.verify.rows import Row
from uuv_marl.cli.console import console, explained, find_modules, path_argument, progress_bar, progress_line

app = typer.Typer(add_completion=False)


@app.command()
def main(
    files: Annotated[
        list[Path] | None,
        path_argument(
            "Files of episodes (docs/*.csv.gz, episodes.csv, results.json), or folders of such. Default: docs.",
            metavar="[FILE|FOLDER]...",
        ),
    ] = None,
    sample: Annotated[int, typer.Option(min=1, help="How many rows of each file; all, where there are not more.")] = 24,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Draws the rows. Default: another one each time; it is printed.")
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Only rows of this set or scenario, such as random_field_n10. Repeat it for several."),
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="Only rows of this policy. Repeat it for several. It also lets a checkpoint or module:Class run."
        ),
    ] = None,
) -> None:
    """Run shipped episodes again and compare every number with its file, digit by digit.

    Rows of each file are drawn at random until ``--sample`` could be run. The simulation gives the same bits on any
    x86-64 processor, so every digit of the file must come out again. A row agrees, differs (the field, its value in the
    file, its value now), or is not reproducible here, with the reason: such a row never counts as agreeing. 24 rows of
    each file of docs take two minutes on one core. Ctrl-C shows what was compared until then. The exit status is 0
    where all rows that could be run agree, and 1 where one differs or none of a file could be run.

    Example: python -m research.verify --sample 100 --only random_field_n10
    """
    with explained(FOLDER):
        rows, others = check.find(files or [])
        if others:
            names = ", ".join(sorted({path.name for path in others}))
            console.print(f"Left out, because they hold no episodes: {names}.", highlight=False)
        selected = groupby(check.only(rows, only or [], policy or []), lambda row: row.file)
        find_modules(policy or [])
        seed = check.fresh_seed() if seed is None else seed
        console.print(f"Rows of each file, drawn with --seed {seed}; another seed draws others.", highlight=False)
        failed = [_verify(file, [*own], sample, seed, policy or []) for file, own in selected]
        raise typer.Exit(int(any(failed)))


def _verify(file: Path, rows: Sequence[Row], sample: int, seed: int, allowed: Sequence[str]) -> bool:
    """Compare a file, print its table, and return whether it failed."""
    verdicts: list[Verdict] = []
    stopped = False
    try:
        with progress_bar() as bar:
            line = progress_line(bar, "verify", min(sample, len(rows)))

            def report(done: int, row: Row, share: float) -> None:
                line(done + share, row.name[-60:])

            verdicts.extend(check.compare(rows, sample, seed, allowed, report))  # Ctrl-C leaves those before it
    except KeyboardInterrupt:
        stopped = True
    _show(verdicts)
    console.print(f"{file}: {check.summary(verdicts, len(rows))}", highlight=False)
    if stopped:
        console.print(f"Stopped after {len(verdicts)} rows of {file}.")
        raise typer.Exit(130)
    return check.failed(verdicts)


def _show(verdicts: Sequence[Verdict]) -> None:
    table = Table("row", "episode", "result", show_lines=True)
    reasons = Counter(verdict.reason for verdict in verdicts)
    for verdict in verdicts:
        row = verdict.row
        if verdict.reason:
            if not (count := reasons.pop(verdict.reason, 0)):
                continue
            others = f" ({count - 1} more likewise)" if count > 1 else ""
            result = f"[yellow]not reproducible here:[/] {escape(verdict.reason)}{others}"
        elif verdict.differences:
            lines = (f"{d.field}: {d.shipped or 'nothing'} in the file, now {d.now or 'nothing'}"
                     for d in verdict.differences)  # fmt: skip
            result = "[red]differs[/]\n" + escape("\n".join(lines))
        else:
            result = f"[green]agrees[/] ({sum(row.cells[name] != '' for name in row.kind.measured)} numbers)"
        table.add_row(escape(row.where), escape(row.name), result)
    if verdicts:
        console.print(table, highlight=False)


if __name__ == "__main__":
    app()
