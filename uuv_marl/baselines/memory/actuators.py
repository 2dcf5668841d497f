"""Response of a vehicle's actuators, identified from its own motion, and the demand that compensates it.

A component is thrust, or torque with the inner loop's. It follows the demand g with a lag T and an effectiveness s: F'
= (s g - F) / T, all as shares of full thrust or torque. With e = exp(-period / T), and m for the mean of exp(-t / T)
over a period, the means f of F over consecutive periods obey

    f_k = e f_(k-1) + s (1 - m) g_k + s (m - e) g_(k-1).

The three coefficients follow from recursive least squares with exponential forgetting (Ljung, System identification,
1999, section 11.2) on changes between decisions, so that constant effects (a current, a drag error) cancel. A
regularization keeps them at those of ideal actuators until the motion shows otherwise.
"""

import math

from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.sim.compiled import compiled

ASKED, ACTED, ASKED_BEFORE, ACTED_BEFORE, SQUARES, PRODUCTS = 0, 1, 2, 3, 4, 10
"""Columns of ``Surroundings.actuators``: g and f of the latest period and of that before, six sums of products of the
regressors (f_(k-1), g_k, g_(k-1)), and three of the regressors with f_k - g_k."""
_FORGETTING_S = 5.0  # time constant of the sums [s]. Assumed: some turns long, and far shorter than a leg.
_REGULARIZATION = 1e-3
"""Sum of squared changes below which the estimate stays at ideal actuators (3 % of full thrust or torque)."""
_MAX_DECAY = 0.97
"""Largest e. Assumed: a lag of 3 s at a decision every 0.1 s, more than any actuator of the catalogue has."""
_FULL_SHORTFALL = 0.3
"""Immediate shortfall at which the correction has full weight [1]. Assumed: in a current 0.97 to 1.05 of a demand acts
at once, on a tuning field, and 0.63 with a lag of 0.1 s."""
_LEAST, _MOST = 0.05, 1.5  # bounds of s. Assumed: an effectiveness of 5 % can't be compensated.


@compiled
def identify(w: int, i: int, axis: int, asked: float, off: float, period: float, memory: Surroundings) -> None:
    """Update the estimate of a component with one period.

    ``asked`` is the demand including the inner loop's, ``off`` the excess of the measured motion over the model's, both
    as shares of full thrust or torque.
    """
    at = memory.actuators[w, i, axis]
    f, g, h = at[ACTED] - at[ACTED_BEFORE], asked - at[ASKED], at[ASKED] - at[ASKED_BEFORE]
    y = off - (at[ACTED] - at[ASKED])
    share = max(1.0 - period / _FORGETTING_S, 0.0)
    products = (f * f, f * g, f * h, g * g, g * h, h * h, f * y, g * y, h * y)
    for k in range(len(products)):
        at[SQUARES + k] = share * at[SQUARES + k] + products[k]
    at[ACTED_BEFORE], at[ASKED_BEFORE] = at[ACTED], at[ASKED]
    at[ACTED], at[ASKED] = asked + off, asked


@compiled
def answer(w: int, i: int, axis: int, memory: Surroundings) -> tuple[float, float, float]:
    """Remaining share of a difference after a period, effectiveness, and its immediate part: at first 0, 1 and 1."""
    at = memory.actuators[w, i, axis]
    d_0 = at[SQUARES] + _REGULARIZATION  # L D L' of the sums
    l_1, l_2 = at[SQUARES + 1] / d_0, at[SQUARES + 2] / d_0
    d_1 = at[SQUARES + 3] + _REGULARIZATION - l_1 * at[SQUARES + 1]
    between = at[SQUARES + 4] - l_1 * at[SQUARES + 2]
    l_3 = between / d_1
    d_2 = at[SQUARES + 5] + _REGULARIZATION - l_2 * at[SQUARES + 2] - l_3 * between
    y_1 = at[PRODUCTS + 1] - l_1 * at[PRODUCTS]
    y_2 = at[PRODUCTS + 2] - l_2 * at[PRODUCTS] - l_3 * y_1
    c_2 = y_2 / d_2
    c_1 = (y_1 - between * c_2) / d_1
    e = (at[PRODUCTS] - at[SQUARES + 1] * c_1 - at[SQUARES + 2] * c_2) / d_0
    e = min(max(e, 0.0), _MAX_DECAY)
    return e, min(max((1.0 + c_1 + c_2) / (1.0 - e), _LEAST), _MOST), 1.0 + c_1


@compiled
def lead(w: int, i: int, axis: int, wanted: float, share: float, memory: Surroundings) -> float:
    """Demand on a component so that ``wanted`` acts at the end of the period: the response, inverted.

    The correction is weighted by the immediate shortfall, since a slowly changing current looks like a lag. ``wanted``
    is a share including the inner loop's; ``share`` is the part of the correction that is applied, from 0 to 1.
    """
    at = memory.actuators[w, i, axis]
    e, s, at_once = answer(w, i, axis, memory)
    m = (1.0 + 4.0 * math.sqrt(e) + e) / 6.0  # Simpson's rule for the mean of exp(-t / T)
    acts = s * at[ASKED] + (at[ACTED] - s * at[ASKED]) * e / m
    asked = (wanted - e * acts) / max(s * (1.0 - e), 1.0 - _MAX_DECAY)
    counts = share * min(max(1.0 - at_once, 0.0) / _FULL_SHORTFALL, 1.0)
    return wanted + counts * (min(max(asked, -1.0), 1.0) - wanted)
