"""Checks of arguments: whole numbers, seeds and actions."""

import operator
import reprlib
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.types import Float32

SeedLike = int | Sequence[int | None] | NDArray[np.integer] | None


def whole_number(name: str, value: object, least: int) -> int:
    """``value`` as an int.

    Raises:
        TypeError: it isn't an integer; booleans and 2.0 are refused.
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
    """Seeds of these worlds: ``seed + w``, or the given ones; None where a world's generator continues.

    Raises:
        TypeError: a seed isn't an integer.
        ValueError: a seed is negative, or their number isn't that of the worlds.
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
    """An action as a float32 array, not copied if it is one already.

    Args:
        action: real numbers; integers and float64 are rounded to float32.
        shape: required shape.
        whose: subject of the error message, such as ``the action of uuv_3``.

    Raises:
        ValueError: NumPy can't read it as unmasked real numbers, or it has another shape.
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
    """Context in which rounding to float32 may underflow or overflow silently, whatever ``np.seterr`` says."""
    return np.errstate(over="ignore", under="ignore")
