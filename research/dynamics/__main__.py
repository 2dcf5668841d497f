"""``python -m research.dynamics``: the search of the parameters that the paper leaves open."""

from pathlib import Path
from typing import Annotated

import typer

from research import FOLDER
from research.dynamics.identify import identify
from uuv_marl.cli.console import console, explained, extra, path_option, progress_line, working

app = typer.Typer(add_completion=False)


@app.command()
def main(
    trials: Annotated[int, typer.Option(min=1, help="Evaluations; each runs four seeds on two scenarios.")] = 400,
    output: Annotated[Path, path_option("Folder for the trials.")] = Path("results/identify"),
) -> None:
    """Search the parameters that the paper leaves open, so that sections 5.1 and 5.2.1 are met.

    Section 5.2.2 is not looked at and stays a prediction. This needs the extra "tune" and takes about an hour. Ctrl-C
    keeps the finished trials, and the same command continues. The shipped result is in research/dynamics/identified.
    The trials' journal may hold pickled data, so continue none that you do not trust.
    """
    with explained(FOLDER):
        with extra("tune", "identification"), working(f"The finished trials are in {output}", alone=output) as bar:
            report = progress_line(bar, "identify", trials)
            path = identify(output, trials, lambda done, best: report(done, f"largest error {best:.1%}"))
        console.print(f"{path}", highlight=False)


if __name__ == "__main__":
    app()
