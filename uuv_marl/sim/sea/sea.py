"""The sea: everything that disturbs a world, in rooms of their own, and the moments of a step at which each acts.

A world without disturbances has no sea (None), and its compiled code holds nothing of this.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.scenario.conditions import sea_disturbances
from uuv_marl.sim.arrays import Course, State, World
from uuv_marl.sim.compiled import compiled_inner
from uuv_marl.sim.model import Rules
from uuv_marl.sim.sea.actuation import PLANT, Actuation, Hull, actuation, draw_hulls, integrate_each, weaken
from uuv_marl.sim.sea.current import Flow, WaterModel, advance_gust, draw_flow, know_velocities, read_flow, water
from uuv_marl.sim.sea.modem import Mail, ModemModel, draw_mail, exchange, know_mail, modem
from uuv_marl.sim.sea.navigation import (
    NavigationModel,
    Track,
    draw_track,
    find_oneself,
    go_astray,
    navigate,
    navigation,
)
from uuv_marl.sim.sea.noise import Ears, NoiseModel, begin_ears, draw_ears, interrupt, noise, spoil, tell_ranged
from uuv_marl.sim.sea.readings import Hits, Readings, any_due, begin_line, collect, line_sizes, recall, remember, store
from uuv_marl.sim.sea.schedule import Listening, Reading, due, listening
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.views import Fields, SeaFields
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import UInt64

SEA_CHANNELS = ("current", "age", "ranged", "modem")
"""Channels that only a disturbed world's code writes."""


class Sea(NamedTuple):
    """What disturbs a batch of worlds: of each room its numbers, made once, and its arrays, that change."""

    keys: UInt64
    """Key of each world's episode, for ``uuv_marl.sim.random``, shape (world,)."""
    water: WaterModel
    flow: Flow
    actuation: Actuation
    hull: Hull
    listening: Listening
    readings: Readings
    hits: Hits
    noise: NoiseModel
    ears: Ears
    navigation: NavigationModel
    track: Track
    modem: ModemModel
    mail: Mail


def make_sea(scenario: Scenario, keys: UInt64, sizes: Mapping[str, int]) -> Sea | None:
    """What disturbs worlds of a scenario; None for nothing.

    Args:
        scenario: with its disturbances.
        keys: of the worlds' episodes, shape (world,); kept, and read as they change.
        sizes: lengths of the axes of all tables.
    """
    if not sea_disturbances(scenario) and not set(SEA_CHANNELS) & set(scenario.sonar.channels):
        return None
    own = {"eddy": scenario.max_eddies, "plant": PLANT, "fault": len(scenario.faults)}
    peers = sizes["vehicle"] if "modem" in scenario.sonar.channels else 0
    sizes = {**sizes, **own, **line_sizes(scenario), "peer": peers}
    return Sea(
        keys=keys,
        water=water(scenario),
        flow=allocate(Flow, sizes),
        actuation=actuation(scenario),
        hull=allocate(Hull, sizes),
        listening=listening(scenario),
        readings=allocate(Readings, sizes),
        hits=allocate(Hits, sizes),
        noise=noise(scenario),
        ears=allocate(Ears, sizes),
        navigation=navigation(scenario),
        track=allocate(Track, sizes),
        modem=modem(scenario),
        mail=allocate(Mail, sizes),
    )


def draw_sea(w: int, scenario: Scenario, course: Course, duration_s: float, sea: Sea) -> None:
    """The sea of world w's new episode, from its key alone."""
    key = np.uint64(sea.keys[w])
    corners = [points[: last + 1] for points, last in zip(course.waypoints[w], course.last[w], strict=True)]
    draw_flow(w, key, np.concatenate(corners), scenario, sea.water, sea.flow)
    draw_hulls(w, key, duration_s, scenario, sea.hull)
    draw_ears(w, key, sea.noise, sea.ears)
    draw_track(w, key, sea.navigation, sea.track)
    draw_mail(w, sea.mail)


def sea_tables(sea: Sea | None) -> tuple[Any, ...]:
    """All that changes, for snapshots."""
    return () if sea is None else (sea.flow, sea.hull, sea.readings, sea.ears, sea.track, sea.mail)


@compiled_inner
def integrate_at_sea(w: int, state: State, rules: Rules, now: Columns, sea: Sea) -> None:
    """One control hold of world w. Forces that reach the water are written."""
    weaken(w, state.tick[w], now, sea.actuation, sea.hull)
    integrate_each(w, state.alive, rules, now, sea.actuation, sea.hull, sea.flow.flow)


@compiled_inner
def drift(w: int, world: World, sea: Sea) -> None:
    """The sea at the end of a control hold, whose number is already counted."""
    advance_gust(w, sea.keys[w], world.state.tick[w], sea.water, sea.flow)
    read_flow(w, world.state, sea.water, sea.flow)
    go_astray(w, world.state, sea.navigation, sea.track)
    remember(w, world.state, sea.readings)
    exchange(w, sea.keys[w], world, sea.modem, sea.mail, sea.flow, sea.track)


@compiled_inner
def begin_sea(w: int, world: World, sea: Sea) -> None:
    """The sea around vehicles as they stand, after a reset or where their states were written by hand."""
    read_flow(w, world.state, sea.water, sea.flow)
    find_oneself(w, sea.track)
    begin_ears(w, sea.keys[w], sea.noise, sea.ears)
    begin_line(w, world.state, sea.readings)
    exchange(w, sea.keys[w], world, sea.modem, sea.mail, sea.flow, sea.track)


@compiled_inner
def reads(w: int, tick: int, sea: Sea) -> bool:
    """Whether an array of world w takes a reading at this control hold that a decision will see."""
    return any_due(w, tick, sea.listening, sea.readings)


@compiled_inner
def take_readings(w: int, world: World, sea: Sea, see: Fields) -> None:
    """Keep what the arrays hear now, from percepts that hold what is true."""
    tick, line = world.state.tick[w], sea.listening
    for a in range(0 if line.ideal else line.every.shape[0]):
        number = due(tick - sea.readings.began[w], line.every[a], line.delay, line.holds)
        if number >= 0:
            at = Reading(w, a, number, tick, number % sea.readings.whom.shape[1])
            num = collect(at, world, see, line, sea.track, sea.readings, sea.hits)
            spoil(at, num, sea.keys[w], line.active[a] == line.active[a + 1], sea.noise, sea.ears, sea.hits)
            store(at, num, line, sea.hits, sea.readings)
            interrupt(at, sea.keys[w], line, sea.noise, sea.ears, sea.actuation, sea.hull, sea.hits, sea.readings)


@compiled_inner
def know(w: int, world: World, sea: Sea, see: Fields, more: SeaFields) -> None:
    """Percepts that hold what is true become what vehicles know. ``heard`` is written, too."""
    if not sea.listening.ideal:
        recall(w, world, sea.listening, sea.track, sea.readings, see, more)
    tell_ranged(w, world.state.alive, sea.listening, sea.noise, more)
    know_velocities(w, world, sea.water, sea.flow, see, more)
    know_mail(w, world, sea.mail, sea.track, more)
    navigate(w, world, sea.navigation, sea.track, see)
