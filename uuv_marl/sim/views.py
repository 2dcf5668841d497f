"""The fields of percepts by name, for compiled code: views of the flat array, which they read and write."""

from typing import Any, NamedTuple, cast

from numba import config
from numba.np import arrayobj
from numpy.lib.stride_tricks import as_strided

from uuv_marl.percept import Starts
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.types import Float32

reshaped: Any = as_strided if cast(Any, config).DISABLE_JIT else cast(Any, arrayobj).reshape_unchecked


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
    detected: Float32
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
    """Views of flat percepts (world, vehicle, entry)."""
    sectors, active = at.neighbour - at.detected, at.echo_range - at.echo
    return Fields(
        velocity=part(flat, at.velocity, 2)[0],
        yaw_rate=part(flat, at.yaw_rate, 1)[0],
        reference=part(flat, at.reference, 2)[0],
        reference_velocity=part(flat, at.reference_velocity, 2)[0],
        detected=part(flat, at.detected, sectors)[0],
        neighbour=pairs(flat, at.neighbour, sectors)[0],
        echo=part(flat, at.echo, active)[0],
        echo_range=part(flat, at.echo_range, active)[0],
        echo_position=pairs(flat, at.echo_position, active)[0],
        compass=part(flat, at.compass, 2)[0],
        link_identity=part(flat, at.link_identity, sectors)[0],
        link_velocity=pairs(flat, at.link_velocity, sectors)[0],
    )


class DisturbanceFields(NamedTuple):
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
def disturbance_fields(flat: Float32, at: Starts) -> DisturbanceFields:
    """Views of flat percepts (world, vehicle, entry)."""
    sectors = at.neighbour - at.detected
    return DisturbanceFields(
        ground_velocity=part(flat, at.ground_velocity, 2)[0],
        water_velocity=part(flat, at.water_velocity, 2)[0],
        age=part(flat, at.age, sectors)[0],
        ranged=part(flat, at.ranged, sectors)[0],
        modem_identity=part(flat, at.modem_identity, sectors)[0],
        modem_velocity=pairs(flat, at.modem_velocity, sectors)[0],
        modem_age=part(flat, at.modem_age, sectors)[0],
    )


@compiled_inline
def part(flat: Float32, start: int, num: int) -> tuple[Float32]:
    """A view (world, vehicle, num) from an entry on, empty where that is -1; in a tuple, as ``pairs``."""
    first = max(start, 0)
    return (flat[:, :, first : first + (num if start >= 0 else 0)],)


@compiled_inline
def pairs(flat: Float32, start: int, num: int) -> tuple[Float32]:
    """A view (world, vehicle, num, 2), likewise; in a tuple, since compiled code returns no array alone."""
    worlds, vehicles, _ = flat.shape
    across, down, along = flat.strides
    shape = (worlds, vehicles, num if start >= 0 else 0, 2)
    return (reshaped(flat[:, :, max(start, 0) :], shape, (across, down, 2 * along, along)),)
