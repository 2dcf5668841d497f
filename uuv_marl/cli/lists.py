"""``uuv-marl list``: all scenarios, vehicles and policies."""

from enum import StrEnum
from typing import Annotated

import typer
from rich.table import Table

from uuv_marl.cli.console import console, explained, say


class ListKind(StrEnum):
    """Kinds of lists."""

    SCENARIOS = "scenarios"
    VEHICLES = "vehicles"
    POLICIES = "policies"


def show_list(
    what: Annotated[ListKind | None, typer.Argument(help="What to list. Default: all three.")] = None,
    show: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Print the file of this scenario or vehicle, such as lauv, with all sources.",
        ),
    ] = None,
) -> None:
    """List scenarios, vehicles and how they move, or policies; or show one scenario or vehicle.

    Other commands take a vehicle by ``--set vehicle=NAME``.

    Example: uuv-marl list scenarios --show random_field
    """
    with explained():
        if show is not None:
            say(_file(what, show))
            return
        tables = {ListKind.SCENARIOS: _scenarios, ListKind.VEHICLES: _vehicles, ListKind.POLICIES: _policies}
        for kind, table in tables.items():
            if what in (kind, None):
                console.print(table())


def _file(what: ListKind | None, name: str) -> str:
    """The text of a scenario's or a vehicle's file."""
    from uuv_marl.scenario import show, show_vehicle, vehicle_names

    if what is ListKind.POLICIES:
        raise typer.BadParameter("a policy has no file to show; docs/policies.md describes each", param_hint="--show")
    known = name.partition("+")[0] in vehicle_names()
    return show_vehicle(name) if what is ListKind.VEHICLES or (what is None and known) else show(name)


def _scenarios() -> Table:
    from uuv_marl.scenario import load_scenario, scenario_names

    table = Table("name", "version", "what", "source")
    for name in scenario_names():
        loaded = load_scenario(name)
        table.add_row(name, str(loaded.version), loaded.title, loaded.source)
    return table


def _vehicles() -> Table:
    from uuv_marl.benchmark.handling import alone, every, turn

    table = Table("name", "length [m]", "mass [kg]", "top speed [m/s]", "turn", "source")
    for name in every():
        scenario = alone(name)
        hull = scenario.vehicle
        top, rate, radius = turn(scenario)
        how = f"{rate:.0f} deg/s" + (f", radius {radius:.1f} m" if radius > 0.01 else " on the spot")
        length = "-" if hull.length_m is None else f"{hull.length_m:g}"
        source = f"variant: --show {name.partition('+')[0]}" if "+" in name else hull.source
        table.add_row(name, length, f"{hull.m_kg:g}", f"{top:.2f}", how, source)
    return table


def _policies() -> Table:
    from uuv_marl.baselines import POLICIES
    from uuv_marl.baselines.making import policy_requirements

    table = Table("name", "extra observations", "yaw damping [N m s]", "decision period [s]", "what")
    for name, policy_type in POLICIES.items():
        required = policy_requirements(name)
        every = f"{required.decision_period_s:g}" if required.decision_period_s else "-"
        what = (policy_type.__doc__ or "").strip().partition("\n")[0]  # nothing under python -OO
        beyond = [*required.channels, *(["identity"] if required.identity else [])]
        table.add_row(name, ", ".join(beyond) or "-", f"{required.yaw_damping_nms:g}", every, what)
    return table
