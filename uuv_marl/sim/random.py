"""Counter-based random numbers: a function of episode key, purpose, time, vehicle and slot, without a state.

So a disturbance never changes another's numbers, and batch size, threads and API don't matter. The generator is
Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11): the episode's key is its key, the
four others are its counter. The logarithm is implemented here, since a C library's may differ in the last bit.

Each world's NumPy generator, which samples its episodes, is stored in snapshots as an array.
"""

import hashlib
import math
from collections.abc import Sequence

import numpy as np

from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import UInt64

Block = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

# Typed, since Numba turns the sum of a signed and an unsigned 64-bit number into a float.
_LOW, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_HIGH_SHIFT, _LOW_SHIFT, _HIGH_BITS = np.uint64(5), np.uint64(6), np.uint64(26)

_WORD = 2**64 - 1

_FRACTION, _ONE_HALF = np.int64((1 << 52) - 1), np.int64(1022 << 52)
"""Bits of a number's fraction, and those of 0.5."""
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_L1, _L2, _L3 = 6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01
_L4, _L5 = 2.222219843214978396e-01, 1.818357216161805012e-01
_L6, _L7 = 1.531383769920937332e-01, 1.479819860511658591e-01

DIRECTION, GUST, EDDY_PLACE = 1, 2, 3
MISMATCH, VICTIM, ONSET = 10, 11, 12
BEARING_RANGE, FACTOR, DETECTION, SILENCE, FALSE_ECHO, FALSE_PLACE = 20, 21, 22, 23, 24, 25
DRIFT, COMPASS = 30, 31
MESSAGE, SLOT = 40, 41
MOVER, MOVER_DIRECTION = 50, 51
"""Purposes of an episode's random numbers, one for each draw."""


def packed(streams: Sequence[np.random.Generator | None]) -> UInt64:
    """States of NumPy's default generators (PCG64), shape (stream, 6); zeros for None."""
    rows = np.zeros((len(streams), 6), np.uint64)
    for row, stream in zip(rows, streams, strict=True):
        if stream is not None:
            whole = stream.bit_generator.state
            state, inc = whole["state"]["state"], whole["state"]["inc"]
            row[:] = (state & _WORD, state >> 64, inc & _WORD, inc >> 64, whole["has_uint32"], whole["uinteger"])
    return rows


def unpacked(rows: UInt64, num: int) -> list[np.random.Generator | None]:
    """``num`` generators that continue from ``packed`` states. Raises ValueError if the array doesn't fit."""
    if rows.shape != (num, 6) or rows.dtype != np.uint64:
        raise ValueError(f"streams must be uint64 of shape ({num}, 6), got {rows.dtype} of shape {rows.shape}")
    streams: list[np.random.Generator | None] = []
    for low, high, inc_low, inc_high, has_half, half in rows.tolist():
        stream = np.random.default_rng(0)
        stream.bit_generator.state = {
            "bit_generator": "PCG64",
            "state": {"state": low | high << 64, "inc": inc_low | inc_high << 64},
            "has_uint32": has_half,
            "uinteger": half,
        }
        streams.append(stream if inc_low else None)  # a PCG's increment is odd
    return streams


def episode_key(stream: np.random.Generator) -> np.uint64:
    """Key of the episode that a reset samples from this generator: a hash of its state before."""
    return np.uint64(int.from_bytes(hashlib.blake2b(packed([stream]).tobytes(), digest_size=8).digest(), "little"))


@compiled_inline
def philox(key: np.uint64, c_0: np.uint64, c_1: np.uint64, c_2: np.uint64, c_3: np.uint64) -> Block:
    """Four random words of 32 bits from a key and a counter of four such words."""
    k_0, k_1 = key & _LOW, key >> _HALF
    for _ in range(10):
        p_0, p_1 = _MULTIPLIER_0 * c_0, _MULTIPLIER_1 * c_2
        c_0, c_1, c_2, c_3 = (p_1 >> _HALF) ^ c_1 ^ k_0, p_1 & _LOW, (p_0 >> _HALF) ^ c_3 ^ k_1, p_0 & _LOW
        k_0, k_1 = (k_0 + _WEYL_0) & _LOW, (k_1 + _WEYL_1) & _LOW
    return c_0, c_1, c_2, c_3


@compiled_inline
def uniforms(key: np.uint64, purpose: int, time: int, vehicle: int, slot: int) -> tuple[float, float]:
    """Two independent numbers, uniform in [0, 1), multiples of 2^-53.

    Args:
        key: key of the episode (``Swarm.keys``).
        purpose: one of the constants above.
        time: control step, reading or decision, below 2^32.
        vehicle: index of the vehicle.
        slot: index among the vehicle's pairs at this time.
    """
    w_0, w_1, w_2, w_3 = philox(
        key, np.uint64(purpose) & _LOW, np.uint64(time) & _LOW, np.uint64(vehicle) & _LOW, np.uint64(slot) & _LOW
    )
    first = ((w_0 >> _HIGH_SHIFT) << _HIGH_BITS) | (w_1 >> _LOW_SHIFT)
    second = ((w_2 >> _HIGH_SHIFT) << _HIGH_BITS) | (w_3 >> _LOW_SHIFT)
    return np.float64(first) * 2.0**-53, np.float64(second) * 2.0**-53


@compiled_inline
def uniform(key: np.uint64, purpose: int, time: int, vehicle: int, slot: int) -> float:
    """A number uniform in [0, 1), the first of ``uniforms``."""
    return uniforms(key, purpose, time, vehicle, slot)[0]


@compiled_inline
def normals(key: np.uint64, purpose: int, time: int, vehicle: int, slot: int) -> tuple[float, float]:
    """Two independent standard normal numbers (Box and Muller 1958); arguments as for ``uniforms``."""
    first, second = uniforms(key, purpose, time, vehicle, slot)
    radius = math.sqrt(-2.0 * log(1.0 - first))
    c, s = cos_sin(2.0 * math.pi * second)
    return radius * c, radius * s


@compiled_inline
def normal(key: np.uint64, purpose: int, time: int, vehicle: int, slot: int) -> float:
    """A standard normal number; arguments as for ``uniforms``."""
    return normals(key, purpose, time, vehicle, slot)[0]


@compiled_inline
def log(x: float) -> float:
    """Natural logarithm of a positive, finite number, within 1 ulp: the method of Sun's fdlibm (e_log.c)."""
    tiny = x < 2.0**-1022
    bits = np.float64(x * 2.0**54 if tiny else x).view(np.int64)
    share, power = np.int64((bits & _FRACTION) | _ONE_HALF).view(np.float64), (bits >> 52) - (1076 if tiny else 1022)
    small = share < math.sqrt(0.5)
    f, k = (2.0 * share if small else share) - 1.0, np.float64(power - 1 if small else power)
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    rest = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7))) + w * (_L2 + w * (_L4 + w * _L6))
    half = 0.5 * f * f
    return k * _LN2_HIGH - ((half - (s * (half + rest) + k * _LN2_LOW)) - f)
