"""The minimal work of a step, and its speed on this machine.

Kernels without any of the package's code, the same for one world (one thread) and for many (all threads).
"""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Loop = tuple[Callable[[int], object], float]
"""From numbers of repetitions and units to the work."""
PERCEPT = 98
"""Float32 numbers that a vehicle observes in each step."""
SECTORS = 21
"""Sub-sectors of a vehicle."""


class Work(NamedTuple):
    """Minimal work of one step of one world, for any code."""

    pairs: float
    """Every vehicle may detect every other: n (n - 1) / 2."""
    keeps: float
    """Comparisons with the nearest vehicle of a sub-sector: n (n - 1)."""
    sines: float
    """Sines and cosines of three Runge-Kutta stages and the new heading; the first stage has those of the last step."""
    bytes: float
    """Action read, pose and velocity read and written as float64, percept written as float32."""


def work(vehicles: int) -> Work:
    """The work of a step of 0.1 s in one world."""
    per_vehicle = 2 * 4 + 2 * 6 * 8 + 4 * PERCEPT
    pairs = vehicles * (vehicles - 1) / 2
    return Work(pairs, 2.0 * pairs, 8.0 * vehicles, float(per_vehicle * vehicles))


def least_seconds(vehicles: int, worlds: int, ceilings: Iterable[float]) -> float:
    """Minimal time of a step [s], from ceilings per second; memory transfers overlap with arithmetic."""
    need = work(vehicles)
    *arithmetic, memory = (amount / rate for amount, rate in zip(need, ceilings, strict=True))
    return worlds * max(sum(arithmetic), memory)


@numba.njit(fastmath=True)
def all_pairs(x: Float64, y: Float64, out: Float64) -> None:
    """Sum of the squared distances of all pairs [m2], as a minimal pair loop.

    The n positions come twice, one after the other, so that each vehicle meets those 1, 2, ... places on in a loop
    without gaps, which vector registers like.
    """
    n, total = x.size // 2, 0.0
    for on in range(1, n // 2 + 1):
        for i in range(n // 2 if 2 * on == n else n):
            dx, dy = x[i + on] - x[i], y[i + on] - y[i]
            total += dx * dx + dy * dy
    out[0] = total


@numba.njit
def all_keeps(distance: Float64, sector: Float64, nearest: Float64) -> None:
    """The smallest distance in each sub-sector, without a branch, since the nearer one can't be predicted."""
    nearest[:SECTORS] = math.inf
    for k in range(distance.size):
        at = np.uintp(sector[k])
        nearest[at] = distance[k] if distance[k] < nearest[at] else nearest[at]


@numba.njit(fastmath=True)
def all_sines(angle: Float64, y: Float64, out: Float64) -> None:
    """Sine plus cosine of every angle [rad], by polynomials of an angle reduced to a quarter turn, to about 1e-9."""
    for k in range(angle.size):
        quarters = math.floor(angle[k] * (2.0 / math.pi) + 0.5)
        rest = angle[k] - quarters * (0.5 * math.pi)
        z = rest * rest
        sine = rest * (1.0 - z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * (1.0 - z / 110.0)))))
        cosine = 1.0 - z / 2.0 * (1.0 - z / 12.0 * (1.0 - z / 30.0 * (1.0 - z / 56.0 * (1.0 - z / 90.0))))
        halves = math.floor(0.5 * quarters)
        turned = sine + cosine if quarters == 2.0 * halves else cosine - sine
        out[k] = turned * (1.0 - 2.0 * (halves - 2.0 * math.floor(0.5 * halves)))


@numba.njit
def all_copied(value: Float64, y: Float64, out: Float64) -> None:
    """Copy an array."""
    for k in range(value.size):
        out[k] = value[k]


KERNELS = {"pairs": all_pairs, "keeps": all_keeps, "sines": all_sines, "copy": all_copied}


def loop(kind: str, vehicles: int, worlds: int) -> Loop:
    """A loop of this kind over all worlds.

    As much as a step of these worlds: pairs of so many vehicles, and for each of them 16 distances kept, 8 angles or 50
    numbers copied. One world runs on one thread, several run on all, as the package does it.
    """
    kernel, length = KERNELS[kind], {"pairs": 2, "keeps": 16, "sines": 8, "copy": 50}[kind] * vehicles
    x, y = np.random.default_rng(0).uniform(-3.0, 3.0, (2, worlds, length))
    if kind == "keeps":
        y = np.floor((y + 3.0) / 6.0 * SECTORS)
    out = np.zeros((worlds, max(length, SECTORS)))
    amount = {"pairs": vehicles * (vehicles - 1) / 2, "sines": 2 * length, "copy": 2 * 8 * length}.get(kind, length)

    @numba.njit
    def one(w: int, times: int, x: Float64, y: Float64, out: Float64) -> None:
        for k in range(times):
            x[w, 0] = 1e-9 * k  # makes each time a new one for the compiler
            kernel(x[w], y[w], out[w])

    @numba.njit(parallel=True)
    def every(times: int, x: Float64, y: Float64, out: Float64) -> None:
        for w in numba.prange(x.shape[0]):
            one(w, times, x, y, out)

    def run(times: int) -> None:
        one(0, times, x, y, out) if worlds == 1 else every(times, x, y, out)

    return run, worlds * amount
