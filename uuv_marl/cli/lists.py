"""``uuv-marl scenarios`` and ``uuv-marl policies``: what there is."""

from typing import Annotated

import typer
from rich.syntax import Syntax
from rich.table import Table

from uuv_marl.cli.console import console, explained


def scenarios(
    show: Annotated[
        str | None, typer.Option(metavar="NAME", help="Print one, complete, with the source of every number.")
    ] = None,
) -> None:
    """List the scenarios, or show one."""
    with explained():
        from uuv_marl.scenario import load_scenario, scenario_names
        from uuv_marl.scenario import show as show_scenario

        if show is not None:
            text = show_scenario(show)
            console.print(
                Syntax(text, "toml", background_color="default") if console.is_terminal else text,
                markup=False,
                highlight=False,
                soft_wrap=True,
            )
            return
        table = Table("name", "version", "what", "source")
        for name in scenario_names():
            loaded = load_scenario(name)
            table.add_row(name, str(loaded.version), loaded.title, loaded.source)
        console.print(table)


def policies() -> None:
    """List the policies and what they need beyond the percept."""
    from uuv_marl.baselines import POLICIES

    table = Table("name", "channels", "yaw damping [N m s]", "what")
    for name, made in POLICIES.items():
        what = (made.__doc__ or "").strip().splitlines()[0]
        table.add_row(name, ", ".join(made.channels) or "–", f"{made.yaw_damping_nms:g}", what)
    console.print(table)
