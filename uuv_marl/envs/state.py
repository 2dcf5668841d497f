"""The global state for centralised critics: a flat vector for each world, and the table of its fields."""

from typing import cast

import numpy as np

from uuv_marl import percept
from uuv_marl.percept import DIRECTION, FLAG, LENGTH, POSITION, SPEED, YAW_RATE, PerceptField, PerceptLayout, Quantity
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.task import Task
from uuv_marl.types import Float32

_TIME = Quantity("1", 1.0, 0.0, 2.0)


def state_table(scenario: Scenario) -> tuple[PerceptField, ...]:
    """The fields in order. Positions are relative to l(t), north and east; vehicles come in the order of agents."""
    n, m, task = scenario.swarm.num_vehicles, scenario.max_obstacles, cast(type[Task], scenario.task_class)
    speed = PerceptField("obstacle_velocity", (m, 2), SPEED, "per obstacle that moves: its velocity, north and east")
    vehicle_rows = (row._replace(shape=(n, *row.shape), meaning=f"per vehicle: {row.meaning}") for row in task.observed)
    groups = task.sizes(scenario).get("group", 1)
    return (
        PerceptField("alive", (n,), FLAG, "per vehicle: 1, or 0 once it is lost"),
        PerceptField("position", (n, 2), POSITION, "per vehicle: position relative to l(t), north and east"),
        PerceptField("heading", (n, 2), DIRECTION, "per vehicle: cosine and sine of the heading from north"),
        PerceptField("velocity", (n, 2), SPEED, "per vehicle: surge and sway velocity over ground"),
        PerceptField("yaw_rate", (n,), YAW_RATE, "per vehicle: yaw rate"),
        PerceptField("reference_velocity", (2,), SPEED, "velocity of l(t), north and east"),
        PerceptField("end", (groups, 2), POSITION, "per group: end of its trajectory relative to l(t), north and east"),
        PerceptField("time", (1,), _TIME, "share of the time limit that has passed"),
        PerceptField("time_left", (1,), percept.DURATION, "time until the limit"),
        PerceptField("motion_left", (1,), percept.DURATION, "time until l(t) rests"),
        PerceptField("obstacle", (m,), FLAG, "per obstacle: 1, or 0 for an unused row"),
        PerceptField("obstacle_position", (m, 2), POSITION, "per obstacle: centre relative to l(t), north and east"),
        PerceptField("obstacle_radius", (m,), LENGTH, "per obstacle: radius"),
        *([speed] if scenario.traffic.moves else []),
        *vehicle_rows,
        *task.state_fields(scenario),
    )


def state_layout(scenario: Scenario) -> PerceptLayout:
    """The table with its bounds, scales and positions in the flat vector."""
    return PerceptLayout(state_table(scenario))


def global_state(swarm: Swarm, layout: PerceptLayout) -> Float32:
    """The state of every world, scaled by its layout, shape (world, entry), float32; lost vehicles are zero."""
    state, world_map, facts = swarm.state, swarm.world_map, swarm.facts
    m = swarm.scenario.max_obstacles
    alive, reference = state.alive[:, :, None].astype(np.float64), swarm.mean_reference
    origin = reference[:, None, :2]
    obstacles = world_map.obstacles[:, :m]
    present = (np.arange(m) < world_map.num_obstacles[:, None])[:, :, None]
    stated = swarm.task.state()
    fields = (
        alive,
        (state.eta[:, :, :2] - origin) * alive,
        swarm.heading * alive,
        swarm.velocity * alive,
        state.nu[:, :, 2:] * alive,
        reference[:, 2:],
        np.take_along_axis(world_map.waypoints, world_map.last[:, :, None, None], axis=2)[:, :, 0] - origin,
        facts.time_s / swarm.time_limit_s,
        swarm.time_limit_s - facts.time_s,
        swarm.duration_s - facts.time_s,
        present,
        (obstacles[:, :, :2] - origin) * present,
        obstacles[:, :, 2:] * present,
        *([world_map.obstacle_velocity[:, :m]] if swarm.scenario.traffic.moves else []),
        *(swarm.percept[row.name] for row in swarm.task.observed),
        *(stated[row.name] for row in swarm.task.state_fields(swarm.scenario)),
    )
    rows = [np.reshape(field, (swarm.num_worlds, -1)) for field in fields]
    flat = np.concatenate(rows, axis=1, dtype=np.float32, casting="same_kind")
    flat /= layout.scale
    # np.clip takes three times as long
    np.maximum(flat, layout.low, out=flat)
    return np.minimum(flat, layout.high, out=flat)
