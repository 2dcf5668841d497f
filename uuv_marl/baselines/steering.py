"""Actions for desired velocities, and the steady velocities of actions."""

import math

from uuv_marl.baselines.policy import Limits, surge_resistance, write_action
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float32

_SHARE = 1.5
"""Largest share of a velocity error that one decision period corrects [1]; above 2 errors would grow. Found by hand: at
1 and below, swarms keep less distance, since surge follows at once, but sway only as the bow turns."""
_MOST_RATE = 8.0  # largest share of a velocity error that is corrected in a second [1/s]; found by hand, too


def velocity_gain(scenario: Scenario) -> float:
    """Force per velocity error [N s/m] of ``steer``: fast, and stable at the decision period."""
    rate = min(_SHARE / scenario.timing.decision_period_s, _MOST_RATE)
    return rate * scenario.vehicle.inertia[0]


@compiled
def steer(w_x: float, w_y: float, u: float, v: float, gain: float, limits: Limits, out: Float32) -> None:
    """Write the action that takes a vehicle to a desired velocity w [m/s]: resistance and error compensated. Eq. 22.

    The forward component of the force becomes thrust, ahead or astern; its sideways component turns the bow by the
    lever arm, since the vehicle can't push sideways. With a rudder the sideways component follows the sine of the angle
    between bow and desired velocity alone: such a hull slips sideways in every turn, and correcting that would turn it
    back.
    """
    drag = surge_resistance(math.hypot(w_x, w_y), limits)
    f_x, f_y = drag * w_x + gain * (w_x - u), drag * w_y + gain * (w_y - v)
    if limits.helm > 0.0:
        across = w_y / max(math.hypot(w_x, w_y), 1e-9)
        f_y = limits.helm * (across if w_x > 0.0 else (1.0 if w_y >= 0.0 else -1.0))
    write_action(f_x, f_y, limits, out)


@compiled
def steady_velocity(a_x: float, a_y: float, limits: Limits) -> tuple[float, float]:
    """The velocity [m/s] at which resistance equals an action's force. Inverse of Eq. 22."""
    f_x, f_y = a_x * limits.max_force, a_y * limits.max_torque / limits.lever_arm
    force = math.hypot(f_x, f_y)
    if force == 0.0:
        return 0.0, 0.0
    if limits.X_uu > 0.0:
        speed = (math.sqrt(limits.X_u * limits.X_u + 4.0 * limits.X_uu * force) - limits.X_u) / (2.0 * limits.X_uu)
    else:
        speed = force / max(limits.X_u, 1e-9)
    return speed * f_x / force, speed * f_y / force


@compiled
def full_speed(limits: Limits) -> float:
    """The speed [m/s] at which resistance equals full thrust."""
    return steady_velocity(1.0, 0.0, limits)[0]
