"""How thrust and torque follow a vehicle's actions, as it sees in its own motion.

What acted between two decisions follows from the motion that was measured and the motion that the model makes of the
action. Of the difference between what had acted and what is asked, a share remains: 0 where all comes at once,
e^(-period / lag) or more where actuators lag, 1 - s where only a share s of the torque comes. It is estimated by least
squares on what changes from one decision to the next, so that what is constant (a current, drag that is off) does not
count. Symbols of a component: f acted, y = f - asked, x = f before - asked, and remains = sum(dx dy) / sum(dx^2).
"""

from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

ACTED, MISSED, DUE, PRODUCTS, SQUARES = range(5)
"""Columns of ``Surroundings.response``: f, y, x, and the running sums of dx dy and dx^2."""
_KEPT_S = 5.0
"""Time constant of the sums [s]. Assumed: some turns long, and far shorter than a leg."""
_NOTHING = 0.01
"""Squared changes of an action, summed, that are too small to say anything: one of a tenth, a hundred of 1 %."""


@compiled
def follow(w: int, i: int, axis: int, asked: float, off: float, period: float, memory: Surroundings) -> None:
    """Take what one period showed of a component into the estimate.

    ``asked`` is the action's share; ``off`` by how much the motion was more than the model makes of it, as a share of
    full thrust or torque.
    """
    at = memory.response[w, i, axis]
    due = at[ACTED] - asked
    d_x, d_y = due - at[DUE], off - at[MISSED]
    share = max(1.0 - period / _KEPT_S, 0.0)
    at[PRODUCTS] = share * at[PRODUCTS] + d_x * d_y
    at[SQUARES] = share * at[SQUARES] + d_x * d_x
    at[ACTED], at[MISSED], at[DUE] = asked + off, off, due


@compiled
def remains(w: int, i: int, axis: int, memory: Surroundings) -> float:
    """Share of the difference between what acted and what is asked that remains on the mean over a period, 0 to 1."""
    at = memory.response[w, i, axis]
    return min(max(at[PRODUCTS] / (at[SQUARES] + _NOTHING), 0.0), 1.0)
