"""The fields of percepts by name, for compiled code: views of the flat array, which they read and write."""

from typing import Any, NamedTuple, cast

from numba import config
from numba.np import arrayobj
from numpy.lib.stride_tricks import as_strided

from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.types import Float32

reshaped: Any = as_strided if cast(Any, config).DISABLE_JIT else cast(Any, arrayobj).reshape_unchecked
Starts = tuple[int, ...]
"""Where each field starts in a flat percept, -1 where it is absent: ``PerceptLayout.offsets``."""


class Fields(NamedTuple):
    """All that there can be (``uuv_marl.percept.percept_table``), in order; empty where a channel is not granted.

    Each has shape (world, vehicle, ...) and the physical unit of its row in the table.
    """

    velocity: Float32
    """Shape (world, vehicle, 2)."""
    yaw_rate: Float32
    """Shape (world, vehicle, 1)."""
    reference: Float32
    """Shape (world, vehicle, 2)."""
    reference_velocity: Float32
    """Shape (world, vehicle, 2)."""
    heard: Float32
    """Shape (world, vehicle, sector)."""
    neighbour: Float32
    """Shape (world, vehicle, sector, 2)."""
    echo: Float32
    """Shape (world, vehicle, active)."""
    echo_range: Float32
    """Shape (world, vehicle, active)."""
    echo_position: Float32
    """Shape (world, vehicle, active, 2)."""
    compass: Float32
    """Shape (world, vehicle, 2), or (world, vehicle, 0)."""
    link_identity: Float32
    """Shape (world, vehicle, sector), or (world, vehicle, 0)."""
    link_velocity: Float32
    """Shape (world, vehicle, sector, 2), or (world, vehicle, 0, 2)."""


@compiled_inline
def fields(flat: Float32, at: Starts) -> Fields:
    """Views of flat percepts (world, vehicle, entry). The order is the table's: tests/test_tables.py."""
    sectors, active = at[5] - at[4], at[7] - at[6]
    compass, directions = max(at[9], 0), 2 if at[9] >= 0 else 0
    link, linked = max(at[10], 0), sectors if at[10] >= 0 else 0
    return Fields(
        velocity=flat[:, :, at[0] : at[0] + 2],
        yaw_rate=flat[:, :, at[1] : at[1] + 1],
        reference=flat[:, :, at[2] : at[2] + 2],
        reference_velocity=flat[:, :, at[3] : at[3] + 2],
        heard=flat[:, :, at[4] : at[4] + sectors],
        neighbour=pairs(flat, at[5], sectors)[0],
        echo=flat[:, :, at[6] : at[6] + active],
        echo_range=flat[:, :, at[7] : at[7] + active],
        echo_position=pairs(flat, at[8], active)[0],
        compass=flat[:, :, compass : compass + directions],
        link_identity=flat[:, :, link : link + linked],
        link_velocity=pairs(flat, link + linked, linked)[0],
    )


class SeaFields(NamedTuple):
    """Fields that a disturbed world can grant beyond ``Fields``, in the table's order; empty where not granted."""

    ground_velocity: Float32
    """Shape (world, vehicle, 2)."""
    water_velocity: Float32
    """Shape (world, vehicle, 2)."""
    age: Float32
    """Shape (world, vehicle, sector)."""
    ranged: Float32
    """Shape (world, vehicle, sector)."""
    modem_identity: Float32
    """Shape (world, vehicle, sector)."""
    modem_velocity: Float32
    """Shape (world, vehicle, sector, 2)."""
    modem_age: Float32
    """Shape (world, vehicle, sector)."""


@compiled_inline
def sea_fields(flat: Float32, at: Starts) -> SeaFields:
    """Views of flat percepts (world, vehicle, entry). The order is the table's: tests/test_tables.py."""
    sectors = at[5] - at[4]
    return SeaFields(
        ground_velocity=part(flat, at[12], 2)[0],
        water_velocity=part(flat, at[13], 2)[0],
        age=part(flat, at[14], sectors)[0],
        ranged=part(flat, at[15], sectors)[0],
        modem_identity=part(flat, at[16], sectors)[0],
        modem_velocity=pairs(flat, max(at[17], 0), sectors if at[17] >= 0 else 0)[0],
        modem_age=part(flat, at[18], sectors)[0],
    )


@compiled_inline
def part(flat: Float32, start: int, num: int) -> tuple[Float32]:
    """A view (world, vehicle, num) from an entry on, empty where that is -1."""
    first = max(start, 0)
    return (flat[:, :, first : first + (num if start >= 0 else 0)],)


@compiled_inline
def pairs(flat: Float32, start: int, num: int) -> tuple[Float32]:
    """A view (world, vehicle, num, 2) from an entry on, in a tuple, since compiled code returns no array alone."""
    worlds, vehicles, _ = flat.shape
    across, down, along = flat.strides
    return (reshaped(flat[:, :, start:], (worlds, vehicles, num, 2), (across, down, 2 * along, along)),)
