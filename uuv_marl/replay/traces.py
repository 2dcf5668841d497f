"""Recordings from a benchmark's saved traces, without simulation and without the policy."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from pydantic import ValidationError

from uuv_marl.baselines.making import with_requirements
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.results import FILE, Content, load_trace, read_content, requirements_of, trace_path
from uuv_marl.errors import ReplayError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.replay.command import command
from uuv_marl.replay.events import arrival, losses, near_misses
from uuv_marl.replay.record import finite
from uuv_marl.replay.recording import Event, Recording, Water
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.files import frozen
from uuv_marl.scenario.messages import explain
from uuv_marl.sim.disturbances.current import Flow, advance_gust, water
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trajectory import reference
from uuv_marl.sim.world import move_obstacles
from uuv_marl.tasks.groups import groups_of
from uuv_marl.types import Float32, Float64

_ELSE = "give the folder of a benchmark or a file of its folder traces, or simulate with --scenario and --policy"
_MOST_LISTED = 10
_SHAPES: dict[str, tuple[str | int, ...]] = {
    "time_s": ("time",),
    "min_spacing_m": ("time",),
    "centre_error_m": ("time",),
    "obstacle_distance_m": ("time", "obstacle"),
    "obstacles": ("obstacle", 3),
    "waypoints": ("point", 2),
    "route_time_s": ("sample",),
    "route_position": ("sample", "vehicle", 2),
    "route_heading": ("sample", "vehicle"),
    "route_velocity": ("sample", "vehicle", 2),
}
"""Shapes of the required arrays; equal names are equal sizes."""


class Saved(NamedTuple):
    """A benchmark's folder, and the content of its results.json."""

    folder: Path
    content: Content

    @staticmethod
    def at(folder: Path) -> "Saved":
        """Read a folder. Raises ReplayError without a results.json."""
        if not (folder / FILE).is_file():
            raise ReplayError(f"{folder} holds no {FILE} that describes the runs; {_ELSE}")
        return Saved(folder, read_content(folder / FILE, "run the benchmark again, into another --output"))


def from_trace(path: UserPath) -> Recording:
    """The recording of a file in the folder ``traces`` of a benchmark.

    It has no force, spacing of single vehicles, collisions over time or inspections.

    Raises:
        ReplayError: the file is not a trace of a benchmark, or holds no trajectories.
        ResultsError: the file or its results.json can't be read.
    """
    path = user_path(path)
    if not path.exists():
        raise ReplayError(f"{path} does not exist; {_ELSE}")
    saved = Saved.at(path.absolute().parent.parent)
    for row in saved.content["runs"]:
        if trace_path(saved.folder, *row[:3]) == path.absolute():
            return _recording(saved, row.scenario, row.policy, row.seed, row.metrics)
    raise ReplayError(f"{path} is not the trace of a run in {saved.folder / FILE}; {_ELSE}")


def from_folder(folder: UserPath, scenario: str | None, policy: str | None, seed: int) -> Recording:
    """The recording of a run in a benchmark's folder, see ``from_trace``.

    Args:
        folder: folder of the results.json.
        scenario: its name; None if there is only one.
        policy: its name; None if the scenario has only one.
        seed: seed of the run.

    Raises:
        ReplayError: there is no such run, or its trace holds no trajectories.
        ResultsError: results.json or the trace can't be read.
    """
    saved = Saved.at(user_path(folder))
    rows = saved.content["runs"]
    scenario = _chosen(folder, "--scenario", scenario, {row.scenario for row in rows})
    rows = [row for row in rows if row.scenario == scenario]
    policy = _chosen(folder, "--policy", policy, {row.policy for row in rows})
    metrics = {row.seed: row.metrics for row in rows if row.policy == policy}
    if seed not in metrics:
        raise ReplayError(
            f"{folder} holds no run of {policy} on {scenario} with seed {seed}, only {_listed(metrics)}; give one of "
            f"these, or simulate it: {command(scenario, policy, seed)}"
        )
    return _recording(saved, scenario, policy, seed, metrics[seed])


def _chosen(folder: UserPath, option: str, wanted: str | None, held: set[str]) -> str:
    """The requested name, or the only one in the folder."""
    if wanted in held:
        return wanted
    if wanted is None and len(held) == 1:
        return next(iter(held))
    missing = "" if wanted is None else f" no {wanted!r} but"
    raise ReplayError(f"{folder} holds{missing} {_listed(held) or 'no runs'}; choose with {option}")


def _listed(held: Iterable[Any]) -> str:
    """The first names, for a message."""
    names = [str(name) for name in sorted(held)]
    return ", ".join(names[:_MOST_LISTED]) + (" and others" if len(names) > _MOST_LISTED else "")


def _recording(saved: Saved, name: str, policy: str, seed: int, metrics: Metrics) -> Recording:
    """The recording of one run."""
    path, scenario = trace_path(saved.folder, name, policy, seed), _scenario(saved, name, policy)
    trace = load_trace(path)
    if not any(array.startswith("route_") for array in trace):
        raise ReplayError(
            f"{path} holds no trajectories: a benchmark keeps only those of seed 0. Simulate the run again, with the "
            f"benchmark's own --set or file: {command(name, policy, seed)}"
        )
    _check(path, trace, scenario.swarm.num_vehicles)
    at = np.searchsorted(trace["time_s"], trace["route_time_s"])
    since = np.concatenate([[0], at[:-1] + 1])
    spacing = np.minimum.reduceat(trace["min_spacing_m"], since)
    clearance = np.minimum.reduceat(trace["obstacle_distance_m"].min(axis=1, initial=np.inf), since)
    velocity, swarm = trace["route_velocity"], Swarm(scenario)
    swarm.reset(seed)  # determines groups, paths, traffic and water
    return Recording(
        scenario=scenario,
        policy=policy,
        seed=seed,
        metrics=metrics,
        waypoints=trace["waypoints"],
        obstacles=trace["obstacles"],
        groups=groups_of(swarm),
        traffic=_traffic(swarm, trace["route_time_s"]),
        marks=np.zeros((len(velocity), 0, 3), np.float32),
        time_s=trace["route_time_s"],
        references=_references(swarm, trace["route_time_s"]),
        position=trace["route_position"],
        heading=trace["route_heading"],
        speed=np.hypot(velocity[:, :, 0], velocity[:, :, 1]),
        series={
            "min_spacing_m": finite(spacing),
            "obstacle_clearance_m": finite(clearance),
            "centre_error_m": trace["centre_error_m"][at],
        },
        events=_events(scenario, trace, metrics),
        force=None,
        spacing=None,
        inspections={},
        water=_water(swarm, trace["route_time_s"]),
    )


def _scenario(saved: Saved, name: str, policy: str) -> Scenario:
    """The scenario of a run, with the policy's requirements."""
    data = frozen(saved.content["scenarios"][name])
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        raise ReplayError(
            f"{saved.folder / FILE} describes {name!r} as another version of uuv_marl "
            f"({explain(error, data, Scenario)}); run the benchmark again"
        ) from None
    return with_requirements(policy, requirements_of(saved.content["policies"][policy]), scenario)


def _check(path: Path, trace: dict[str, Float32], num_vehicles: int) -> None:
    """Raise ReplayError where arrays of a trace are missing or have another shape or type."""
    sizes: dict[str | int, int] = {2: 2, 3: 3, "vehicle": num_vehicles}
    for name, axes in _SHAPES.items():
        shape = trace[name].shape if name in trace and trace[name].dtype == np.float32 else ()
        if len(shape) != len(axes) or any(sizes.setdefault(a, n) != n for a, n in zip(axes, shape, strict=True)):
            got = f"is {trace[name].dtype} of shape {trace[name].shape}" if name in trace else "is missing"
            raise ReplayError(f"{path} is not a trace of this version: {name} {got}; run the benchmark again")
    if not len(trace["route_time_s"]) or not np.isin(trace["route_time_s"], trace["time_s"]).all():
        raise ReplayError(f"{path}: route_time_s must be times of time_s; run the benchmark again")


def _water(swarm: Swarm, time_s: Float32) -> Water | None:
    """Motion of the water since the reset."""
    scenario = swarm.scenario
    if not scenario.current.flows:
        return None
    numbers, tick = water(scenario), 0
    drift = np.zeros((len(time_s), 2), np.float32)
    for k, until in enumerate(np.rint(time_s / scenario.timing.control_step_s).astype(int).tolist()):
        while tick < until:
            tick += 1
            advance_gust(0, swarm.keys[0], tick, numbers, cast(Flow, swarm.currents))
        drift[k] = swarm.flow_field().drift
    return Water(drift, swarm.flow_field().eddies)


def _traffic(swarm: Swarm, time_s: Float32) -> Float32 | None:
    """Centres of moving obstacles since the reset, shape (time, obstacle, 2); None where none moves."""
    if not swarm.scenario.traffic.moves:
        return None
    control_step_s, places = swarm.scenario.timing.control_step_s, list[Float64]()
    for tick in np.rint(time_s / control_step_s).astype(int).tolist():
        move_obstacles(0, tick, swarm.world_map, control_step_s)
        places.append(swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0], :2].copy())
    return np.array(places, np.float32)


def _references(swarm: Swarm, time_s: Float32) -> Float32:
    """Position of each group's l(t), shape (time, group, 2)."""
    world_map, passes = swarm.world_map, swarm.scenario.arrival.criterion == "passage"
    trajectories = list(zip(world_map.waypoints[0], world_map.times[0], world_map.last[0].tolist(), strict=True))
    return np.array(
        [[reference(t, *trajectory, passes)[:2] for trajectory in trajectories] for t in time_s.tolist()], np.float32
    )


def _events(scenario: Scenario, trace: dict[str, Float32], metrics: Metrics) -> list[Event]:
    """Events from the series, sorted by time; only lost vehicles are named."""
    time, hull, limits = trace["time_s"], scenario.collision.hull_radius_m, scenario.constraints
    spacing, clearance = trace["min_spacing_m"], trace["obstacle_distance_m"].min(axis=1, initial=np.inf)
    marks = [
        event
        for kind, low in (
            ("collision", spacing < 2 * hull),
            ("obstacle", clearance < hull),
            ("near", spacing < limits.s_u_m),
            ("near_obstacle", clearance < limits.s_o_m),
        )
        for event in near_misses(kind, time, low[:, None])
    ]
    alive = np.isfinite(trace["route_heading"])
    events = [*(event._replace(vehicles=()) for event in marks), *losses(trace["route_time_s"], alive)]
    return sorted([*events, *arrival(metrics["task_time_s"])], key=lambda event: event.time_s)
