"""Navigation errors: a drifting position estimate, and a compass with a constant bias.

Both change the vector to l(t), its velocity and the compass in the body frame; the bias also changes messages. The
sonar is unaffected. The bias does not cause drift: the two are independent.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields, Fields
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.perception import saturate, toward, write_reference
from uuv_marl.sim.random import COMPASS, DRIFT, normal, uniform
from uuv_marl.sim.tables import described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Float64


@described
class NavigationErrors(NamedTuple):
    """Errors of each vehicle's navigation."""

    drift_direction: Annotated[Float64, "world vehicle 2", "Direction of its drift, a unit vector north and east."]
    position_error: Annotated[Float64, "world vehicle 2", "Estimated less true position, north and east [m]."]
    bias: Annotated[Float64, "world vehicle 2", "Cosine and sine of its compass's bias, clockwise."]
    start_position: Annotated[Float64, "world vehicle 2", "Position at the start, north and east [m]."]


def sample_navigation_errors(w: int, key: np.uint64, compass_bias: float, errors: NavigationErrors) -> None:
    """Sample drift directions and compass biases of world w's new episode from its key."""
    for i in range(errors.position_error.shape[1]):
        errors.drift_direction[w, i] = cos_sin(2.0 * math.pi * uniform(key, DRIFT, 0, i, 0))
        errors.bias[w, i] = cos_sin(compass_bias * normal(key, COMPASS, 0, i, 0))


@compiled_inner
def drift_position(w: int, state: State, drift_share: float, errors: NavigationErrors) -> None:
    """Add the drift of one control step to the position errors."""
    if drift_share == 0.0:
        return
    for i in range(state.eta.shape[1]):
        dx, dy = state.eta[w, i, 0] - state.before[w, i, 0], state.eta[w, i, 1] - state.before[w, i, 1]
        off = drift_share * math.sqrt(dx * dx + dy * dy)
        errors.position_error[w, i, 0] += off * errors.drift_direction[w, i, 0]
        errors.position_error[w, i, 1] += off * errors.drift_direction[w, i, 1]


@compiled
def by_compass(w: int, i: int, north: float, east: float, errors: NavigationErrors) -> tuple[float, float]:
    """Turn a vector north and east, or a heading's cosine and sine, clockwise by a vehicle's compass bias."""
    c, s = errors.bias[w, i, 0], errors.bias[w, i, 1]
    return c * north - s * east, c * east + s * north


@compiled_inner
def navigate(w: int, world: World, errors: NavigationErrors, see: Fields) -> None:
    """Write l(t) and the compass into the percepts of world w as each vehicle's navigation estimates them."""
    eta, heading = world.state.eta, world.senses.heading
    for i in range(eta.shape[1]):
        if not world.state.alive[w, i]:
            continue
        c, s = by_compass(w, i, heading[w, i, 0], heading[w, i, 1], errors)
        x, y = eta[w, i, 0] + errors.position_error[w, i, 0], eta[w, i, 1] + errors.position_error[w, i, 1]
        write_reference(w, i, (x, y, c, s), world, see)
        if see.compass.shape[2] > 0:
            see.compass[w, i, 0], see.compass[w, i, 1] = saturate(c, 1.0), saturate(s, 1.0)


@compiled_inner
def begin_navigation(w: int, state: State, errors: NavigationErrors) -> None:
    """Note where world w's vehicles are, without an error."""
    errors.position_error[w] = 0.0
    for i in range(state.eta.shape[1]):
        errors.start_position[w, i, 0], errors.start_position[w, i, 1] = state.eta[w, i, 0], state.eta[w, i, 1]


@compiled_inner
def write_odometry(w: int, world: World, errors: NavigationErrors, more: DisturbanceFields) -> None:
    """Write the motion since the start into the percepts of world w as each vehicle's navigation estimates it."""
    eta, heading = world.state.eta, world.senses.heading
    for i in range(eta.shape[1] if more.odometry.shape[2] else 0):
        if world.state.alive[w, i]:
            c, s = by_compass(w, i, heading[w, i, 0], heading[w, i, 1], errors)
            dx = eta[w, i, 0] + errors.position_error[w, i, 0] - errors.start_position[w, i, 0]
            dy = eta[w, i, 1] + errors.position_error[w, i, 1] - errors.start_position[w, i, 1]
            more.odometry[w, i, 0], more.odometry[w, i, 1] = toward(dx, dy, c, s)
