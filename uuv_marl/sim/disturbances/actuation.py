"""Imperfect actuation: lags, reduced yaw authority, model mismatch and faults.

A fault degrades the thruster, the yaw torque or a sonar array of some vehicles for a time, or loses the vehicles.
"""

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled, compiled_inline, compiled_inner, from_source
from uuv_marl.sim.exponential import exp
from uuv_marl.sim.model import Rules
from uuv_marl.sim.random import MISMATCH, ONSET, VICTIM, uniform, uniforms
from uuv_marl.sim.tables import described
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import Plant, Vector2, advance_lagging, plant, wrap
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import Bool, Float64, Int64

THRUSTER, YAW, ARRAY, MEMBER = range(4)
_KINDS = {"thruster": THRUSTER, "yaw": YAW, "array": ARRAY, "member": MEMBER}
_NEVER = 2**62
"""A control step beyond every episode."""
PLANT = len(Plant._fields)


class Actuation(NamedTuple):
    """Constants of a scenario's lags, yaw authority and faults."""

    # Shares of the difference between commanded and actual thrust that remain after half an integration step and after
    # a whole one; 0 without a lag
    thrust_lag: Vector2
    yaw_lag: Vector2  # the same for the torque
    yaw_authority: float  # share of the commanded torque that acts on the vehicle
    kind: Int64  # kind of each fault: ``THRUSTER``, ``YAW``, ``ARRAY`` or ``MEMBER``, shape (fault,)
    efficiency: Float64  # share of thrust or torque that remains under a fault, shape (fault,)
    array: Int64  # index of the array that a fault disables, -1 for none, shape (fault,)


@described
class Hull(NamedTuple):
    """Each vehicle's own parameters, forces and faults."""

    plants: Annotated[Float64, "world vehicle plant", "Its own ``uuv_marl.sim.vehicle.Plant``, field by field."]
    thrust: Annotated[Float64, "world vehicle", "Its thrust, as a share of the scenario's."]
    tau: Annotated[Float64, "world vehicle 2", "Thrust [N] and torque [N m] (or rudder [rad]) in the water now."]
    broken: Annotated[Int64, "world vehicle fault 2", "First control step of each fault, and the end."]


_PLANT = f"Plant({', '.join(f'hull.plants[w, i, {k}]' for k in range(PLANT))})"
own_plant: Callable[[int, int, Hull], Plant] = compiled_inline(
    from_source("own_plant", "w, i, hull", _PLANT, globals())
)
"""Vehicle i's own parameters; ``hull.plants`` holds the fields in order."""


def actuation(scenario: Scenario) -> Actuation:
    """Constants of the scenario's lags, yaw authority and faults for the compiled functions."""
    actuators, names = scenario.actuators, [array.name for array in scenario.sonar.arrays]

    h = scenario.timing.integration_step_s

    def remain(lag_s: float) -> Vector2:
        return (exp(-0.5 * h / lag_s), exp(-h / lag_s)) if lag_s > 0.0 else (0.0, 0.0)

    return Actuation(
        thrust_lag=remain(actuators.thrust_lag_s),
        yaw_lag=remain(actuators.yaw_lag_s),
        yaw_authority=actuators.yaw_authority,
        kind=np.array([_KINDS[fault.kind] for fault in scenario.faults], np.int64),
        efficiency=np.array([fault.efficiency for fault in scenario.faults], np.float64),
        array=np.array([names.index(f.array) if f.array is not None else -1 for f in scenario.faults], np.int64),
    )


def sample_hulls(w: int, key: np.uint64, duration_s: float, scenario: Scenario, hull: Hull) -> None:
    """Sample the vehicles of world w's new episode into ``hull``; faults begin within ``duration_s``."""
    hull.tau[w] = 0.0
    mismatch = scenario.mismatch
    shares = np.array([mismatch.mass, mismatch.added_mass, mismatch.drag, mismatch.thrust])
    hull.plants[w], hull.thrust[w] = plant(scenario), 1.0
    if shares.max() > 0.0:
        for i in range(scenario.swarm.num_vehicles):
            drawn = np.array([*uniforms(key, MISMATCH, 0, i, 0), *uniforms(key, MISMATCH, 0, i, 1)])
            mass, added_mass, drag, thrust = (1.0 + shares * (2.0 * drawn - 1.0)).tolist()
            own = scenario.vehicle.times(mass, added_mass, drag)
            hull.plants[w, i] = plant(scenario.model_copy(update={"vehicle": own}))
            hull.thrust[w, i] = thrust
    hull.broken[w] = _NEVER
    for f in range(len(scenario.faults)):
        for i in victims(key, f, scenario):
            hull.broken[w, i, f] = window(key, f, i, duration_s, scenario)


def victims(key: np.uint64, fault: int, scenario: Scenario) -> list[int]:
    """Vehicles that a fault affects: the first ones of a random order of its own, which its share doesn't change."""
    n = scenario.swarm.num_vehicles
    order = sorted(range(n), key=lambda i: uniform(key, VICTIM, 0, i, fault))
    return order[: math.ceil(scenario.faults[fault].share * n - 1e-9)]


def window(key: np.uint64, fault: int, vehicle: int, duration_s: float, scenario: Scenario) -> tuple[int, int]:
    """First control step of a fault of a vehicle, and the end; a random onset lies within ``duration_s``."""
    settings = scenario.faults[fault]
    drawn = duration_s * uniform(key, ONSET, 0, vehicle, fault)
    control_step_s, onset = scenario.timing.control_step_s, drawn if settings.onset_s is None else settings.onset_s
    first = math.ceil(onset / control_step_s - 1e-9)
    lasts = settings.duration_s
    return first, _NEVER if lasts is None else first + math.ceil(lasts / control_step_s - 1e-9)


@compiled
def acts(w: int, i: int, fault: int, tick: int, hull: Hull) -> bool:
    """Whether a fault acts on a vehicle in the control step that starts at ``tick``."""
    return hull.broken[w, i, fault, 0] <= tick < hull.broken[w, i, fault, 1]


@compiled_inner
def weaken(w: int, tick: int, now: Columns, numbers: Actuation, hull: Hull) -> None:
    """Reduce the commanded thrust and torque of a control step by mismatch, yaw authority and faults.

    ``tick`` is that at the start of the control step.
    """
    for i in range(hull.thrust.shape[1]):
        now.tau_u[i] *= hull.thrust[w, i]
        now.tau_r[i] *= numbers.yaw_authority
    for f in range(numbers.kind.shape[0]):
        for i in range(hull.thrust.shape[1]):
            if acts(w, i, f, tick, hull):
                if numbers.kind[f] == THRUSTER:
                    now.tau_u[i] *= numbers.efficiency[f]
                elif numbers.kind[f] == YAW:
                    now.tau_r[i] *= numbers.efficiency[f]


@compiled_inline
def followed(commanded: float, initial: float, lag: Vector2) -> tuple[float, float, float]:
    """First-order lag at start, middle and end of a step: commanded + (initial - commanded) e^(-t / lag).

    Args:
        commanded: thrust [N] or torque [N m].
        initial: the actual value at the start, in the same unit.
        lag: e^(-t / lag) after half a step and after a step; 0 without a lag.
    """
    half, whole = lag
    if whole == 0.0:
        return commanded, commanded, commanded
    return initial, commanded + (initial - commanded) * half, commanded + (initial - commanded) * whole


@compiled_inner
def integrate_each(
    w: int, alive: Bool, rules: Rules, now: Columns, numbers: Actuation, hull: Hull, flow: Float64
) -> None:
    """Integrate vehicles with parameters of their own, lags and a current over one control step. Eq. 1-4, 23-24.

    ``now`` holds the commanded thrust and torque; the actual ones, ``hull.tau``, are written.
    """
    for i in range(hull.tau.shape[1]):
        if not alive[w, i]:
            continue
        p, current = own_plant(w, i, hull), (flow[w, i, 0], flow[w, i, 1])
        for _ in range(rules.steps):
            state = now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i]
            u_0, u_1, u_2 = followed(now.tau_u[i], hull.tau[w, i, 0], numbers.thrust_lag)
            r_0, r_1, r_2 = followed(now.tau_r[i], hull.tau[w, i, 1], numbers.yaw_lag)
            now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i] = advance_lagging(
                state, (u_0, r_0), (u_1, r_1), (u_2, r_2), current, rules.step_s, p
            )
            hull.tau[w, i, 0], hull.tau[w, i, 1] = u_2, r_2
        now.psi[i] = wrap(now.psi[i])
        now.cos[i], now.sin[i] = cos_sin(now.psi[i])


@compiled_inner
def is_lost_to_fault(w: int, i: int, tick: int, numbers: Actuation, hull: Hull) -> bool:
    """Whether a fault has lost a vehicle by the end of a control step, which ``tick`` counts."""
    lost = False
    for f in range(numbers.kind.shape[0]):
        lost = lost or (numbers.kind[f] == MEMBER and hull.broken[w, i, f, 0] <= tick)
    return lost
