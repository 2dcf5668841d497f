"""The recording of an episode."""

from typing import NamedTuple

import numpy as np

from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.envs.drawing.scene import Scene, SonarView
from uuv_marl.errors import ReplayError
from uuv_marl.replay.events import Event
from uuv_marl.scenario import Scenario
from uuv_marl.types import Float32, Int32


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


class Recording(NamedTuple):
    """One episode: the scenario, and all vehicles at each sample.

    There is a sample at the start and one for each decision. Frame north, east [m]; NaN once a vehicle is lost.
    """

    scenario: Scenario
    policy: str
    seed: int
    metrics: Metrics
    scenes: list[Scene]
    """What pictures show of each sample, except sonar."""
    time_s: Float32
    """Shape (time,)."""
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
    inspections: dict[int, Inspection]
    """Inspections by index of the vehicle."""

    def scene_at(self, time_s: float, sonar_of: int | None = None) -> Scene:
        """The scene of the latest sample up to this time [s], optionally with the sonar of a vehicle.

        Raises:
            ReplayError: the recording has no sonar of that vehicle.
        """
        if sonar_of is not None and sonar_of not in self.inspections:
            held = ", ".join(map(str, sorted(self.inspections))) or "none"
            raise ReplayError(
                f"the recording holds no sonar of vehicle {sonar_of}, only of: {held}; "
                "name the vehicle when you record the episode"
            )
        k = max(int(np.searchsorted(self.time_s, time_s + 1e-6, side="right")) - 1, 0)
        scene = self.scenes[k]
        if sonar_of is None or not scene.alive[sonar_of]:
            return scene
        seen = self.inspections[sonar_of]
        neighbour = seen.neighbour[k][seen.detected_index[k] >= 0]
        return scene._replace(sonar=SonarView(sonar_of, neighbour, seen.echo_range[k]))
