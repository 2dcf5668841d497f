"""A recording: one episode as it is replayed in a browser and filmed."""

from typing import NamedTuple

import numpy as np

from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import Scenario
from uuv_marl.tasks.groups import Groups
from uuv_marl.types import Float32, Float64, Int32


class Event(NamedTuple):
    """Something that happened at a sample; ``uuv_marl.replay.events`` says when."""

    time_s: float
    kind: str
    """``collision`` of two vehicles, ``obstacle`` for a vehicle that hit one, ``near`` and ``near_obstacle`` where
    spacing fell below s_u or clearance below s_o, ``lost``, or ``arrived`` for the whole swarm."""
    vehicles: tuple[int, ...]
    """Whom it concerns; empty for the whole swarm, and where a saved trace does not say."""


class Inspection(NamedTuple):
    """What one vehicle's sonar told it, and what it did.

    Positions are in its body frame, x forward and y starboard [m].
    """

    detected_index: Int32
    """Index of the vehicle heard in each sub-sector, -1 for none, shape (time, sector)."""
    neighbour: Float32
    """Position of that vehicle, NaN for none, shape (time, sector, 2)."""
    echo_range: Float32
    """Range to the nearest obstacle in each active sub-sector, NaN for none, shape (time, active)."""
    echo_position: Float32
    """Position that the echo reports, NaN for none, shape (time, active, 2)."""
    action: Float32
    """Shares of full surge force and yaw torque that the policy asked for until the next sample, shape (time, 2); NaN
    at the end and once the vehicle is lost."""


class Water(NamedTuple):
    """How the water moved: everywhere by its drift, and around eddies that stand still."""

    drift: Float32
    """Velocity of mean and process together, north and east [m/s], shape (time, 2)."""
    eddies: Float64
    """Centre north, east [m] and circulation [m2/s], clockwise positive, shape (eddy, 3)."""


class Recording(NamedTuple):
    """One episode: what was simulated, and where everybody was at each sample.

    There is a sample at the start and one for each decision; a saved trace has one every 0.5 s. Frame north, east [m];
    NaN once a vehicle is lost. Arrays that a saved trace does not hold are None.
    """

    scenario: Scenario
    policy: str
    seed: int
    metrics: Metrics
    waypoints: Float32
    """Corners of the first group's trajectory, shape (point, 2)."""
    groups: Groups
    """Who goes where, and who knows of it."""
    obstacles: Float32
    """Centre north, east and radius, at the end, shape (obstacle, 3)."""
    traffic: Float32 | None
    """Their centres at every sample, shape (time, obstacle, 2); None where none moves."""
    marks: Float32
    """What the task draws: centre north, east and radius of circles, 0 for none, shape (time, mark, 3)."""
    time_s: Float32
    """Shape (time,)."""
    references: Float32
    """Position of each group's l(t), shape (time, group, 2)."""
    position: Float32
    """Shape (time, vehicle, 2)."""
    heading: Float32
    """Heading in [-pi, pi), clockwise from north [rad], shape (time, vehicle)."""
    speed: Float32
    """Over ground [m/s], shape (time, vehicle)."""
    series: dict[str, Float32]
    """``min_spacing_m`` and ``obstacle_clearance_m``, the smallest since the sample before, ``centre_error_m``, and
    ``collisions`` so far (not of a trace), shape (time,) each; NaN where there is nothing to measure."""
    events: list[Event]
    force: Float32 | None
    """Length of the action since the sample before, as a share of full force, shape (time, vehicle); 0 at the start."""
    spacing: Float32 | None
    """Smallest distance to another vehicle since the sample before [m], NaN for none, shape (time, vehicle)."""
    inspections: dict[int, Inspection]
    """What single vehicles heard, by index of the vehicle."""
    water: Water | None
    """None in still water."""

    def discs(self, k: int) -> Float32:
        """The obstacles at a sample: centre north, east and radius, shape (obstacle, 3)."""
        return self.obstacles if self.traffic is None else np.hstack([self.traffic[k], self.obstacles[:, 2:]])
