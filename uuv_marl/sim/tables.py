"""Declarations of arrays in NamedTuples: type, axes and meaning beside the name.

``Annotated[Float64, "world vehicle 3", "Pose."]`` is an array of type float64 and shape (world, vehicle, 3). Memory,
documentation and checks follow from that.
"""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

C = TypeVar("C", bound=type)
T = TypeVar("T")


class Bounds(NamedTuple):
    """Allowed values: finite, from ``low`` to the last index of ``axis`` plus ``beyond``."""

    low: int
    axis: str = ""
    beyond: int = 0


class ArraySpec(NamedTuple):
    """Declaration of one array of a table."""

    dtype: type[np.generic]
    axes: tuple[str, ...]
    """Axes, each a name or a number."""
    meaning: str
    bounds: Bounds | None

    def shape(self, sizes: Mapping[str, int]) -> tuple[int, ...]:
        """Shape of the array, with axes of these lengths."""
        return tuple(int(axis) if axis.isdigit() else sizes[axis] for axis in self.axes)


@functools.cache
def array_specs(table: type[Any]) -> dict[str, ArraySpec]:
    """The arrays of a table by name, in order."""
    specs: dict[str, ArraySpec] = {}
    for name, hint in get_type_hints(table, include_extras=True).items():
        axes, meaning, *bounds = hint.__metadata__
        dtype = hint.__origin__
        while dtypes := get_args(dtype):  # the innermost last argument, also in NumPy 2.5's NDArray
            dtype = dtypes[-1]
        specs[name] = ArraySpec(dtype, tuple(axes.split()), meaning, bounds[0] if bounds else None)
    return specs


def allocate(table: type[T], sizes: Mapping[str, int]) -> T:
    """A table of zeros, its axes of these lengths."""
    return table(**{name: np.zeros(spec.shape(sizes), spec.dtype) for name, spec in array_specs(table).items()})


def described(table: C) -> C:
    """Add each array's meaning, shape and type to the docstring of a table."""
    lines = ["Attributes:"]
    for name, spec in array_specs(table).items():
        shape = ", ".join(spec.axes) + "," * (len(spec.axes) == 1)
        lines.append(f"    {name}: {spec.meaning} Shape ({shape}), {spec.dtype.__name__}.")
    table.__doc__ = "\n    ".join([f"{(table.__doc__ or '').strip()}\n", *lines])
    table.__new__.__annotations__ = {}  # so that help() shows only names in the signature
    return table


def check(table: type[Any], arrays: Mapping[str, NDArray[Any]], sizes: Mapping[str, int]) -> None:
    """Raise ValueError if a value that compiled code uses unchecked is out of its ``Bounds``."""
    for name, spec in array_specs(table).items():
        if spec.bounds is None:
            continue
        low, axis, beyond = spec.bounds
        high = sizes[axis] - 1 + beyond if axis else float(np.finfo(np.float64).max)
        if not ((arrays[name] >= low) & (arrays[name] <= high)).all():
            raise ValueError(f"{name} must lie within {low} and {high}, got {np.unique(arrays[name])[[0, -1]]}")
