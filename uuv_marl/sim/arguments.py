"""What callers hand over, checked once before anything uses it: whole numbers, seeds and actions."""

import operator
import reprlib
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.types import Float32

SeedLike = int | Sequence[int | None] | NDArray[np.integer] | None


def whole_number(name: str, value: object, least: int) -> int:
    """``value`` as an int from ``least`` on.

    Raises:
        TypeError: it is no whole number; booleans are none, and 2.0 is none.
        ValueError: it is smaller than ``least``.
    """
    message = f"{name} must be a whole number from {least}, got {reprlib.repr(value)}"
    try:
        number = operator.index(cast(int, value))
    except TypeError:
        raise TypeError(message) from None
    if isinstance(value, bool):
        raise TypeError(message)
    if number < least:
        raise ValueError(message)
    return number


def world_seeds(seed: SeedLike, worlds: Sequence[int]) -> list[int | None]:
    """A seed for each of these worlds: ``seed + w``, or the given ones; None where a world's stream goes on.

    Raises:
        TypeError: a seed is no whole number.
        ValueError: a seed is negative, or there is not one for each world.
    """
    if seed is None:
        return [None] * len(worlds)
    if not isinstance(seed, list | tuple) and np.ndim(cast(ArrayLike, seed)) == 0:
        return [whole_number("seed", seed, 0) + w for w in worlds]
    seeds = cast(Sequence[int | None], seed)
    if len(seeds) != len(worlds):
        raise ValueError(f"seed must hold one seed for each of {len(worlds)} worlds, got {len(seeds)}")
    return [None if value is None else whole_number("seed", value, 0) for value in seeds]


def action_array(action: ArrayLike, shape: tuple[int, ...], whose: str) -> Float32:
    """An action as float32 of a shape; not copied where it is that already.

    Args:
        action: real numbers; whole numbers and float64 are rounded to float32.
        shape: what it must have.
        whose: begins the message, such as ``the action of uuv_3``.

    Raises:
        ValueError: it is complex, text, ragged, masked, too large or anything else that holds no real numbers, is a
            tensor that NumPy can't read, or has another shape.
    """
    try:
        array, reason = np.asarray(action), ""
    except (TypeError, ValueError, RuntimeError, OverflowError) as error:  # ragged; a tensor with a gradient, on a GPU
        array, reason = np.empty(0, object), f" ({error})"
    masked = isinstance(action, np.ma.MaskedArray)
    if masked or array.dtype.kind not in "fiub":
        text = "a masked array" if masked else reprlib.repr(action)
        raise ValueError(f"{whose} must hold real numbers, got {text}{reason}")
    if array.shape != shape:
        raise ValueError(f"{whose} must have shape {shape}, got {array.shape}")
    if array.dtype == np.float32:
        return array
    with rounding():
        return np.asarray(array, np.float32)


def rounding() -> np.errstate:
    """A block in which numbers are rounded to float32 whatever ``np.seterr`` says: to 0, or to what is infinite."""
    return np.errstate(over="ignore", under="ignore")
