"""``uuv-marl list``: all scenarios, vehicles and policies."""

import inspect
from enum import StrEnum
from typing import Annotated, Any, get_args

import typer
from rich.table import Table

from uuv_marl.cli.console import console, explained, find_modules, say


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
            help="Print the file of this scenario or vehicle, such as lauv, with all sources; after policies, what "
            "this policy does and its parameters.",
        ),
    ] = None,
) -> None:
    """List scenarios, vehicles and how they move, or policies; or show one of them.

    Other commands take a vehicle by ``--set vehicle=NAME``.

    Example: uuv-marl list scenarios --show random_field
    """
    with explained():
        if show is not None:
            say(_policy(show) if what is ListKind.POLICIES else _file(what, show))
            return
        tables = {ListKind.SCENARIOS: _scenarios, ListKind.VEHICLES: _vehicles, ListKind.POLICIES: _policies}
        for kind, table in tables.items():
            if what in (kind, None):
                console.print(table())


def _file(what: ListKind | None, name: str) -> str:
    """The text of a scenario's or a vehicle's file."""
    from uuv_marl.scenario import show, show_vehicle, vehicle_names

    known = name.partition("+")[0] in vehicle_names()
    return show_vehicle(name) if what is ListKind.VEHICLES or (what is None and known) else show(name)


def _policy(name: str) -> str:
    """A policy's docstring, and the parameters and gains that can follow its name."""
    from uuv_marl.baselines.names import OWN_CLOCK, SAFETY_FILTER
    from uuv_marl.baselines.registry import policy_class

    find_modules([name])
    policy_type: Any = policy_class(name)
    names: list[str] = []
    for key, parameter in inspect.signature(policy_type).parameters.items():
        if key == "gains":
            names += [gain for one in get_args(parameter.annotation) for gain in getattr(one, "_fields", ())]
        elif key not in ("scenario", "num_worlds", "barrier"):
            names.append(key)
    return f"{inspect.getdoc(policy_type) or ''}\n\nParameters: {', '.join([*names, SAFETY_FILTER, OWN_CLOCK])}"


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
        table.add_row(name, ", ".join(required.channels) or "-", f"{required.yaw_damping_nms:g}", every, what)
    return table
