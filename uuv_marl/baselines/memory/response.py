"""Lag and weakness of thrust and torque, estimated from a vehicle's own motion.

The force that acted between two decisions follows from the measured motion and the model's motion under the action. Of
the difference between the previous force and the demand, a share remains: 0 for ideal actuators, e^(-period / lag) or
more where they lag, 1 - s where only a share s of the torque acts. It is estimated by least squares on changes between
decisions, so that constant effects (a current, a drag error) cancel. Symbols of a component: f acted, y = f - asked, x
= previous f - asked, and remains = sum(dx dy) / sum(dx^2).
"""

from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

ACTED, MISSED, DUE, PRODUCTS, SQUARES = range(5)
"""Columns of ``Surroundings.response``: f, y, x, and the running sums of dx dy and dx^2."""
_FORGETTING_S = 5.0  # time constant of the sums [s]. Assumed: some turns long, and far shorter than a leg.
_REGULARIZATION = 0.01
"""Sum of squared changes of an action below which the estimate stays near 0: one of a tenth, a hundred of 1 %."""


@compiled
def follow(w: int, i: int, axis: int, asked: float, off: float, period: float, memory: Surroundings) -> None:
    """Update the estimate of a component with one period.

    ``asked`` is the action's share, ``off`` the excess of the measured motion over the model's, as a share of full
    thrust or torque.
    """
    at = memory.response[w, i, axis]
    due = at[ACTED] - asked
    d_x, d_y = due - at[DUE], off - at[MISSED]
    share = max(1.0 - period / _FORGETTING_S, 0.0)
    at[PRODUCTS] = share * at[PRODUCTS] + d_x * d_y
    at[SQUARES] = share * at[SQUARES] + d_x * d_x
    at[ACTED], at[MISSED], at[DUE] = asked + off, off, due


@compiled
def remains(w: int, i: int, axis: int, memory: Surroundings) -> float:
    """Mean share of the difference between previous force and demand that remains over a period, 0 to 1."""
    at = memory.response[w, i, axis]
    return min(max(at[PRODUCTS] / (at[SQUARES] + _REGULARIZATION), 0.0), 1.0)
