"""``Scenario``: everything that defines a simulation, except the seed; frozen, validated, in SI units and degrees.

The numbers and their sources are in the TOML files of this folder; fields here have no default values that matter.
"""

import logging
import math
from functools import cache, cached_property
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from uuv_marl.scenario import disturbance_sections, fields, hardware, sections
from uuv_marl.scenario.task import TaskSettings, check_channels, check_task, named_task, task_class, task_numbers
from uuv_marl.scenario.vehicle_checks import check_vehicle, top_speed

MAX_READINGS = 64  # largest processing time of a sonar reading [control steps]
MAX_EDDIES = 4_096  # largest number of eddies of a world; every vehicle's water velocity is the sum over all of them
MAX_PAST = 1024  # largest travel time of sound across a sonar's range [control steps]
MAX_STEPS = 10_000  # largest number of integration steps in a decision; compiled code can't be interrupted


class Scenario(fields.Section):
    """A complete configuration. Make one with ``uuv_marl.load_scenario``."""

    name: fields.Name
    """The file's name, set by the loader; names results and pictures."""
    title: str
    """One line."""
    source: str
    """Origin of the scenario."""
    version: Annotated[int, fields.within(1, 1_000_000)]
    """Increased by any change of its numbers."""
    swarm: sections.SwarmSize
    start: sections.Start
    trajectory: sections.Trajectory
    obstacles: Annotated[tuple[sections.Obstacle, ...], Field(max_length=1024)] = ()
    random_field: sections.RandomField | None = None
    vehicle: hardware.Vehicle
    actuators: hardware.Actuators
    sonar: hardware.Sonar
    timing: sections.Timing
    constraints: sections.Constraints
    collision: sections.Collision
    arrival: sections.Arrival
    time_limit: sections.TimeLimit
    losses: sections.Losses
    current: disturbance_sections.Current
    traffic: disturbance_sections.Traffic
    latency: disturbance_sections.Latency
    noise: disturbance_sections.Noise
    navigation: disturbance_sections.Navigation
    modem: disturbance_sections.Modem
    mismatch: disturbance_sections.Mismatch
    faults: Annotated[tuple[disturbance_sections.Fault, ...], Field(max_length=64)]
    reward: sections.Reward
    task: Annotated[TaskSettings, BeforeValidator(named_task)]
    """The swarm's task: its name, or ``module:Class``, alone or in a table with the task's own numbers."""

    @cached_property
    def task_class(self) -> Any:
        """The class of the task, a ``uuv_marl.tasks.Task``."""
        return task_class(self.task.name)

    @cached_property
    def task_numbers(self) -> Any:
        """The task's own numbers, an instance of its class's ``Numbers``."""
        return task_numbers(self.task)

    @property
    def action_size(self) -> int:
        """Entries of a vehicle's action: two forces, and those of its next message."""
        return 2 + self.modem.message_entries

    @property
    def max_obstacles(self) -> int:
        """Largest number of obstacles in a world of this scenario."""
        drawn = self.task_class.sizes(self).get("obstacle")
        return drawn or (self.random_field.obstacles[1] if self.random_field else len(self.obstacles))

    @property
    def loses_vehicles(self) -> bool:
        """Whether a vehicle can be lost before the episode ends."""
        broken = any(fault.kind == "member" and fault.share > 0.0 for fault in self.faults)
        return bool(self.losses.times_s) or self.collision.ends_vehicle or broken

    @property
    def max_eddies(self) -> int:
        """Largest number of eddies in a world of this scenario."""
        if self.random_field is None:
            north, east = zip(*self.trajectory.waypoints_m or (), strict=True)
            return self.current.num_eddies(max(north) - min(north), max(east) - min(east))
        # The sides of a box sum to at most root 2 times the path through it.
        side = self.random_field.legs[1] * self.random_field.leg_length_m[1] / math.sqrt(2.0)
        return self.current.num_eddies(side, side)

    def _check(self) -> None:
        check_task(self.task)
        check_channels(self.task, self.sonar.channels)
        _check_start(self)
        _check_map(self)
        _check_traffic(self)
        _check_losses(self)
        _check_times(self)
        _check_sonar(self)
        _check_faults(self)
        _check_messages(self)
        if self.max_eddies > MAX_EDDIES:
            raise ValueError(
                f"current.eddies = {self.current.eddies} makes {self.max_eddies:,} eddies around this map; at most "
                f"{MAX_EDDIES:,} are possible: lower it or shorten the trajectory"
            )
        check_vehicle(self.vehicle, self.actuators, self.timing, self.start.speed_max_mps)
        _check_mismatch(self)
        _check_speed(self)


def _check_start(scenario: Scenario) -> None:
    """The vehicles fit into the start area at their spacing, which keeps their hulls apart."""
    start, n, apart = scenario.start, scenario.swarm.num_vehicles, 2 * scenario.collision.hull_radius_m
    if start.spacing_m < apart:
        raise ValueError(
            f"start.spacing_m must be at least two hull radii = {apart:g}, got {start.spacing_m:g}; "
            "raise it or lower collision.hull_radius_m"
        )
    if start.gap_m < start.spacing_m and n > 1:
        raise ValueError(
            f"start.gap_m must be at least start.spacing_m = {start.spacing_m:g}, so that the two groups keep it from "
            f"each other, got {start.gap_m:g}"
        )
    columns, rows, _ = start.lattice(n)
    needed = math.ceil(n / 2)
    if columns * rows < needed:
        raise ValueError(
            f"start.spacing_m = {start.spacing_m:g} leaves room for {columns * rows} vehicles in each start rectangle, "
            f"but {needed} are needed; lower it, or raise start.length_m or start.width_m"
        )


def _check_map(scenario: Scenario) -> None:
    """The trajectory is unique, and no obstacle is on its start or end."""
    points, clear = scenario.trajectory.waypoints_m, scenario.constraints.s_o_m
    if (points is None) == (scenario.random_field is None):
        raise ValueError(
            "trajectory.waypoints_m is needed, unless random_field draws the trajectory; "
            f"got {'neither' if points is None else 'both'}"
        )
    if points is None:
        if scenario.obstacles:
            raise ValueError("obstacles must be empty where random_field draws them")
        return
    for k, obstacle in enumerate(scenario.obstacles):
        centre, apart = obstacle.centre_m, obstacle.radius_m + clear
        where = f"obstacles.{k} at {list(centre)} m, radius {obstacle.radius_m:g} m,"
        if scenario.start.distance(scenario.swarm.num_vehicles, points[0], points[1], centre) < apart:
            raise ValueError(f"{where} lies on the start; keep {clear:g} m from the two start rectangles")
        amplitude = scenario.traffic.amplitude_m if scenario.traffic.moves else 0.0
        if math.dist(centre, points[-1]) < apart + amplitude:
            raise ValueError(f"{where} lies on the trajectory's end; keep {clear + amplitude:g} m from it")


def _check_traffic(scenario: Scenario) -> None:
    """Moving obstacles can turn, open no walls, and keep off the trajectory's end."""
    traffic = scenario.traffic
    if not traffic.moves:
        return
    if not scenario.task_class.traffic:
        raise ValueError(
            f"traffic.speed_mps must be 0 for task {scenario.task.name!r}, whose walls would open and close, got "
            f"{traffic.speed_mps:g}; leave it out"
        )
    least = traffic.speed_mps * scenario.timing.control_step_s
    if traffic.amplitude_m < least:
        raise ValueError(
            f"traffic.amplitude_m must be at least {least:g}, the distance at traffic.speed_mps = "
            f"{traffic.speed_mps:g} in a control step, got {traffic.amplitude_m:g}; raise it or lower the speed"
        )
    most = math.inf if scenario.random_field is None else scenario.random_field.end_clear_m - scenario.constraints.s_o_m
    if traffic.amplitude_m > most:
        raise ValueError(
            f"traffic.amplitude_m must be at most random_field.end_clear_m - constraints.s_o_m = {most:g}, so that no "
            f"obstacle comes to the trajectory's end, got {traffic.amplitude_m:g}; lower it"
        )


def _check_losses(scenario: Scenario) -> None:
    """At least one vehicle remains."""
    n = scenario.swarm.num_vehicles
    members = sum(math.ceil(fault.share * n - 1e-9) for fault in scenario.faults if fault.kind == "member")
    if (lost := len(scenario.losses.times_s) + members) >= n:
        raise ValueError(
            f"losses.times_s and faults of kind member may lose {min(lost, n)} of {n} vehicles; at least one must "
            "remain: shorten losses.times_s, lower a fault's share or raise swarm.num_vehicles"
        )


def _check_times(scenario: Scenario) -> None:
    """Decisions fit into an episode and can be computed quickly."""
    timing, field = scenario.timing, scenario.random_field
    duration = scenario.trajectory.duration_s
    if field is not None:
        duration = field.legs[0] * field.leg_length_m[0] / scenario.trajectory.speed_mps
    shortest = scenario.time_limit.of(duration)
    period, steps = (
        timing.decision_period_s,
        timing.control_steps_per_decision * timing.integration_steps_per_control_step,
    )
    if period > shortest:
        raise ValueError(
            f"timing.decision_period_s must be at most the shortest time limit = {shortest:g}, got {period:g}; "
            "lower it, or raise time_limit.factor or time_limit.extra_s"
        )
    if steps > MAX_STEPS:
        raise ValueError(
            f"timing.decision_period_s = {period:g} takes {steps:,} steps of timing.integration_step_s = "
            f"{timing.integration_step_s:g}; at most {MAX_STEPS:,} are possible: lower it or raise the step"
        )


def _check_sonar(scenario: Scenario) -> None:
    """Readings are no faster than sound, and no more are stored than fit."""
    latency = scenario.latency
    far = max((array.range_m for array in scenario.sonar.arrays if array.kind == "active"), default=0.0)
    least = 2.0 * far / latency.sound_speed_mps
    if 0.0 < latency.active_period_s < least:
        raise ValueError(
            f"latency.active_period_s must be at least {least:.4g}, in which sound returns from the active arrays' "
            f"range of {far:g} m, or 0 (at every control step), got {latency.active_period_s:g}"
        )
    readings = latency.processing_s / scenario.timing.control_step_s
    if readings > MAX_READINGS:
        raise ValueError(
            f"latency.processing_s = {latency.processing_s:g} is {readings:,.0f} control steps; at most {MAX_READINGS} "
            "readings are kept: lower it or raise timing.control_step_s"
        )
    longest = max(array.range_m for array in scenario.sonar.arrays)
    past = longest / latency.sound_speed_mps / scenario.timing.control_step_s
    if latency.travel_time and past > MAX_PAST:
        raise ValueError(
            f"latency.sound_speed_mps = {latency.sound_speed_mps:g} takes sound {past:,.0f} control steps across the "
            f"longest range of {longest:g} m; positions of at most {MAX_PAST:,} are kept: raise it or "
            "timing.control_step_s, or set latency.travel_time = false"
        )


def _check_faults(scenario: Scenario) -> None:
    """Faults name existing arrays."""
    names = [array.name for array in scenario.sonar.arrays]
    for k, fault in enumerate(scenario.faults):
        if fault.array is not None and fault.array not in names:
            raise ValueError(f"faults.{k}.array must be one of {', '.join(names)}, got {fault.array!r}")


def _check_messages(scenario: Scenario) -> None:
    """Slots hold whole messages, which end before the next ones begin; only entries that are sent are observed."""
    modem, sound, channels = scenario.modem, scenario.latency.sound_speed_mps, scenario.sonar.channels
    if modem.message_entries == 0:
        if "messages" in channels:
            raise ValueError("modem.message_entries must be at least 1 with the channel messages, got 0; raise it")
        return
    if "modem" in channels:
        raise ValueError(
            f"sonar.channels can't hold modem where modem.message_entries = {modem.message_entries} replaces the "
            "velocity in messages; use the channel messages"
        )
    if 2 * modem.message_vectors > modem.message_entries:
        raise ValueError(
            f"modem.message_vectors must be at most half of modem.message_entries = {modem.message_entries}, got "
            f"{modem.message_vectors}; lower it"
        )
    if modem.guard_m < modem.range_m:
        raise ValueError(
            f"modem.guard_m must be at least modem.range_m = {modem.range_m:g}, so that a message has arrived when the "
            f"next is sent, got {modem.guard_m:g}; raise it, or lower the range"
        )
    slot, slots = modem.slot_s(sound), scenario.swarm.num_vehicles if modem.access == "tdma" else 1
    if modem.period_s is not None and modem.period_s < slots * slot:
        raise ValueError(
            f"modem.period_s must be at least {slots * slot:.4g}, {slots} slots of {slot:.4g} s each, got "
            f"{modem.period_s:g}; raise it, or shorten messages or modem.guard_m"
        )
    if slot < scenario.timing.control_step_s:
        raise ValueError(
            f"modem.guard_m = {modem.guard_m:g} and modem.bit_rate_bps = {modem.bit_rate_bps:g} make slots of "
            f"{slot:.4g} s, shorter than timing.control_step_s = {scenario.timing.control_step_s:g}; raise the guard"
        )


def _check_speed(scenario: Scenario) -> None:
    """A vehicle with a rudder can follow l(t), to which it would never return; for others a warning is logged."""
    speed, most = scenario.trajectory.speed_mps, top_speed(scenario.vehicle, scenario.actuators)
    if speed <= most:
        return
    if scenario.actuators.kind == "force_torque":
        warn_of_speed(speed)
        return
    cruise = scenario.vehicle.cruise_mps
    raise ValueError(
        f"trajectory.speed_mps = {speed:g} is more than the {most:.3g} m/s that {scenario.vehicle.name!r} holds at "
        f"full force (actuators.max_force_n = {scenario.actuators.max_force_n:g}), and a rudder needs flow; lower it"
        + (f", for instance to the vehicle's cruise_mps = {cruise:g}" if cruise is not None and cruise <= most else "")
    )


def _check_mismatch(scenario: Scenario) -> None:
    """The simulation can follow all sampled vehicles: the lightest, with most resistance and thrust, is the fastest."""
    most, limits = scenario.mismatch, scenario.actuators
    if not any((most.mass, most.added_mass, most.drag, most.thrust)):
        return
    quickest = scenario.vehicle.times(1.0 - most.mass, 1.0 - most.added_mass, 1.0 + most.drag)
    pushed = limits.model_copy(
        update={
            "max_force_n": (1.0 + most.thrust) * limits.max_force_n,
            "max_astern_n": (1.0 + most.thrust) * limits.astern_n,
        }
    )
    try:
        check_vehicle(quickest, pushed, scenario.timing, scenario.start.speed_max_mps)
    except ValueError as error:
        raise ValueError(
            f"mismatch.mass = {most.mass:g}, added_mass = {most.added_mass:g}, drag = {most.drag:g} and thrust = "
            f"{most.thrust:g} may draw a vehicle that the simulation can't follow; lower them, or for this one: {error}"
        ) from None


@cache
def warn_of_speed(speed_mps: float) -> None:
    """Warn once that no vehicle can follow l(t)."""
    text = (
        "trajectory.speed_mps = %g is more than a vehicle holds at full force (actuators.max_force_n): none can follow"
    )
    logging.getLogger("uuv_marl").warning(text, speed_mps)
