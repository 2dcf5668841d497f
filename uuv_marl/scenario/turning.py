"""The steady turn of a vehicle with a rudder."""

import math
from functools import lru_cache

import numpy as np

from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.vehicle_checks import inertia_matrix, resistance

_STEPS, _STEP_S, _SMALL = 600, 0.2, 1e-6


@lru_cache(maxsize=256)
def turning_radius(vehicle: Vehicle, actuators: Actuators, speed_mps: float) -> float:
    """Radius [m] of the turn at full rudder and constant surge speed [m/s]; 0 for a vehicle without rudder.

    Sway and yaw of Eq. 2 with lift and rudder, from straight motion to the steady state. Time steps are implicit, so
    that two minutes take few of them, however stiff the hull.
    """
    if actuators.kind == "force_torque":
        return 0.0
    inverse, motion = np.linalg.inv(inertia_matrix(vehicle)), resistance(vehicle)
    fin = np.array([0.0, *actuators.rudder]) * math.radians(actuators.rudder_max_deg) * speed_mps**2

    def rate(state: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        nu = np.array([speed_mps, *state])
        return (inverse @ (fin + motion @ np.outer(nu, [1.0, *nu, *np.abs(nu)]).reshape(21)))[1:]

    state = np.zeros(2)
    for _ in range(_STEPS):
        now = rate(state)
        slope = np.stack([(rate(state + step) - now) / _SMALL for step in _SMALL * np.eye(2)], axis=1)
        state = state + np.linalg.solve(np.eye(2) / _STEP_S - slope, now)
    return math.hypot(speed_mps, state[0]) / abs(state[1])
