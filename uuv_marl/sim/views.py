"""Compiled functions that view a flat percept's fields by name, to read and write them."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import config
from numba.np import arrayobj
from numpy.lib.stride_tricks import as_strided

from uuv_marl.percept import FIELDS, NUM_RECENT, DisturbanceFields, Fields, Starts
from uuv_marl.sim.compiled import compiled_inline, from_source
from uuv_marl.types import Float32

T = TypeVar("T")
reshaped: Any = as_strided if cast(Any, config).DISABLE_JIT else cast(Any, arrayobj).reshape_unchecked


@compiled_inline
def part(flat: Float32, start: int, num: int) -> tuple[Float32]:
    """A view (world, vehicle, num) from an entry on, empty where that is -1; in a tuple, as ``vectors``."""
    first = max(start, 0)
    return (flat[:, :, first : first + (num if start >= 0 else 0)],)


@compiled_inline
def vectors(flat: Float32, start: int, num: int, size: int) -> tuple[Float32]:
    """A view (world, vehicle, num, size), likewise; in a tuple, since compiled code can't return an array alone."""
    worlds, vehicles, _ = flat.shape
    across, down, along = flat.strides
    shape = (worlds, vehicles, num if start >= 0 else 0, size)
    return (reshaped(flat[:, :, max(start, 0) :], shape, (across, down, size * along, along)),)


_AT = {name: f"at[{k}]" for k, name in enumerate(FIELDS)}
_NUM = {
    "1": "1", "2": "2", "sector": f"{_AT['neighbour']} - {_AT['detected']}",
    "active": f"{_AT['echo_range']} - {_AT['echo']}", "recent": str(NUM_RECENT),
    "entry": f"({_AT['message_age']} - {_AT['message']}) // {NUM_RECENT}",
}  # fmt: skip


def _views(name: str, table: type[T]) -> Callable[[Float32, Starts], T]:
    """Compile a function that views the fields of flat percepts, shape (world, vehicle, entry), as a table."""
    axes = [(field, *FIELDS[field].axes.split()) for field in table.__annotations__]
    views = (
        f"{'vectors' if sizes else 'part'}(flat, {', '.join([_AT[field], _NUM[axis], *[_NUM[n] for n in sizes]])})[0]"
        for field, axis, *sizes in axes
    )
    return compiled_inline(from_source(name, "flat, at", f"{table.__name__}({', '.join(views)})", globals()))


fields = _views("fields", Fields)
disturbance_fields = _views("disturbance_fields", DisturbanceFields)
