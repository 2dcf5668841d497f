"""The arrays that a world's functions work on, by name; ``Swarm`` allocates them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.cells import Cells, max_cells
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.hearing import Ear
from uuv_marl.sim.motion import Columns

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


class State(NamedTuple):
    """What a step changes."""

    eta: Float64
    """Pose (north [m], east [m], heading [rad]), shape (world, vehicle, 3)."""
    nu: Float64
    """Velocity (surge, sway [m/s], yaw rate [rad/s]), shape (world, vehicle, 3)."""
    before: Float64
    """Positions one control hold ago [m], shape (world, vehicle, 2)."""
    alive: Bool
    """False for lost vehicles, shape (world, vehicle)."""
    tick: Int64
    """Control holds since the reset, shape (world,)."""
    dwell: Int64
    """Control holds for which the swarm has rested within each arrival radius, shape (world, radius)."""


class Course(NamedTuple):
    """What a reset draws."""

    waypoints: Float64
    """Corners of the trajectory [m], padded, shape (world, point, 2)."""
    times: Float64
    """When l(t) passes them [s], shape (world, point)."""
    last: Int64
    """Index of the last corner, shape (world,)."""
    obstacles: Float64
    """Centre north, east and radius [m], padded, shape (world, obstacle, 3)."""
    num_obstacles: Int64
    """Obstacles of each world, shape (world,)."""
    losses: Int64
    """Vehicle lost at each scheduled loss, shape (world, loss)."""


class Senses(NamedTuple):
    """What was heard at the latest step, and the percept made of it."""

    heading: Float64
    """Cosine and sine of psi, shape (world, vehicle, 2)."""
    heard: Int32
    """Index of the vehicle heard in each sub-sector, -1 for none, shape (world, vehicle, sector)."""
    percept: Float32
    """Flat percepts in physical units, zero for the lost, shape (world, vehicle, entry)."""


class Facts(NamedTuple):
    """What is true of the latest step; smallest values and counts are over all its control holds. Lengths in m.

    Attributes:
        time_s: time since the reset, shape (world,).
        reference: position (north, east) and velocity of l(t), shape (world, 4).
        centre: mean position of the living, shape (world, 2).
        spacing: each vehicle's smallest distance to another, shape (world, vehicle); infinite for the lost.
        min_spacing: the smallest of them, shape (world,).
        max_spacing: largest distance between two vehicles at the end of the step, shape (world,).
        clearance: each vehicle's smallest distance to an obstacle's surface, shape (world, vehicle); negative inside.
        obstacle_clearance: each obstacle's smallest distance from its surface to a vehicle, shape (world, obstacle);
            infinite in the padding.
        contacts: contact episodes that began in this step, for each vehicle, shape (world, vehicle).
        collisions: contact episodes that began in this step, shape (world,).
        lost: vehicles lost in this step, shape (world, vehicle).
        effort: mean squared action (share of full force), shape (world, vehicle).
        saturated: share of actions at the actuators' limit, shape (world,).
        arrival_s: when the swarm arrived, by ``Rules.arrival_radii``; NaN before, shape (world, radius).
        diverged: the first vehicle whose speed the integration step let run away, -1 while there is none, (world,).
    """

    time_s: Float64
    reference: Float64
    centre: Float64
    spacing: Float64
    min_spacing: Float64
    max_spacing: Float64
    clearance: Float64
    obstacle_clearance: Float64
    contacts: Int64
    collisions: Int64
    lost: Bool
    effort: Float64
    saturated: Float64
    arrival_s: Float64
    diverged: Int64


class Rules(NamedTuple):
    """The scenario's clocks and thresholds, and the loss schedule."""

    hold_s: float
    step_s: float
    holds: int
    steps: int
    hull: float
    contact_ends: bool
    dwell_ticks: int
    spread: float
    arrival_radii: Float64
    loss_ticks: Int64
    cell_side: float


class Scratch(NamedTuple):
    """Room to work in, for each thread. A few arrays, since each that is passed from Python costs time."""

    reals: Float64
    """Columns of vehicles, shape (thread, column, vehicle)."""
    wholes: Int64
    """The same."""
    shorts: Int32
    """The same."""
    sector_reals: Float64
    """Columns of sub-sectors, shape (thread, column, sector + 1)."""
    sector_wholes: Int64
    """The same."""
    first: Int64
    """``Cells.first``, shape (thread, cell + 1)."""


def scratch(threads: int, num_vehicles: int, num_sectors: int) -> Scratch:
    """Scratch with a cache line between one thread's and the next's."""
    n, k = num_vehicles + 16, num_sectors + 9
    return Scratch(
        reals=np.zeros((threads, 24, n)),
        wholes=np.zeros((threads, 5, n), np.int64),
        shorts=np.zeros((threads, 2, n), np.int32),
        sector_reals=np.zeros((threads, 4, k)),
        sector_wholes=np.zeros((threads, 1, k), np.int64),
        first=np.zeros((threads, max_cells(num_vehicles) + 9), np.int64),
    )


@compiled
def desk(room: Scratch, t: int) -> tuple[Columns, Cells, Ear]:
    """Thread t's scratch by name."""
    a, b, c, d = room.reals[t], room.wholes[t], room.shorts[t], room.sector_reals[t]
    return (
        Columns(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13]),
        Cells(a[14], a[15], a[16], a[17], b[0], b[1], a[18], b[2], room.first[t]),
        Ear(
            room.sector_wholes[t, 0], d[0], d[1], d[2], d[3], a[19], a[20], b[3], a[21], a[22], a[23], c[0], b[4], c[1]
        ),
    )
