"""Everything that disturbs a world, and the moments of a step at which each disturbance acts.

A world without disturbances has None instead, and its compiled code contains none of this.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.percept import FIELDS, NUM_RECENT, DisturbanceFields, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.conditions import vehicle_disturbances
from uuv_marl.sim.arrays import State, World, WorldMap
from uuv_marl.sim.compiled import compiled_inner
from uuv_marl.sim.disturbances import actuation, current, modem, navigation, noise, packets, readings, schedule
from uuv_marl.sim.model import Rules
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.views import disturbance_fields, fields
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import Float32, UInt64

DISTURBANCE_CHANNELS = tuple(dict.fromkeys(FIELDS[name].channel for name in DisturbanceFields._fields))
"""Channels that only a disturbed world's code writes."""


class Disturbances(NamedTuple):
    """Disturbances of a batch of worlds: for each module its constant numbers and its arrays."""

    keys: UInt64
    """Key of each world's episode, for ``uuv_marl.sim.random``, shape (world,)."""
    water: current.WaterModel
    flow: current.Flow
    actuation_model: actuation.Actuation
    hull: actuation.Hull
    sonar_timing: schedule.SonarTiming
    delay_line: readings.Readings
    detections: readings.Detections
    noise_model: noise.NoiseModel
    sensor_errors: noise.SensorErrors
    drift_share: float
    """Error of the estimated position per distance travelled over ground."""
    compass_bias: float
    """Standard deviation of a compass's bias [rad]."""
    navigation_errors: navigation.NavigationErrors
    modem_model: modem.ModemModel
    messages: modem.Messages
    packet_model: packets.PacketModel
    packets: packets.Packets


def make_disturbances(scenario: Scenario, keys: UInt64, sizes: Mapping[str, int]) -> Disturbances | None:
    """Disturbances of a scenario's worlds; None without any.

    Args:
        scenario: the scenario with its disturbances.
        keys: keys of the worlds' episodes, shape (world,); kept, and read as they change.
        sizes: lengths of the axes of all tables.
    """
    if not vehicle_disturbances(scenario) and not set(DISTURBANCE_CHANNELS) & set(scenario.sonar.channels):
        return None
    own = {"eddy": scenario.max_eddies, "plant": actuation.PLANT, "fault": len(scenario.faults)}
    n, entries = sizes["vehicle"], scenario.modem.message_entries
    own |= {"peer": n * ("modem" in scenario.sonar.channels), "modem": n * (entries > 0)}
    sizes = {**sizes, **own, **readings.line_sizes(scenario), "message_entry": entries, "recent": NUM_RECENT}
    return Disturbances(
        keys=keys,
        water=current.water(scenario),
        flow=allocate(current.Flow, sizes),
        actuation_model=actuation.actuation(scenario),
        hull=allocate(actuation.Hull, sizes),
        sonar_timing=schedule.sonar_timing(scenario),
        delay_line=allocate(readings.Readings, sizes),
        detections=allocate(readings.Detections, sizes),
        noise_model=noise.noise_model(scenario),
        sensor_errors=allocate(noise.SensorErrors, sizes),
        drift_share=scenario.navigation.drift_share,
        compass_bias=math.radians(scenario.navigation.compass_bias_deg),
        navigation_errors=allocate(navigation.NavigationErrors, sizes),
        modem_model=modem.modem_model(scenario),
        messages=allocate(modem.Messages, sizes),
        packet_model=packets.packet_model(scenario),
        packets=allocate(packets.Packets, sizes),
    )


def sample_disturbances(w: int, scenario: Scenario, world_map: WorldMap, duration_s: float, d: Disturbances) -> None:
    """Sample the disturbances of world w's new episode from its key."""
    key = np.uint64(d.keys[w])
    corners = [points[: last + 1] for points, last in zip(world_map.waypoints[w], world_map.last[w], strict=True)]
    current.sample_flow(w, key, np.concatenate(corners), scenario, d.water, d.flow)
    actuation.sample_hulls(w, key, duration_s, scenario, d.hull)
    noise.sample_sensor_errors(w, key, d.noise_model, d.sensor_errors)
    navigation.sample_navigation_errors(w, key, d.compass_bias, d.navigation_errors)
    d.messages.sent[w], d.messages.received[w] = -1.0, -1.0
    packets.begin_packets(w, key, d.packet_model, d.packets)


def disturbance_tables(disturbances: Disturbances | None) -> tuple[Any, ...]:
    """All arrays that change, for snapshots."""
    d = disturbances
    if d is None:
        return ()
    return (d.flow, d.hull, d.delay_line, d.sensor_errors, d.navigation_errors, d.messages, d.packets)


@compiled_inner
def integrate_disturbed(w: int, state: State, rules: Rules, now: Columns, d: Disturbances) -> None:
    """Move world w by one control step. The forces in the water, ``hull.tau``, are written."""
    actuation.weaken(w, state.tick[w], now, d.actuation_model, d.hull)
    actuation.integrate_each(w, state.alive, rules, now, d.actuation_model, d.hull, d.flow.flow)


@compiled_inner
def advance_disturbances(w: int, world: World, d: Disturbances) -> None:
    """Update the disturbances at the end of a control step, which ``state.tick`` already counts."""
    current.advance_gust(w, d.keys[w], world.state.tick[w], d.water, d.flow)
    current.read_flow(w, world.state.eta, d.water.core, d.flow)
    navigation.drift_position(w, world.state, d.drift_share, d.navigation_errors)
    readings.remember(w, world.state, d.delay_line)
    modem.exchange(w, d.keys[w], world, d.modem_model, d.messages, d.flow, d.navigation_errors)
    packets.transmit(w, d.keys[w], world, d.packet_model, d.packets)


@compiled_inner
def load_messages(w: int, action: Float32, world: World, d: Disturbances) -> None:
    """Take the messages that a decision's actions hold, shape (world, vehicle, 2 + entry)."""
    packets.load_entries(w, action, world, d.packet_model, d.navigation_errors, d.packets)


@compiled_inner
def begin_disturbances(w: int, world: World, d: Disturbances) -> None:
    """Start the disturbances from the present states, after a reset or once states were written by hand."""
    current.read_flow(w, world.state.eta, d.water.core, d.flow)
    navigation.begin_navigation(w, world.state, d.navigation_errors)
    noise.schedule_outages(w, d.keys[w], d.noise_model, d.sensor_errors)
    readings.begin_line(w, world.state, d.delay_line)
    modem.exchange(w, d.keys[w], world, d.modem_model, d.messages, d.flow, d.navigation_errors)


@compiled_inner
def take_readings(w: int, world: World, at: Starts, d: Disturbances) -> None:
    """Store the arrays' readings of this control step, from percepts that hold true values."""
    tick, timing, see = world.state.tick[w], d.sonar_timing, fields(world.senses.percept, at)
    for a in range(0 if timing.ideal else timing.every.shape[0]):
        number = schedule.due(tick - d.delay_line.began[w], timing.every[a], timing.delay, timing.control_steps)
        if number >= 0:
            reading = schedule.Reading(w, a, number, tick, number % d.delay_line.target_index.shape[1])
            num = readings.collect(reading, world, see, timing, d.navigation_errors, d.delay_line, d.detections)
            passive = timing.active[a] == timing.active[a + 1]
            noise.add_errors(reading, num, d.keys[w], passive, d.noise_model, d.sensor_errors, d.detections)
            readings.store(reading, num, timing, d.detections, d.delay_line)
            noise.apply_outages(
                reading, d.keys[w], timing, d.noise_model, d.sensor_errors, d.actuation_model, d.hull, d.detections,
                d.delay_line,
            )  # fmt: skip


@compiled_inner
def apply_disturbances(w: int, world: World, at: Starts, d: Disturbances) -> None:
    """Turn percepts that hold true values into what vehicles observe; ``detected_index`` is written, too."""
    see, more = fields(world.senses.percept, at), disturbance_fields(world.senses.percept, at)
    if not d.sonar_timing.ideal:
        readings.write_readings(w, world, d.sonar_timing, d.navigation_errors, d.delay_line, see, more)
    noise.write_ranged(w, world.state.alive, d.sonar_timing, d.noise_model, more)
    current.write_velocities(w, world, d.water, d.flow, see, more)
    modem.write_messages(w, world, d.messages, d.navigation_errors, more)
    packets.write_packets(w, world, d.packet_model, d.navigation_errors, d.packets, more)
    navigation.write_odometry(w, world, d.navigation_errors, more)
    if d.drift_share != 0.0 or d.compass_bias != 0.0:
        navigation.navigate(w, world, d.navigation_errors, see)
