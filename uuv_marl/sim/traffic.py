"""Obstacles that move to and fro about their places (``traffic``): a triangle wave, which time alone decides.

An obstacle turns at the end of a control hold, as near to ``way_m`` as it gets, so that its speed never changes.
"""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import WorldMap
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.disturbances.purposes import MOVER, MOVER_DIRECTION
from uuv_marl.sim.random import uniform
from uuv_marl.sim.trigonometry import cos_sin

_LONG = 2**31
"""Control holds that no episode has; who moves so slowly never turns."""


def sample_traffic(w: int, key: np.uint64, scenario: Scenario, world_map: WorldMap) -> None:
    """The obstacles of world w's new episode that move, and where to, from its key alone; the others stand still."""
    world_map.obstacle_velocity[w], world_map.swing[w], world_map.swing_control_steps[w] = 0.0, 0.0, 0
    traffic, m = scenario.traffic, int(world_map.num_obstacles[w])
    if not traffic.moves:
        return
    order = sorted(range(m), key=lambda k: uniform(key, MOVER, 0, k, 0))
    control_steps = min(
        math.floor(traffic.amplitude_m / (traffic.speed_mps * scenario.timing.control_step_s) + 1e-9), _LONG
    )
    for k in order[: math.ceil(traffic.share * m - 1e-9)]:
        c, s = cos_sin(2.0 * math.pi * uniform(key, MOVER_DIRECTION, 0, k, 0))
        velocity = traffic.speed_mps * c, traffic.speed_mps * s
        world_map.obstacle_velocity[w, k] = velocity
        world_map.swing[w, k], world_map.swing_control_steps[w, k] = (
            (*world_map.obstacles[w, k, :2], *velocity),
            control_steps,
        )


@compiled_inline
def triangle(tick: int, control_steps: int) -> int:
    """How many holds of its way an obstacle is from its place, from -``holds`` to ``holds``, 0 at the start."""
    return control_steps - abs((tick + control_steps) % (4 * control_steps) - 2 * control_steps)
