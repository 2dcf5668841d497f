"""Room to work in: arrays that a step fills and forgets, one set for each thread."""

from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.tables import array_specs
from uuv_marl.types import Float64, Int32, Int64

MOST_NEARBY = 16
"""Most obstacles that are remembered as near a vehicle; as many or fewer are gone through one by one."""
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
    effort: Annotated[Float64, "vehicle", "Squared length of the action as pushed."]


class Cells(NamedTuple):
    """The living, sorted by cell and within a cell by index; the first ``Grid.living`` entries count."""

    x: Column
    y: Column
    cos: Column
    sin: Column
    vehicle: Annotated[Int64, "vehicle", "Index of each in the swarm."]
    entry: Annotated[Int64, "vehicle", "Entry of each vehicle of the swarm, -1 for the lost; while sorting, its cell."]
    nearest: Annotated[Float64, "vehicle", "Squared distance of the nearest other [m2]."]
    some: Annotated[Int64, "vehicle", "Room for a choice of entries."]
    first: Annotated[Int64, "cell", "First entry of each cell, and of the end."]


class Listener(NamedTuple):
    """One listener: what it hears in each sub-sector and beyond all, and whom it listens to."""

    detected_index: Annotated[Int64, "sector", "Index of the vehicle heard, -1 for none."]
    detected_squared: Annotated[Float64, "sector", "Its squared distance, before the squared range [m2]."]
    detected_ahead: Annotated[Float64, "sector", "How far it is ahead [m], 0 for none."]
    detected_abeam: Annotated[Float64, "sector", "How far it is to starboard [m], 0 for none."]
    nearest: Annotated[Float64, "sector", "Smallest squared distance so far [m2]."]
    x: Annotated[Float64, "vehicle", "Position of those gathered from a box of cells, north [m]."]
    y: Annotated[Float64, "vehicle", "Position of those gathered from a box of cells, east [m]."]
    vehicle: Annotated[Int64, "vehicle", "Index of those gathered."]
    squared: Annotated[Float64, "vehicle", "Squared distance of those listened to [m2]."]
    ahead: Annotated[Float64, "vehicle", "How far they are ahead [m]."]
    abeam: Annotated[Float64, "vehicle", "How far they are to starboard [m]."]
    bin: Annotated[Int32, "vehicle", "Bin of their directions."]
    sector: Annotated[Int64, "vehicle", "Their sub-sectors."]
    some: Annotated[Int32, "vehicle", "Room for a choice of them."]


class Obstacles(NamedTuple):
    """The obstacles of a world as columns, and which of them are near each vehicle (``nearby.py``)."""

    x: Annotated[Float64, "obstacle", "Centre, north [m]."]
    y: Annotated[Float64, "obstacle", "Centre, east [m]."]
    radius: Annotated[Float64, "obstacle", "Radius [m]."]
    squared: Annotated[Float64, "obstacle", "Squared distance of the nearest vehicle from the centre [m2]."]
    ahead: Annotated[Float64, "obstacle", "How far those chosen are ahead of a vehicle [m]."]
    abeam: Annotated[Float64, "obstacle", "How far they are to starboard [m]."]
    gap: Annotated[Float64, "obstacle", "How far their surfaces are [m]."]
    from_x: Annotated[Float64, "obstacle", "Where each vehicle was when those near it were chosen, north [m]."]
    from_y: Annotated[Float64, "obstacle", "Where it was then, east [m]."]
    beyond: Annotated[Float64, "obstacle", "How far all others stay from there, as long as the decision stands [m]."]
    chosen: Annotated[Int64, "nearby", "Indices of those chosen, in order."]
    nearby: Annotated[Int64, "nearby", "Indices of those near each vehicle, ``MOST_NEARBY`` places for each."]
    num_nearby: Annotated[Int64, "nearby", "How many those are, -1 where they are not known."]


class ObstacleBuffers(NamedTuple):
    """``Obstacles`` in two arrays, since each that is passed on costs time; ``named`` tells them apart."""

    reals: Float64
    """Shape (column, obstacle)."""
    integers: Int64
    """Shape (column, nearby)."""


class Workspace(NamedTuple):
    """What one thread works with."""

    now: Columns
    cells: Cells
    listener: Listener
    obstacles: ObstacleBuffers


TABLES = (Columns, Cells, Listener, Obstacles)


class WorkspaceBuffers(NamedTuple):
    """The desks of all threads, in few arrays, since each that is passed from Python costs time."""

    reals: Float64
    """Shape (thread, column, vehicle)."""
    integers: Int64
    """Shape (thread, column, vehicle)."""
    shorts: Int32
    """Shape (thread, column, vehicle)."""
    sector_reals: Float64
    """Shape (thread, column, sector)."""
    sector_integers: Int64
    """Shape (thread, column, sector)."""
    cell_integers: Int64
    """Shape (thread, column, cell)."""
    obstacle_reals: Float64
    """Shape (thread, column, obstacle)."""
    nearby_integers: Int64
    """Shape (thread, column, nearby)."""


def workspace_buffers(
    threads: int, num_vehicles: int, num_sectors: int, num_cells: int, num_obstacles: int
) -> WorkspaceBuffers:
    """A column for each array of a workspace, and a cache line between one thread's and the next's."""
    lengths = {"vehicle": num_vehicles + 16, "sector": num_sectors + 9, "cell": num_cells + 9}
    lengths["obstacle"] = max(num_obstacles, num_vehicles) + 9
    lengths["nearby"] = max(num_obstacles, MOST_NEARBY * num_vehicles) + 9
    kinds = [(spec.axes, spec.dtype) for table in TABLES for spec in array_specs(table).values()]

    def columns(axis: str, dtype: type[Any]) -> NDArray[Any]:
        return np.zeros((threads, kinds.count(((axis,), dtype)), lengths[axis]), dtype)

    return WorkspaceBuffers(
        reals=columns("vehicle", np.float64),
        integers=columns("vehicle", np.int64),
        shorts=columns("vehicle", np.int32),
        sector_reals=columns("sector", np.float64),
        sector_integers=columns("sector", np.int64),
        cell_integers=columns("cell", np.int64),
        obstacle_reals=columns("obstacle", np.float64),
        nearby_integers=columns("nearby", np.int64),
    )


def _columns() -> Iterator[Any]:
    """The tables of a workspace, in place of each array the number of its column among those of its axis and type."""
    taken: Counter[object] = Counter()
    for table in TABLES:
        kinds = [(spec.axes, spec.dtype) for spec in array_specs(table).values()]
        numbers: list[int] = []
        for kind in kinds:
            numbers.append(taken[kind])
            taken[kind] += 1
        yield table(*cast(Any, numbers))


_NOW, _CELLS, _LISTENER, _OBSTACLES = _columns()


@compiled_inner
def workspace(buffers: WorkspaceBuffers, t: int) -> Workspace:
    """Thread t's scratch by name."""
    reals, integers, shorts = buffers.reals[t], buffers.integers[t], buffers.shorts[t]
    sector_reals, sector_integers, cell_integers = (
        buffers.sector_reals[t],
        buffers.sector_integers[t],
        buffers.cell_integers[t],
    )
    n, c, e = _NOW, _CELLS, _LISTENER
    return Workspace(
        Columns(
            x=reals[n.x], y=reals[n.y], psi=reals[n.psi], u=reals[n.u], v=reals[n.v], r=reals[n.r],
            cos=reals[n.cos], sin=reals[n.sin], tau_u=reals[n.tau_u], tau_r=reals[n.tau_r],
            a_x=reals[n.a_x], a_y=reals[n.a_y], psi_0=reals[n.psi_0], effort=reals[n.effort],
        ),
        Cells(
            x=reals[c.x], y=reals[c.y], cos=reals[c.cos], sin=reals[c.sin], vehicle=integers[c.vehicle],
            entry=integers[c.entry], nearest=reals[c.nearest], some=integers[c.some], first=cell_integers[c.first],
        ),
        Listener(
            detected_index=sector_integers[e.detected_index], detected_squared=sector_reals[e.detected_squared], detected_ahead=sector_reals[e.detected_ahead],
            detected_abeam=sector_reals[e.detected_abeam], nearest=sector_reals[e.nearest], x=reals[e.x], y=reals[e.y],
            vehicle=integers[e.vehicle], squared=reals[e.squared], ahead=reals[e.ahead], abeam=reals[e.abeam],
            bin=shorts[e.bin], sector=integers[e.sector], some=shorts[e.some],
        ),
        ObstacleBuffers(buffers.obstacle_reals[t], buffers.nearby_integers[t]),
    )  # fmt: skip


@compiled_inline
def obstacle_columns(buffers: ObstacleBuffers) -> Obstacles:
    """A world's obstacles by name."""
    reals, integers, o = buffers.reals, buffers.integers, _OBSTACLES
    return Obstacles(
        x=reals[o.x], y=reals[o.y], radius=reals[o.radius], squared=reals[o.squared], ahead=reals[o.ahead],
        abeam=reals[o.abeam], gap=reals[o.gap], from_x=reals[o.from_x], from_y=reals[o.from_y],
        beyond=reals[o.beyond], chosen=integers[o.chosen], nearby=integers[o.nearby], num_nearby=integers[o.num_nearby],
    )  # fmt: skip
