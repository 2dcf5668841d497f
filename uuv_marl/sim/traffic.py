"""Obstacles that move to and fro about their places (``traffic``): a triangle wave, which time alone decides.

An obstacle turns at the end of a control hold, as near to ``way_m`` as it gets, so that its speed never changes.
"""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import Course
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.random import uniform
from uuv_marl.sim.sea.purposes import MOVER, MOVER_WAY
from uuv_marl.sim.trigonometry import cos_sin

_LONG = 2**31
"""Control holds that no episode has; who moves so slowly never turns."""


def draw_traffic(w: int, key: np.uint64, scenario: Scenario, course: Course) -> None:
    """The obstacles of world w's new episode that move, and where to, from its key alone; the others stand still."""
    course.obstacle_velocity[w], course.swing[w], course.swing_holds[w] = 0.0, 0.0, 0
    traffic, m = scenario.traffic, int(course.num_obstacles[w])
    if not traffic.moves:
        return
    order = sorted(range(m), key=lambda k: uniform(key, MOVER, 0, k, 0))
    holds = min(math.floor(traffic.way_m / (traffic.speed_mps * scenario.timing.control_hold_s) + 1e-9), _LONG)
    for k in order[: math.ceil(traffic.share * m - 1e-9)]:
        c, s = cos_sin(2.0 * math.pi * uniform(key, MOVER_WAY, 0, k, 0))
        velocity = traffic.speed_mps * c, traffic.speed_mps * s
        course.obstacle_velocity[w, k] = velocity
        course.swing[w, k], course.swing_holds[w, k] = (*course.obstacles[w, k, :2], *velocity), holds


@compiled_inline
def triangle(tick: int, holds: int) -> int:
    """How many holds of its way an obstacle is from its place, from -``holds`` to ``holds``, 0 at the start."""
    return holds - abs((tick + holds) % (4 * holds) - 2 * holds)
