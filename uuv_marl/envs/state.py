"""The global state for centralised critics: one flat vector of a world, and the table that explains it."""

import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import PerceptField
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.swarm import Swarm

Float32 = NDArray[np.float32]
_FAR = ("m", 64.0, -MAX_RANGE_M, MAX_RANGE_M)
_SPEED = ("m/s", 4.0, -64.0, 64.0)
_UNIT = ("1", 1.0, -1.0, 1.0)


def state_table(scenario: Scenario) -> tuple[PerceptField, ...]:
    """The fields in order. Positions are relative to l(t), north and east; vehicles come in the order of agents."""
    n, m = scenario.swarm.num_vehicles, scenario.max_obstacles
    return (
        PerceptField("alive", (n,), "1", 1.0, 0.0, 1.0, "per vehicle: 0 once lost"),
        PerceptField("position", (n, 2), *_FAR, "per vehicle: north and east of l(t)"),
        PerceptField("heading", (n, 2), *_UNIT, "per vehicle: cosine and sine from north"),
        PerceptField("velocity", (n, 2), *_SPEED, "per vehicle: surge and sway"),
        PerceptField("yaw_rate", (n,), "rad/s", 1.0, -64.0, 64.0, "per vehicle"),
        PerceptField("reference_velocity", (2,), *_SPEED, "of l(t), north and east"),
        PerceptField("end", (2,), *_FAR, "end of the trajectory, north and east of l(t)"),
        PerceptField("time", (1,), "1", 1.0, 0.0, 2.0, "share of the time limit that has passed"),
        PerceptField("obstacle", (m,), "1", 1.0, 0.0, 1.0, "per obstacle: 0 for padding"),
        PerceptField("obstacle_position", (m, 2), *_FAR, "per obstacle: centre, north and east of l(t)"),
        PerceptField("obstacle_radius", (m,), "m", 64.0, 0.0, MAX_RANGE_M, "per obstacle"),
    )


def state_bounds(scenario: Scenario) -> tuple[Float32, Float32]:
    """Lowest and highest value of every entry of the scaled vector."""
    table = state_table(scenario)
    sizes = [field.size for field in table]
    low = np.repeat(np.array([field.low / field.scale for field in table], np.float32), sizes)
    high = np.repeat(np.array([field.high / field.scale for field in table], np.float32), sizes)
    return low, high


def global_state(swarm: Swarm, world: int = 0) -> Float32:
    """A world's state, scaled by ``state_table``, shape (entry,), float32; lost vehicles are zero."""
    state, course, facts = swarm.state, swarm.course, swarm.facts
    alive, eta, nu = state.alive[world], state.eta[world], state.nu[world]
    origin = facts.reference[world, :2]
    num, m = int(course.num_obstacles[world]), swarm.scenario.max_obstacles
    obstacles, present = course.obstacles[world, :m], (np.arange(m) < num).astype(np.float64)
    fields = [
        alive,
        (eta[:, :2] - origin) * alive[:, None],
        np.stack([np.cos(eta[:, 2]), np.sin(eta[:, 2])], axis=-1) * alive[:, None],
        nu[:, :2] * alive[:, None],
        nu[:, 2] * alive,
        facts.reference[world, 2:],
        course.waypoints[world, course.last[world]] - origin,
        facts.time_s[world] / swarm.time_limit_s[world],
        present,
        (obstacles[:, :2] - origin) * present[:, None],
        obstacles[:, 2] * present,
    ]
    table = state_table(swarm.scenario)
    scaled = [
        np.clip(np.ravel(values), field.low, field.high) / field.scale
        for field, values in zip(table, fields, strict=True)
    ]
    return np.concatenate(scaled).astype(np.float32)
