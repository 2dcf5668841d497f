"""``uuv-marl scenarios``, ``uuv-marl vehicles`` and ``uuv-marl policies``: what there is."""

from typing import Annotated

import typer
from rich.syntax import Syntax
from rich.table import Table

from uuv_marl.cli.console import console, explained


def scenarios(
    show: Annotated[
        str | None, typer.Option(metavar="NAME", help="Print this scenario with the source of every number.")
    ] = None,
) -> None:
    """List the scenarios, or show one."""
    with explained():
        from uuv_marl.scenario import load_scenario, scenario_names
        from uuv_marl.scenario import show as show_scenario

        if show is not None:
            _print_toml(show_scenario(show))
            return
        table = Table("name", "version", "what", "source")
        for name in scenario_names():
            loaded = load_scenario(name)
            table.add_row(name, str(loaded.version), loaded.title, loaded.source)
        console.print(table)


def vehicles(
    show: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Print this vehicle's file with the source of every number: lauv, remus100+munk_on."
        ),
    ] = None,
) -> None:
    """List the vehicles and how they move, or show one. Other commands take a vehicle by ``--set vehicle=NAME``."""
    with explained():
        from uuv_marl.scenario import show_vehicle

        if show is not None:
            _print_toml(show_vehicle(show))
            return
        from uuv_marl.studies.dynamics.acceptance import alone, changes, every, turn

        table = Table("name", "length [m]", "mass [kg]", "top speed [m/s]", "turn", "source")
        for name in every():
            scenario = alone(name)
            hull = scenario.vehicle
            top, rate, radius = turn(scenario)
            how = f"{rate:.0f} deg/s" + (f", radius {radius:.1f} m" if radius > 0.01 else " on the spot")
            length = "-" if hull.length_m is None else f"{hull.length_m:g}"
            source = f"variant: {', '.join(changes(name))}" if "+" in name else hull.source
            table.add_row(name, length, f"{hull.m_kg:g}", f"{top:.2f}", how, source)
        console.print(table)


def policies() -> None:
    """List the policies and what they need beyond the percept."""
    from uuv_marl.baselines import POLICIES

    table = Table("name", "channels", "yaw damping [N m s]", "what")
    for name, made in POLICIES.items():
        what = (made.__doc__ or "").strip().partition("\n")[0]  # nothing under python -OO
        table.add_row(name, ", ".join(made.channels) or "-", f"{made.yaw_damping_nms:g}", what)
    console.print(table)


def _print_toml(text: str) -> None:
    console.print(
        Syntax(text, "toml", background_color="default") if console.is_terminal else text,
        markup=False,
        highlight=False,
        soft_wrap=True,
    )
