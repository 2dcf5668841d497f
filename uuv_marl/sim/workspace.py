"""Working arrays that each step overwrites, one set for each thread."""

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.compiled import compiled_inline, compiled_inner, from_source
from uuv_marl.sim.tables import array_specs
from uuv_marl.types import Float64, Int32, Int64

MOST_NEARBY = 16
"""Most obstacles remembered as near a vehicle; worlds with no more than these examine all of them."""
Column = Annotated[Float64, "vehicle", "See uuv_marl.sim.vehicle."]


class Columns(NamedTuple):
    """The vehicles of a world as columns; the symbols are those of ``uuv_marl.sim.vehicle``."""

    x: Column
    y: Column
    psi: Column
    u: Column
    v: Column
    r: Column
    cos: Column
    sin: Column
    tau_u: Column
    tau_r: Column
    a_x: Annotated[Float64, "vehicle", "The decided action, on the unit disc."]
    a_y: Annotated[Float64, "vehicle", "The decided action, on the unit disc."]
    psi_0: Annotated[Float64, "vehicle", "Heading at which it was decided [rad]."]
    effort: Annotated[Float64, "vehicle", "Squared length of the action that the actuators apply."]


class Cells(NamedTuple):
    """Living vehicles sorted by cell, then by index; the first ``Grid.living`` entries are valid."""

    x: Column
    y: Column
    cos: Column
    sin: Column
    vehicle: Annotated[Int64, "vehicle", "Index of each in the swarm."]
    entry: Annotated[Int64, "vehicle", "Entry of each vehicle of the swarm, -1 if lost; its cell during sorting."]
    nearest: Annotated[Float64, "vehicle", "Squared distance of the nearest other [m2]."]
    some: Annotated[Int64, "vehicle", "Selected entries."]
    first: Annotated[Int64, "cell", "First entry of each cell, and the end."]


class Listener(NamedTuple):
    """One listener: its detection in each sub-sector (the last entry is for none) and its candidates."""

    detected_index: Annotated[Int64, "sector", "Index of the vehicle detected, -1 for none."]
    detected_squared: Annotated[Float64, "sector", "Its squared distance, before the squared range [m2]."]
    detected_ahead: Annotated[Float64, "sector", "Its distance ahead [m], 0 for none."]
    detected_abeam: Annotated[Float64, "sector", "Its distance to starboard [m], 0 for none."]
    nearest: Annotated[Float64, "sector", "Smallest squared distance so far [m2]."]
    x: Annotated[Float64, "vehicle", "Candidates gathered from a box of cells: north [m]."]
    y: Annotated[Float64, "vehicle", "East [m]."]
    vehicle: Annotated[Int64, "vehicle", "Index."]
    squared: Annotated[Float64, "vehicle", "Candidates' squared distance [m2]."]
    ahead: Annotated[Float64, "vehicle", "Distance ahead [m]."]
    abeam: Annotated[Float64, "vehicle", "Distance to starboard [m]."]
    bin: Annotated[Int32, "vehicle", "Bin of the direction."]
    sector: Annotated[Int64, "vehicle", "Sub-sector."]
    some: Annotated[Int32, "vehicle", "Selected candidates."]


class Obstacles(NamedTuple):
    """Obstacles of a world as columns, and those near each vehicle (``nearby.py``)."""

    x: Annotated[Float64, "obstacle", "Centre, north [m]."]
    y: Annotated[Float64, "obstacle", "Centre, east [m]."]
    radius: Annotated[Float64, "obstacle", "Radius [m]."]
    squared: Annotated[Float64, "obstacle", "Squared distance of the nearest vehicle from the centre [m2]."]
    ahead: Annotated[Float64, "obstacle", "Distance ahead of a vehicle, of those chosen [m]."]
    abeam: Annotated[Float64, "obstacle", "Distance to starboard [m]."]
    gap: Annotated[Float64, "obstacle", "Distance of their surfaces [m]."]
    from_x: Annotated[Float64, "obstacle", "Position of each vehicle when those near it were chosen: north [m]."]
    from_y: Annotated[Float64, "obstacle", "East [m]."]
    beyond: Annotated[
        Float64, "obstacle", "Lower bound of the distance of all others from there during the decision [m]."
    ]
    chosen: Annotated[Int64, "nearby", "Indices of those chosen, in order."]
    nearby: Annotated[Int64, "nearby", "Indices of those near each vehicle, ``MOST_NEARBY`` entries for each."]
    num_nearby: Annotated[Int64, "nearby", "How many those are, -1 if unknown."]


class ObstacleBuffers(NamedTuple):
    """``Obstacles`` in two arrays, since each that is passed on costs time; ``obstacle_columns`` names them."""

    reals: Float64
    """Shape (column, obstacle)."""
    integers: Int64
    """Shape (column, nearby)."""


class Workspace(NamedTuple):
    """Working arrays of one thread."""

    now: Columns
    cells: Cells
    listener: Listener
    obstacles: ObstacleBuffers


TABLES = (Columns, Cells, Listener, Obstacles)


WorkspaceBuffers = tuple[NDArray[Any], ...]
"""The arrays of all threads, shape (thread, column, axis): one for each axis and type, since each that is passed from
Python costs time."""

_COLUMNS = Counter((spec.axes[0], spec.dtype) for table in TABLES for spec in array_specs(table).values())
"""How many columns there are of each axis and type."""


def workspace_buffers(
    threads: int, num_vehicles: int, num_sectors: int, num_cells: int, num_obstacles: int
) -> WorkspaceBuffers:
    """A column for each array of a workspace, and a cache line between those of two threads."""
    lengths = {"vehicle": num_vehicles + 16, "sector": num_sectors + 9, "cell": num_cells + 9}
    lengths["obstacle"] = max(num_obstacles, num_vehicles) + 9
    lengths["nearby"] = max(num_obstacles, MOST_NEARBY * num_vehicles) + 9
    return tuple(np.zeros((threads, num, lengths[axis]), dtype) for (axis, dtype), num in _COLUMNS.items())


_REALS, _INTEGERS = ("obstacle", np.float64), ("nearby", np.int64)
"""Axis and type of the columns of obstacles."""


def _sources() -> Iterator[str]:
    """Source that makes each table from ``buffers`` of thread t; obstacles are made from ``ObstacleBuffers``."""
    buffers = {kind: f"buffers[{k}][t, " for k, kind in enumerate(_COLUMNS)}
    buffers |= {_REALS: "buffers.reals[", _INTEGERS: "buffers.integers["}
    taken: Counter[object] = Counter()
    for table in TABLES:
        columns: list[str] = []
        for spec in array_specs(table).values():
            kind = spec.axes[0], spec.dtype
            columns.append(f"{buffers[kind]}{taken[kind]}]")
            taken[kind] += 1
        yield f"{table.__name__}({', '.join(columns)})"


*_OWN, _OBSTACLES = _sources()
_NEARBY = ", ".join(f"buffers[{[*_COLUMNS].index(kind)}][t]" for kind in (_REALS, _INTEGERS))
_THREADS = f"Workspace({', '.join(_OWN)}, ObstacleBuffers({_NEARBY}))"
workspace: Callable[[WorkspaceBuffers, int], Workspace] = compiled_inner(
    from_source("workspace", "buffers, t", _THREADS, globals())
)
"""The arrays of thread t by name."""
obstacle_columns: Callable[[ObstacleBuffers], Obstacles] = compiled_inline(
    from_source("obstacle_columns", "buffers", _OBSTACLES, globals())
)
"""A world's obstacles by name."""
