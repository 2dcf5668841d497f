"""The sea: everything that disturbs a world, in rooms of their own, and the moments of a step at which each acts.

A world without disturbances has no sea (None), and its compiled code holds nothing of this. Both engines call the
functions here: the compiled one compiled, the plain one as the Python that they are.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.scenario import Scenario, disturbances
from uuv_marl.sim.arrays import Course, State, World
from uuv_marl.sim.compiled import compiled_inner
from uuv_marl.sim.model import Rules
from uuv_marl.sim.sea.actuation import PLANT, Actuation, Hull, actuation, draw_hulls, integrate_each, weaken
from uuv_marl.sim.sea.current import (
    Flow,
    Water,
    advance_gust,
    draw_flow,
    know_velocities,
    read_flow,
    water,
)
from uuv_marl.sim.sea.modem import Mail, Modem, draw_mail, exchange, know_mail, modem
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.views import Fields, SeaFields
from uuv_marl.sim.workspace import Columns

UInt64 = NDArray[np.uint64]
SEA_CHANNELS = ("current", "age", "ranged", "modem")
"""Channels that only a disturbed world's code writes."""


class Sea(NamedTuple):
    """What disturbs a batch of worlds: of each room its numbers, made once, and its arrays, that change."""

    keys: UInt64
    """Of each world's episode, for ``uuv_marl.sim.random``, shape (world,)."""
    water: Water
    flow: Flow
    actuation: Actuation
    hull: Hull
    modem: Modem
    mail: Mail


def make_sea(scenario: Scenario, keys: UInt64, sizes: Mapping[str, int]) -> Sea | None:
    """What disturbs worlds of a scenario; None for nothing.

    Args:
        scenario: with its disturbances.
        keys: of the worlds' episodes, shape (world,); kept, and read as they change.
        sizes: lengths of the axes of all tables.
    """
    if not disturbances(scenario) and not set(SEA_CHANNELS) & set(scenario.sonar.channels):
        return None
    peers = sizes["vehicle"] if "modem" in scenario.sonar.channels else 0
    sizes = {**sizes, "eddy": scenario.max_eddies, "plant": PLANT, "fault": len(scenario.faults), "peer": peers}
    return Sea(
        keys=keys,
        water=water(scenario),
        flow=allocate(Flow, sizes),
        actuation=actuation(scenario),
        hull=allocate(Hull, sizes),
        modem=modem(scenario),
        mail=allocate(Mail, sizes),
    )


def draw_sea(w: int, scenario: Scenario, course: Course, duration_s: float, sea: Sea) -> None:
    """The sea of world w's new episode, from its key alone.

    Args:
        w: the world.
        scenario: what to draw from.
        course: as drawn for the episode.
        duration_s: time that l(t) takes to its end [s].
        sea: is written.
    """
    key = np.uint64(sea.keys[w])
    draw_flow(w, key, course.waypoints[w, : course.last[w] + 1], scenario, sea.water, sea.flow)
    draw_hulls(w, key, duration_s, scenario, sea.hull)
    draw_mail(w, sea.mail)


def sea_arrays(sea: Sea | None) -> dict[str, NDArray[Any]]:
    """All that changes, by name, for snapshots."""
    if sea is None:
        return {}
    return {**sea.flow._asdict(), **sea.hull._asdict(), **sea.mail._asdict()}


@compiled_inner
def integrate_at_sea(w: int, state: State, rules: Rules, now: Columns, sea: Sea) -> None:
    """One control hold of world w.

    Args:
        w: the world.
        state: of the vehicles, at the start.
        rules: the scenario's clocks.
        now: columns of the vehicles; thrust and torque as asked of them.
        sea: forces that reach the water are written.
    """
    weaken(w, state.tick[w], now, sea.actuation, sea.hull)
    integrate_each(w, state.alive, rules, now, sea.actuation, sea.hull, sea.flow.flow)


@compiled_inner
def drift(w: int, world: World, sea: Sea) -> None:
    """The sea at the end of a control hold, whose number is already counted."""
    advance_gust(w, sea.keys[w], world.state.tick[w], sea.water, sea.flow)
    read_flow(w, world.state, sea.water, sea.flow)
    exchange(w, sea.keys[w], world, sea.modem, sea.mail, sea.flow)


@compiled_inner
def begin(w: int, world: World, sea: Sea) -> None:
    """The sea around vehicles as they stand, after a reset or where their states were written by hand."""
    read_flow(w, world.state, sea.water, sea.flow)


@compiled_inner
def reads(tick: int, sea: Sea) -> bool:
    """Whether an array reads at this control hold."""
    return tick < 0 and sea.keys.shape[0] < 0


@compiled_inner
def take_readings(w: int, world: World, sea: Sea, see: Fields) -> None:
    """Keep what the arrays hear now, from percepts that hold what is true."""


@compiled_inner
def know(w: int, world: World, sea: Sea, see: Fields, more: SeaFields) -> None:
    """Percepts that hold what is true become what vehicles know."""
    know_velocities(w, world, sea.water, sea.flow, see, more)
    know_mail(w, world, sea.mail, more)
