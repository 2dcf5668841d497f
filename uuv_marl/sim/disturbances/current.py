"""Current: the sum of a mean, a Gauss-Markov process (Fossen 2021, section 10.3) and Lamb-Oseen eddies.

A vehicle's equations of motion hold relative to the water, which carries it along
(``uuv_marl.sim.vehicle.derivative``). The field is evaluated at each vehicle once per control step.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from uuv_marl.percept import DisturbanceFields, Fields
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.disturbance_sections import AROUND_M
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inline, compiled_inner
from uuv_marl.sim.exponential import decay_mean, exp
from uuv_marl.sim.perception import body_velocity
from uuv_marl.sim.random import DIRECTION, EDDY_PLACE, GUST, normals, uniform, uniforms
from uuv_marl.sim.tables import described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Float64

_PEAK = 0.638172686
"""Largest speed around a Lamb-Oseen vortex, in circulation / (2 pi core): at 1.12091 core radii. [derived]"""


class WaterModel(NamedTuple):
    """Constants of a scenario's current."""

    speed: float  # speed of the mean current [m/s]
    direction: float  # direction to which the mean current flows [rad], NaN if random
    deviation: float  # standard deviation of the process [m/s]
    remains: float  # autocorrelation of the process over a control step
    circulation: float  # circulation of an eddy [m2/s]
    core: float  # radius of an eddy's core [m]
    over_ground: bool  # whether a vehicle measures its velocity over ground, not through the water


@described
class Flow(NamedTuple):
    """The current of each world."""

    mean: Annotated[Float64, "world 2", "Velocity of the mean, north and east [m/s]."]
    gust: Annotated[Float64, "world 2", "Present value of the process, north and east [m/s]."]
    eddies: Annotated[Float64, "world eddy 3", "Centre north, east [m] and circulation [m2/s]; 0 in the padding."]
    flow: Annotated[Float64, "world vehicle 2", "Velocity of the water at each vehicle, north and east [m/s]."]


class FlowField(NamedTuple):
    """Velocity field of the water of one world at one time; an independent copy."""

    drift: Float64
    """Velocity of the mean and the process together, north and east [m/s], shape (2,)."""
    eddies: Float64
    """Centre north, east [m] and circulation [m2/s], shape (eddy, 3)."""
    core_m: float
    """Radius of the eddies' cores [m]."""

    def at(self, points: ArrayLike) -> Float64:
        """Velocity of the water, north and east [m/s], at points given by north and east [m]; both (..., 2)."""
        points = np.asarray(points, np.float64)
        if points.shape[-1:] != (2,):
            raise ValueError(f"points must be north and east [m], shape (..., 2), got shape {points.shape}")
        places = np.ascontiguousarray(points).reshape(1, -1, 2)
        flow = Flow(self.drift[None], np.zeros((1, 2)), self.eddies[None], np.zeros(places.shape))
        read_flow(0, places, self.core_m, flow)
        return flow.flow.reshape(points.shape)


def water(scenario: Scenario) -> WaterModel:
    """Constants of the scenario's current for the compiled functions."""
    current = scenario.current
    direction = current.direction_deg
    return WaterModel(
        speed=current.speed_mps,
        direction=math.nan if direction is None else math.radians(direction),
        deviation=current.variation_mps,
        remains=exp(-scenario.timing.control_step_s / current.variation_time_s),
        circulation=current.eddy_speed_mps * 2.0 * math.pi * current.eddy_core_m / _PEAK,
        core=current.eddy_core_m,
        over_ground=current.velocity == "ground",
    )


def sample_flow(w: int, key: np.uint64, waypoints: Float64, scenario: Scenario, water: WaterModel, flow: Flow) -> None:
    """Sample the current of world w's new episode around its ``waypoints``, shape (point, 2) [m], into ``flow``."""
    angle = water.direction
    if math.isnan(angle):
        angle = 2.0 * math.pi * uniform(key, DIRECTION, 0, 0, 0)
    flow.mean[w] = [water.speed * part for part in cos_sin(angle)]
    flow.gust[w] = [water.deviation * part for part in normals(key, GUST, 0, 0, 0)]
    flow.eddies[w] = 0.0
    if flow.eddies.shape[1] > 0:
        low, high = waypoints.min(axis=0) - AROUND_M, waypoints.max(axis=0) + AROUND_M
        count = min(scenario.current.num_eddies(*np.ptp(waypoints, axis=0)), flow.eddies.shape[1])
        for k in range(count):
            flow.eddies[w, k, :2] = low + np.array(uniforms(key, EDDY_PLACE, 0, 0, k)) * (high - low)
            flow.eddies[w, k, 2] = (-1.0) ** k * water.circulation


@compiled_inline
def eddy_flow(dx: float, dy: float, circulation: float, core: float) -> tuple[float, float]:
    """Velocity, north and east [m/s], around a Lamb-Oseen vortex.

    v(r) = circulation / (2 pi r) (1 - exp(-r^2 / core^2)), smooth at its centre. It is clockwise where ``circulation``
    [m2/s] is positive; ``core`` is the radius of its core [m].
    """
    share = circulation / (2.0 * math.pi * core * core) * decay_mean((dx * dx + dy * dy) / (core * core))
    return -share * dy, share * dx


@compiled
def advance_gust(w: int, key: np.uint64, tick: int, water: WaterModel, flow: Flow) -> None:
    """Advance the process by one control step exactly: mean and variance don't depend on the step's length.

    ``tick`` counts this control step.
    """
    kick = water.deviation * math.sqrt(1.0 - water.remains * water.remains)
    north, east = normals(key, GUST, tick, 0, 0)
    flow.gust[w, 0] = water.remains * flow.gust[w, 0] + kick * north
    flow.gust[w, 1] = water.remains * flow.gust[w, 1] + kick * east


@compiled
def read_flow(w: int, eta: Float64, core: float, flow: Flow) -> None:
    """Evaluate the current at every vehicle of world w, north and east in ``eta``, into ``flow.flow``.

    ``core``: radius of the eddies' cores [m].
    """
    everywhere = flow.mean[w, 0] + flow.gust[w, 0], flow.mean[w, 1] + flow.gust[w, 1]
    for i in range(eta.shape[1]):
        flow.flow[w, i, 0], flow.flow[w, i, 1] = everywhere
    for k in range(flow.eddies.shape[1]):  # eddy by eddy, which is vectorised
        x, y, circulation = flow.eddies[w, k, 0], flow.eddies[w, k, 1], flow.eddies[w, k, 2]
        for i in range(eta.shape[1] if circulation != 0.0 else 0):
            north, east = eddy_flow(eta[w, i, 0] - x, eta[w, i, 1] - y, circulation, core)
            flow.flow[w, i, 0] += north
            flow.flow[w, i, 1] += east


@compiled
def over_ground(w: int, j: int, state: State, flow: Flow) -> tuple[float, float]:
    """Velocity of a vehicle over ground, north and east [m/s]; 0 for a lost one."""
    if not state.alive[w, j]:
        return 0.0, 0.0
    (c, s), u, v = cos_sin(state.eta[w, j, 2]), state.nu[w, j, 0], state.nu[w, j, 1]
    return c * u - s * v + flow.flow[w, j, 0], s * u + c * v + flow.flow[w, j, 1]


@compiled_inner
def write_velocities(w: int, world: World, water: WaterModel, flow: Flow, see: Fields, more: DisturbanceFields) -> None:
    """Write each vehicle's velocity in the current, and its neighbours' by the link, into the percepts of world w."""
    state, heading = world.state, world.senses.heading
    for i in range(state.alive.shape[1]):
        if not state.alive[w, i]:
            continue
        c, s = heading[w, i, 0], heading[w, i, 1]
        v_x, v_y = over_ground(w, i, state, flow)
        ahead, abeam = body_velocity(v_x, v_y, c, s)
        if more.ground_velocity.shape[2] > 0:
            more.ground_velocity[w, i, 0], more.ground_velocity[w, i, 1] = ahead, abeam
            more.water_velocity[w, i, 0], more.water_velocity[w, i, 1] = see.velocity[w, i, 0], see.velocity[w, i, 1]
        if water.over_ground and (flow.flow[w, i, 0] != 0.0 or flow.flow[w, i, 1] != 0.0):
            see.velocity[w, i, 0], see.velocity[w, i, 1] = ahead, abeam
        for k in range(see.link_identity.shape[2]):
            j = world.senses.detected_index[w, i, k]
            if j >= 0:
                v_x, v_y = over_ground(w, j, state, flow)
                see.link_velocity[w, i, k, 0], see.link_velocity[w, i, k, 1] = body_velocity(v_x, v_y, c, s)
