"""The recording of an episode."""

from typing import NamedTuple

import numpy as np

from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import Scenario
from uuv_marl.tasks.groups import Groups
from uuv_marl.types import Float32, Float64, Int32


class Event(NamedTuple):
    """An event of an episode, see ``uuv_marl.replay.events``."""

    time_s: float
    kind: str
    """``collision`` of two vehicles, ``obstacle`` with an obstacle, ``near`` and ``near_obstacle`` where spacing
    falls below s_u or clearance below s_o, ``lost``, or ``arrived`` for the swarm."""
    vehicles: tuple[int, ...]
    """Indices of the vehicles; empty for the swarm."""


class Inspection(NamedTuple):
    """Detections and actions of one vehicle.

    Positions are in its body frame, x forward and y starboard [m].
    """

    detected_index: Int32
    """Index of the vehicle detected in each sub-sector, -1 for none, shape (time, sector)."""
    neighbour: Float32
    """Position of that vehicle, NaN for none, shape (time, sector, 2)."""
    echo_range: Float32
    """Range to the nearest obstacle in each active sub-sector, NaN for none, shape (time, active)."""
    echo_position: Float32
    """Position that the echo reports, NaN for none, shape (time, active, 2)."""
    action: Float32
    """The policy's action until the next sample, as shares of full surge force and yaw torque, shape (time, 2); NaN at
    the end and once the vehicle is lost."""


class Water(NamedTuple):
    """Motion of the water: a uniform drift, and stationary eddies."""

    drift: Float32
    """Velocity of the mean current and the random process together, north and east [m/s], shape (time, 2)."""
    eddies: Float64
    """Centre north, east [m] and circulation [m2/s], clockwise positive, shape (eddy, 3)."""


class Recording(NamedTuple):
    """One episode: the scenario, and all vehicles at each sample.

    There is a sample at the start and one for each decision. Frame north, east [m]; NaN once a vehicle is lost.
    """

    scenario: Scenario
    policy: str
    seed: int
    metrics: Metrics
    waypoints: Float32
    """Corners of the first group's trajectory, shape (point, 2)."""
    groups: Groups
    """Groups of vehicles with their paths, and informed vehicles."""
    obstacles: Float32
    """Centre north, east and radius, at the end, shape (obstacle, 3)."""
    traffic: Float32 | None
    """Centres of the obstacles at every sample, shape (time, obstacle, 2); None where none moves."""
    marks: Float32
    """Circles that the task draws: centre north, east and radius, 0 for none, shape (time, mark, 3)."""
    time_s: Float32
    """Shape (time,)."""
    references: Float32
    """Position of each group's l(t), shape (time, group, 2)."""
    position: Float32
    """Shape (time, vehicle, 2)."""
    heading: Float32
    """Heading in [-pi, pi), clockwise from north [rad], shape (time, vehicle)."""
    speed: Float32
    """Speed over ground [m/s], shape (time, vehicle)."""
    series: dict[str, Float32]
    """``min_spacing_m`` and ``obstacle_clearance_m``, the smallest since the sample before, ``centre_error_m``, and
    ``collisions`` so far, shape (time,) each; NaN where the value does not exist."""
    events: list[Event]
    force: Float32
    """Length of the action since the sample before, as a share of full force, shape (time, vehicle); 0 at the start."""
    spacing: Float32
    """Smallest distance to another vehicle since the sample before [m], NaN for none, shape (time, vehicle)."""
    clearance: Float32
    """Smallest distance to an obstacle's surface since the sample before [m], infinite for none, as ``spacing``."""
    inspections: dict[int, Inspection]
    """Inspections by index of the vehicle."""
    water: Water | None
    """None in still water."""

    def discs(self, k: int) -> Float32:
        """The obstacles at a sample: centre north, east and radius, shape (obstacle, 3)."""
        return self.obstacles if self.traffic is None else np.hstack([self.traffic[k], self.obstacles[:, 2:]])
