"""Moving obstacles (``traffic``): a triangle wave of time about their sampled centres.

An obstacle turns at the end of a control step, nearest to ``amplitude_m``, so that its speed is constant.
"""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import WorldMap
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.random import MOVER, MOVER_DIRECTION, uniform
from uuv_marl.sim.trigonometry import cos_sin

_LONG = 2**31
"""More control steps than any episode has."""


def sample_traffic(w: int, key: np.uint64, scenario: Scenario, world_map: WorldMap) -> None:
    """Sample the moving obstacles of world w's new episode and their velocities from its key; the others are fixed."""
    world_map.obstacle_velocity[w], world_map.swing[w], world_map.swing_control_steps[w] = 0.0, 0.0, 0
    traffic, m = scenario.traffic, int(world_map.num_obstacles[w])
    if not traffic.moves:
        return
    order = sorted(range(m), key=lambda k: uniform(key, MOVER, 0, k, 0))
    step_m = traffic.speed_mps * scenario.timing.control_step_s
    control_steps = min(math.floor(traffic.amplitude_m / step_m + 1e-9), _LONG)
    for k in order[: math.ceil(traffic.share * m - 1e-9)]:
        c, s = cos_sin(2.0 * math.pi * uniform(key, MOVER_DIRECTION, 0, k, 0))
        velocity = traffic.speed_mps * c, traffic.speed_mps * s
        world_map.obstacle_velocity[w, k] = velocity
        world_map.swing[w, k] = (*world_map.obstacles[w, k, :2], *velocity)
        world_map.swing_control_steps[w, k] = control_steps


@compiled_inline
def triangle(tick: int, control_steps: int) -> int:
    """Displacement of an obstacle in control steps of motion, within ``control_steps`` of 0; 0 at tick 0."""
    return control_steps - abs((tick + control_steps) % (4 * control_steps) - 2 * control_steps)
