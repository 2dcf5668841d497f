"""Desired forces as thrust and rudder, for hulls that are steered by the flow past a fin."""

import math
from typing import NamedTuple

from uuv_marl.percept import Starts
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.vehicle_checks import top_speed
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32

STEERAGE = 0.5
"""Steerage way over cruise speed: a rudder then gives a quarter of its moment. Assumed: few hulls steer slower."""


class Rudder(NamedTuple):
    """Steering data of a vehicle with a rudder, in SI units."""

    sideways: float  # sideways force at full second action: full torque over the lever arm [N]
    ahead: float  # full thrust ahead [N]
    astern: float  # full thrust astern over that ahead [1]
    lever_arm: float
    full_moment: float  # yaw moment of the rudder at its limit, over the squared flow [kg]
    steerage: float  # speed below which the rudder has little flow [m/s]
    holding_thrust: float  # thrust that holds that speed, over full thrust [1]

    @staticmethod
    def of(scenario: Scenario) -> "Rudder | None":
        """Data of a scenario's vehicle; None without a rudder."""
        hull, actuators = scenario.vehicle, scenario.actuators
        if actuators.kind != "rudder":
            return None
        speed = STEERAGE * (hull.cruise_mps or top_speed(hull, actuators))
        return Rudder(
            sideways=actuators.max_torque_nm / actuators.lever_arm_m,
            ahead=actuators.max_force_n,
            astern=actuators.astern_n / actuators.max_force_n,
            lever_arm=actuators.lever_arm_m,
            full_moment=actuators.rudder[1] * math.radians(actuators.rudder_max_deg),
            steerage=speed,
            holding_thrust=(hull.X_u + hull.X_uu * speed) * speed / actuators.max_force_n,
        )


@compiled
def steer_by_rudder(flat: Float32, at: Starts, fin: Rudder, action: Float32) -> None:
    """Turn desired forces into thrust and rudder, in place.

    The desired yaw moment is the force's component to starboard times the lever arm (Eq. 22). A force astern counts in
    full: the bow turns to it, since the vehicle can't follow it backwards. The rudder's angle is that moment over the
    rudder's largest in the present flow, taken as at least steerage way. Thrust is the force's component ahead, limited
    astern; below steerage way it is at least what holds that speed, as a vehicle without flow would not turn at all.
    ``action``, shape (world, vehicle, 2), holds shares of full thrust and torque, and then of full thrust and rudder.
    """
    see = fields(flat, at)
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            f_x, f_y = action[w, i, 0] * fin.ahead, action[w, i, 1] * fin.sideways
            if f_x < 0.0:
                f_y = math.hypot(f_x, f_y) * (1.0 if f_y >= 0.0 else -1.0)
            u = float(see.velocity[w, i, 0])
            flow = max(u, fin.steerage)
            share = f_y * fin.lever_arm / (fin.full_moment * flow * flow)
            thrust = max(float(action[w, i, 0]), -fin.astern)
            action[w, i, 0] = max(thrust, fin.holding_thrust) if u < fin.steerage else thrust
            action[w, i, 1] = min(max(share, -1.0), 1.0)
