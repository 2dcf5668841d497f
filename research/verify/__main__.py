"""``python -m research.verify``: shipped episodes run again, and compared digit by digit."""

from collections.abc import Callable, Sequence
from functools import partial
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
    sample: Annotated[int, typer.Option(min=1, help="How many rows; all, where there are not more.")] = 24,
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

    The rows are drawn at random. The simulation gives the same bits on any x86-64 processor, so every digit of the file
    must come out again. A row agrees, differs (the field, its value in the file, its value now), or is not
    reproducible here, with the reason: such a row never counts as agreeing. 24 rows take a few minutes. Ctrl-C shows
    what was compared until then. The exit status is 0 where all rows that could be run agree, and 1 where one differs
    or none could be run.

    Example: python -m research.verify --sample 100 --only random_field_n10
    """
    with explained(FOLDER):
        rows, others = check.find(files or [])
        if others:
            names = ", ".join(sorted({path.name for path in others}))
            console.print(f"Left out, because they hold no episodes: {names}.", highlight=False)
        selected = check.only(rows, only or [], policy or [])
        find_modules(policy or [])
        seed = check.fresh_seed() if seed is None else seed
        drawn = check.draw(selected, sample, seed)
        console.print(
            f"{len(drawn):,} of {len(selected):,} rows, drawn with --seed {seed}; another seed draws others.",
            highlight=False,
        )
        verdicts: list[Verdict] = []
        stopped = False
        try:
            with progress_bar() as bar:
                report = progress_line(bar, "verify", len(drawn))
                for k, row in enumerate(drawn):
                    note = partial(_note, report, k, row)
                    note(0.0)
                    verdicts.append(check.check(row, policy or [], note))
                report(len(drawn), "verify")
        except KeyboardInterrupt:
            stopped = True
        _show(verdicts)
        console.print(check.summary(verdicts, len(selected)), highlight=False)
        if stopped:
            console.print(f"Stopped after {len(verdicts)} of {len(drawn)} rows.")
            raise typer.Exit(130)
        raise typer.Exit(int(check.failed(verdicts)))


def _note(report: Callable[..., None], done: int, row: Row, share: float) -> None:
    report(done + share, row.name[-60:])


def _show(verdicts: Sequence[Verdict]) -> None:
    table = Table("row", "episode", "result", show_lines=True)
    for verdict in verdicts:
        row = verdict.row
        if verdict.reason:
            result = f"[yellow]not reproducible here:[/] {escape(verdict.reason)}"
        elif verdict.differences:
            lines = (f"{d.field}: {d.shipped or 'nothing'} in the file, now {d.now or 'nothing'}"
                     for d in verdict.differences)  # fmt: skip
            result = "[red]differs[/]\n" + escape("\n".join(lines))
        else:
            result = f"[green]agrees[/] ({len(row.kind.measured)} numbers)"
        table.add_row(escape(row.where), escape(row.name), result)
    if verdicts:
        console.print(table, highlight=False)


if __name__ == "__main__":
    app()
