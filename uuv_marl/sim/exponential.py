"""The exponential function with the same bits on every machine, unlike a C library's."""

import math

import numpy as np

from uuv_marl.sim.compiled import compiled_inline

_LN2_HIGH, _LN2_LOW, _ONE_OVER_LN2 = 6.93147180369123816490e-01, 1.90821492927058770002e-10, 1.44269504088896338700
_P1, _P2, _P3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
_P4, _P5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08


@compiled_inline
def exp(x: float) -> float:
    """e^x within 1 ulp, by the method of Sun's fdlibm (e_exp.c); 0 below x = -700, constant above x = 700."""
    bounded = min(max(x, -700.0), 700.0)
    power = math.floor(bounded * _ONE_OVER_LN2 + 0.5)
    high, low = bounded - power * _LN2_HIGH, power * _LN2_LOW
    rest = high - low
    z = rest * rest
    c = rest - z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + z * _P5))))
    two_to_power = np.int64((np.int64(power) + 1023) << 52).view(np.float64)
    return (1.0 - ((low - (rest * c) / (2.0 - c)) - high)) * two_to_power if x >= -700.0 else 0.0


@compiled_inline
def decay_mean(x: float) -> float:
    """(1 - e^-x) / x for x >= 0: the mean of e^-t over t from 0 to x; 1 at 0."""
    series = 1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))  # the next term is below 1e-17
    small = x < 1e-3  # where the difference would lose digits
    return series if small else (1.0 - exp(-x)) / (1.0 if small else x)
