"""Everything that disturbs a world, and the moments of a step at which each disturbance acts.

A world without disturbances has None instead, and its compiled code contains none of this.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.percept import FIELDS, DisturbanceFields, Fields
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
)  # fmt: skip
from uuv_marl.sim.disturbances.modem import Messages, ModemModel, clear_messages, exchange, modem, write_messages
from uuv_marl.sim.disturbances.navigation import (
    NavigationErrors,
    NavigationModel,
    drift_position,
    navigate,
    navigation,
    sample_navigation_errors,
)  # fmt: skip
from uuv_marl.sim.disturbances.noise import (
    NoiseModel,
    SensorErrors,
    add_errors,
    apply_outages,
    noise,
    sample_sensor_errors,
    schedule_outages,
    write_ranged,
)  # fmt: skip
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
)  # fmt: skip
from uuv_marl.sim.disturbances.schedule import Reading, SonarTiming, due, sonar_timing
from uuv_marl.sim.model import Rules
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import UInt64

DISTURBANCE_CHANNELS = tuple(dict.fromkeys(FIELDS[name].channel for name in DisturbanceFields._fields))
"""Channels that only a disturbed world's code writes."""


class Disturbances(NamedTuple):
    """Disturbances of a batch of worlds: for each module its constant numbers and its arrays."""

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
    """Disturbances of a scenario's worlds; None without any.

    Args:
        scenario: the scenario with its disturbances.
        keys: keys of the worlds' episodes, shape (world,); kept, and read as they change.
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
    """Sample the disturbances of world w's new episode from its key."""
    key = np.uint64(disturbances.keys[w])
    corners = [points[: last + 1] for points, last in zip(world_map.waypoints[w], world_map.last[w], strict=True)]
    sample_flow(w, key, np.concatenate(corners), scenario, disturbances.water, disturbances.flow)
    sample_hulls(w, key, duration_s, scenario, disturbances.hull)
    sample_sensor_errors(w, key, disturbances.noise, disturbances.sensor_errors)
    sample_navigation_errors(w, key, disturbances.navigation, disturbances.navigation_errors)
    clear_messages(w, disturbances.messages)


def disturbance_tables(disturbances: Disturbances | None) -> tuple[Any, ...]:
    """All arrays that change, for snapshots."""
    d = disturbances
    return () if d is None else (d.flow, d.hull, d.readings, d.sensor_errors, d.navigation_errors, d.messages)


@compiled_inner
def integrate_disturbed(w: int, state: State, rules: Rules, now: Columns, d: Disturbances) -> None:
    """Move world w by one control step. The forces in the water, ``hull.tau``, are written."""
    weaken(w, state.tick[w], now, d.actuation, d.hull)
    integrate_each(w, state.alive, rules, now, d.actuation, d.hull, d.flow.flow)


@compiled_inner
def advance_disturbances(w: int, world: World, d: Disturbances) -> None:
    """Update the disturbances at the end of a control step, which ``state.tick`` already counts."""
    advance_gust(w, d.keys[w], world.state.tick[w], d.water, d.flow)
    read_flow(w, world.state, d.water, d.flow)
    drift_position(w, world.state, d.navigation, d.navigation_errors)
    remember(w, world.state, d.readings)
    exchange(w, d.keys[w], world, d.modem, d.messages, d.flow, d.navigation_errors)


@compiled_inner
def begin_disturbances(w: int, world: World, d: Disturbances) -> None:
    """Start the disturbances from the present states, after a reset or once states were written by hand."""
    read_flow(w, world.state, d.water, d.flow)
    d.navigation_errors.position_error[w] = 0.0
    schedule_outages(w, d.keys[w], d.noise, d.sensor_errors)
    begin_line(w, world.state, d.readings)
    exchange(w, d.keys[w], world, d.modem, d.messages, d.flow, d.navigation_errors)


@compiled_inner
def reads(w: int, tick: int, d: Disturbances) -> bool:
    """Whether an array of world w takes a reading at this control step that a decision will use."""
    return any_due(w, tick, d.sonar_timing, d.readings)


@compiled_inner
def take_readings(w: int, world: World, d: Disturbances, see: Fields) -> None:
    """Store the arrays' readings of this control step, from percepts that hold true values."""
    tick, timing = world.state.tick[w], d.sonar_timing
    for a in range(0 if timing.ideal else timing.every.shape[0]):
        number = due(tick - d.readings.began[w], timing.every[a], timing.delay, timing.control_steps)
        if number >= 0:
            at = Reading(w, a, number, tick, number % d.readings.target_index.shape[1])
            num = collect(at, world, see, timing, d.navigation_errors, d.readings, d.detections)
            passive = timing.active[a] == timing.active[a + 1]
            add_errors(at, num, d.keys[w], passive, d.noise, d.sensor_errors, d.detections)
            store(at, num, timing, d.detections, d.readings)
            apply_outages(
                at, d.keys[w], timing, d.noise, d.sensor_errors, d.actuation, d.hull, d.detections, d.readings
            )


@compiled_inner
def apply_disturbances(w: int, world: World, d: Disturbances, see: Fields, more: DisturbanceFields) -> None:
    """Turn percepts that hold true values into what vehicles observe; ``detected_index`` is written, too."""
    if not d.sonar_timing.ideal:
        write_readings(w, world, d.sonar_timing, d.navigation_errors, d.readings, see, more)
    write_ranged(w, world.state.alive, d.sonar_timing, d.noise, more)
    write_velocities(w, world, d.water, d.flow, see, more)
    write_messages(w, world, d.messages, d.navigation_errors, more)
    navigate(w, world, d.navigation, d.navigation_errors, see)
