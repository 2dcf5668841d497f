"""The command line: ``uuv-marl --help``."""

from typing import Annotated

import typer

from uuv_marl import __version__
from uuv_marl.cli import benchmark, demo, export, lists, replay, robustness, train
from uuv_marl.cli.console import console, print_everywhere

app = typer.Typer(
    help="""Swarms of unmanned underwater vehicles: scenarios, controllers and their benchmark.

    Try first:

    - `uuv-marl demo`: three policies on a hard map, at once;
    - `uuv-marl list`: what there is;
    - `uuv-marl replay --scenario hard_water --policy tangent_bug`: an episode to watch;
    - `uuv-marl benchmark --scenario starter`: policies on the same seeds, in a table;
    - `uuv-marl train starter --minutes 1`: a policy of your own.
    """,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(demo.demo)
app.command()(benchmark.benchmark)
app.command()(robustness.robustness)
app.command("tune")(benchmark.tune_command)
app.command("train")(train.train_command)
app.command()(replay.replay)
app.command()(export.export)
app.command("list")(lists.show_list)


def _show_version(value: bool) -> None:
    if value:
        console.print(f"uuv_marl {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point of ``uuv-marl``."""
    print_everywhere()
    app()
