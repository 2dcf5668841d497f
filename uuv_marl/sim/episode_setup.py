"""What an episode starts from: references, obstacles and vehicles, as the world's own generator draws them."""

from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.field import sample_field
from uuv_marl.sim.start import start_state
from uuv_marl.sim.trajectory import arrival_times
from uuv_marl.types import Bool, Float64, Int64


class EpisodeSetup(NamedTuple):
    """One world as it stands at the reset. North and east [m]."""

    waypoints: tuple[Float64, ...]
    """Corners of each group's trajectory, shape (point, 2), at least two."""
    times: tuple[Float64, ...]
    """When its l(t) passes them [s], shape (point,); zeros for a goal at rest, the last corner."""
    obstacles: Float64
    """Centre north, east and radius [m], shape (obstacle, 3)."""
    eta: Float64
    """Pose of the vehicles: north [m], east [m], heading [rad], shape (vehicle, 3)."""
    nu: Float64
    """Their velocity: surge, sway [m/s], yaw rate [rad/s], shape (vehicle, 3)."""
    group: Int64
    """Group of each vehicle, whose l(t) is its reference, shape (vehicle,)."""
    informed: Bool
    """Whether a vehicle perceives its reference, shape (vehicle,)."""
    duration_s: float
    """Time that the task takes at best [s], from which ``time_limit`` makes the limit."""


def default_setup(scenario: Scenario, rng: np.random.Generator) -> EpisodeSetup:
    """One trajectory for all: the scenario's own, or one through a random field; the start behind its first point."""
    field = sample_field(scenario, rng)
    eta, nu = start_state(scenario, field.waypoints, rng)
    n, times = scenario.swarm.num_vehicles, arrival_times(field.waypoints, scenario.trajectory.speed_mps)
    return EpisodeSetup(
        (field.waypoints,), (times,), field.obstacles, eta, nu,
        group=np.zeros(n, np.int64), informed=np.ones(n, np.bool_), duration_s=float(times[-1]),
    )  # fmt: skip
