"""The sea: everything that disturbs a world, in rooms of their own, and the moments of a step at which each acts.

A world without disturbances has no sea (None), and its compiled code holds nothing of this.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields, Fields
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.conditions import vehicle_disturbances
from uuv_marl.sim.arrays import State, World, WorldMap
from uuv_marl.sim.compiled import compiled_inner
from uuv_marl.sim.disturbances.actuation import PLANT, Actuation, Hull, actuation, integrate_each, sample_hulls, weaken
from uuv_marl.sim.disturbances.current import (
    Flow,
    WaterModel,
    advance_gust,
    read_flow,
    sample_flow,
    water,
    write_velocities,
)
from uuv_marl.sim.disturbances.modem import Messages, ModemModel, clear_messages, exchange, modem, write_messages
from uuv_marl.sim.disturbances.navigation import (
    NavigationErrors,
    NavigationModel,
    drift_position,
    navigate,
    navigation,
    reset_position_error,
    sample_navigation_errors,
)
from uuv_marl.sim.disturbances.noise import (
    NoiseModel,
    SensorErrors,
    add_errors,
    apply_outages,
    noise,
    sample_sensor_errors,
    schedule_outages,
    write_ranged,
)
from uuv_marl.sim.disturbances.readings import (
    Detections,
    Readings,
    any_due,
    begin_line,
    collect,
    line_sizes,
    remember,
    store,
    write_readings,
)
from uuv_marl.sim.disturbances.schedule import Reading, SonarTiming, due, sonar_timing
from uuv_marl.sim.model import Rules
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import UInt64

DISTURBANCE_CHANNELS = ("current", "age", "ranged", "modem")
"""Channels that only a disturbed world's code writes."""


class Disturbances(NamedTuple):
    """What disturbs a batch of worlds: of each room its numbers, made once, and its arrays, that change."""

    keys: UInt64
    """Key of each world's episode, for ``uuv_marl.sim.random``, shape (world,)."""
    water: WaterModel
    flow: Flow
    actuation: Actuation
    hull: Hull
    sonar_timing: SonarTiming
    readings: Readings
    detections: Detections
    noise: NoiseModel
    sensor_errors: SensorErrors
    navigation: NavigationModel
    navigation_errors: NavigationErrors
    modem: ModemModel
    messages: Messages


def make_disturbances(scenario: Scenario, keys: UInt64, sizes: Mapping[str, int]) -> Disturbances | None:
    """What disturbs worlds of a scenario; None for nothing.

    Args:
        scenario: with its disturbances.
        keys: of the worlds' episodes, shape (world,); kept, and read as they change.
        sizes: lengths of the axes of all tables.
    """
    if not vehicle_disturbances(scenario) and not set(DISTURBANCE_CHANNELS) & set(scenario.sonar.channels):
        return None
    own = {"eddy": scenario.max_eddies, "plant": PLANT, "fault": len(scenario.faults)}
    peers = sizes["vehicle"] if "modem" in scenario.sonar.channels else 0
    sizes = {**sizes, **own, **line_sizes(scenario), "peer": peers}
    return Disturbances(
        keys=keys,
        water=water(scenario),
        flow=allocate(Flow, sizes),
        actuation=actuation(scenario),
        hull=allocate(Hull, sizes),
        sonar_timing=sonar_timing(scenario),
        readings=allocate(Readings, sizes),
        detections=allocate(Detections, sizes),
        noise=noise(scenario),
        sensor_errors=allocate(SensorErrors, sizes),
        navigation=navigation(scenario),
        navigation_errors=allocate(NavigationErrors, sizes),
        modem=modem(scenario),
        messages=allocate(Messages, sizes),
    )


def sample_disturbances(
    w: int, scenario: Scenario, world_map: WorldMap, duration_s: float, disturbances: Disturbances
) -> None:
    """The sea of world w's new episode, from its key alone."""
    key = np.uint64(disturbances.keys[w])
    corners = [points[: last + 1] for points, last in zip(world_map.waypoints[w], world_map.last[w], strict=True)]
    sample_flow(w, key, np.concatenate(corners), scenario, disturbances.water, disturbances.flow)
    sample_hulls(w, key, duration_s, scenario, disturbances.hull)
    sample_sensor_errors(w, key, disturbances.noise, disturbances.sensor_errors)
    sample_navigation_errors(w, key, disturbances.navigation, disturbances.navigation_errors)
    clear_messages(w, disturbances.messages)


def disturbance_tables(disturbances: Disturbances | None) -> tuple[Any, ...]:
    """All that changes, for snapshots."""
    return (
        ()
        if disturbances is None
        else (
            disturbances.flow,
            disturbances.hull,
            disturbances.readings,
            disturbances.sensor_errors,
            disturbances.navigation_errors,
            disturbances.messages,
        )
    )


@compiled_inner
def integrate_disturbed(w: int, state: State, rules: Rules, now: Columns, disturbances: Disturbances) -> None:
    """One control hold of world w. Forces that reach the water are written."""
    weaken(w, state.tick[w], now, disturbances.actuation, disturbances.hull)
    integrate_each(w, state.alive, rules, now, disturbances.actuation, disturbances.hull, disturbances.flow.flow)


@compiled_inner
def advance_disturbances(w: int, world: World, disturbances: Disturbances) -> None:
    """The sea at the end of a control hold, whose number is already counted."""
    advance_gust(w, disturbances.keys[w], world.state.tick[w], disturbances.water, disturbances.flow)
    read_flow(w, world.state, disturbances.water, disturbances.flow)
    drift_position(w, world.state, disturbances.navigation, disturbances.navigation_errors)
    remember(w, world.state, disturbances.readings)
    exchange(
        w,
        disturbances.keys[w],
        world,
        disturbances.modem,
        disturbances.messages,
        disturbances.flow,
        disturbances.navigation_errors,
    )


@compiled_inner
def begin_disturbances(w: int, world: World, disturbances: Disturbances) -> None:
    """The sea around vehicles as they stand, after a reset or where their states were written by hand."""
    read_flow(w, world.state, disturbances.water, disturbances.flow)
    reset_position_error(w, disturbances.navigation_errors)
    schedule_outages(w, disturbances.keys[w], disturbances.noise, disturbances.sensor_errors)
    begin_line(w, world.state, disturbances.readings)
    exchange(
        w,
        disturbances.keys[w],
        world,
        disturbances.modem,
        disturbances.messages,
        disturbances.flow,
        disturbances.navigation_errors,
    )


@compiled_inner
def reads(w: int, tick: int, disturbances: Disturbances) -> bool:
    """Whether an array of world w takes a reading at this control hold that a decision will see."""
    return any_due(w, tick, disturbances.sonar_timing, disturbances.readings)


@compiled_inner
def take_readings(w: int, world: World, disturbances: Disturbances, see: Fields) -> None:
    """Keep what the arrays hear now, from percepts that hold what is true."""
    tick, line = world.state.tick[w], disturbances.sonar_timing
    for a in range(0 if line.ideal else line.every.shape[0]):
        number = due(tick - disturbances.readings.began[w], line.every[a], line.delay, line.control_steps)
        if number >= 0:
            at = Reading(w, a, number, tick, number % disturbances.readings.detected_index.shape[1])
            num = collect(
                at, world, see, line, disturbances.navigation_errors, disturbances.readings, disturbances.detections
            )
            add_errors(
                at,
                num,
                disturbances.keys[w],
                line.active[a] == line.active[a + 1],
                disturbances.noise,
                disturbances.sensor_errors,
                disturbances.detections,
            )
            store(at, num, line, disturbances.detections, disturbances.readings)
            apply_outages(
                at,
                disturbances.keys[w],
                line,
                disturbances.noise,
                disturbances.sensor_errors,
                disturbances.actuation,
                disturbances.hull,
                disturbances.detections,
                disturbances.readings,
            )


@compiled_inner
def apply_disturbances(w: int, world: World, disturbances: Disturbances, see: Fields, more: DisturbanceFields) -> None:
    """Percepts that hold what is true become what vehicles know. ``heard`` is written, too."""
    if not disturbances.sonar_timing.ideal:
        write_readings(
            w, world, disturbances.sonar_timing, disturbances.navigation_errors, disturbances.readings, see, more
        )
    write_ranged(w, world.state.alive, disturbances.sonar_timing, disturbances.noise, more)
    write_velocities(w, world, disturbances.water, disturbances.flow, see, more)
    write_messages(w, world, disturbances.messages, disturbances.navigation_errors, more)
    navigate(w, world, disturbances.navigation, disturbances.navigation_errors, see)
