"""Top speed and turning of a vehicle in still water, for the list of vehicles, by the simulator's equations.

Actuator lags are included. The integration step is the longest that the vehicle accepts.
"""

import math
from collections.abc import Iterator

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario import Scenario, load_scenario, variant_names, vehicle_names
from uuv_marl.sim.disturbances.actuation import actuation, followed
from uuv_marl.sim.vehicle import STILL, State6, actuators, advance_lagging, plant

STEPS_S = (0.1, 0.05, 0.025, 0.0125, 0.00625)
"""Integration steps to try; the first is the paper's."""
SETTLE_S = 120.0
"""Time in which a vehicle from rest reaches a steady state; the slowest one needs half of it."""


def alone(vehicle: str, **overrides: object) -> Scenario:
    """A scenario of one vehicle, with the longest integration step that it accepts.

    Args:
        vehicle: a name with its variants, or a file, as for ``load_vehicle``.
        overrides: further fields of the scenario.

    Raises:
        ScenarioError: there is no such vehicle, or no step of ``STEPS_S`` is short enough.
    """
    slow = {"vehicle": vehicle, "trajectory.speed_mps": 0.1, "start.speed_max_mps": 0.1, **overrides}
    for step_s in STEPS_S:
        try:
            return load_scenario("tracking", num_vehicles=1, overrides=slow | {"timing.integration_step_s": step_s})
        except ScenarioError as error:
            if "timing.integration_step_s" not in str(error):
                raise
    raise ScenarioError(f"vehicle {vehicle} needs a shorter step than {STEPS_S[-1]} s")


def swim(scenario: Scenario, action: tuple[float, float], seconds: float, speed_mps: float = 0.0) -> Iterator[State6]:
    """States (x, y, psi, u, v, r) of a vehicle after every integration step, from straight motion without forces.

    Args:
        scenario: gives the vehicle and the step.
        action: constant shares of full thrust, and of full torque or rudder.
        seconds: duration.
        speed_mps: initial speed.
    """
    p, numbers, h = plant(scenario), actuation(scenario), scenario.timing.integration_step_s
    now: State6 = (0.0, 0.0, 0.0, speed_mps, 0.0, 0.0)
    forces = (0.0, 0.0)
    for _ in range(round(seconds / h)):
        thrust, steer = actuators(*action, now[5], p)
        u_0, u_1, u_2 = followed(thrust, forces[0], numbers.thrust_lag)
        r_0, r_1, r_2 = followed(steer, forces[1], numbers.yaw_lag)
        now = advance_lagging(now, (u_0, r_0), (u_1, r_1), (u_2, r_2), STILL, h, p)
        forces = u_2, r_2
        yield now


def turn(scenario: Scenario) -> tuple[float, float, float]:
    """Top speed [m/s], and rate [deg/s] and radius [m] of the tightest turn."""
    tightest = (1.0, 1.0) if scenario.actuators.kind == "rudder" else (0.0, 1.0)
    top, turning = last(scenario, (1.0, 0.0), SETTLE_S), last(scenario, tightest, SETTLE_S)
    return top[3], math.degrees(turning[5]), math.hypot(turning[3], turning[4]) / abs(turning[5])


def last(scenario: Scenario, action: tuple[float, float], seconds: float) -> State6:
    """The state at the end of ``swim``."""
    *_, last = swim(scenario, action, seconds)
    return last


def every() -> list[str]:
    """All vehicles of the catalogue, each followed by its variants."""
    return [name for one in vehicle_names() for name in (one, *(f"{one}+{variant}" for variant in variant_names(one)))]
