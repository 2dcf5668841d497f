"""Setup of an episode: references, obstacles and vehicles, sampled by the world's generator."""

from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.field import sample_field
from uuv_marl.sim.start import start_state
from uuv_marl.sim.trajectory import arrival_times
from uuv_marl.types import Bool, Float64, Int64


class EpisodeSetup(NamedTuple):
    """One world at the reset. Positions are north and east [m]."""

    waypoints: tuple[Float64, ...]
    """Corners of each group's trajectory, shape (point, 2), at least two."""
    times: tuple[Float64, ...]
    """Time at which its l(t) passes them [s], shape (point,); zeros for a fixed goal, the last corner."""
    obstacles: Float64
    """Centre north, east and radius [m], shape (obstacle, 3)."""
    eta: Float64
    """Poses of the vehicles: north [m], east [m], heading [rad], shape (vehicle, 3)."""
    nu: Float64
    """Their velocities: surge, sway [m/s], yaw rate [rad/s], shape (vehicle, 3)."""
    group: Int64
    """Group of each vehicle, which has the reference l(t), shape (vehicle,)."""
    informed: Bool
    """Whether a vehicle perceives its reference, shape (vehicle,)."""
    duration_s: float
    """Least duration of the task [s], from which ``time_limit`` follows."""


def default_setup(scenario: Scenario, rng: np.random.Generator) -> EpisodeSetup:
    """Sample one trajectory for all vehicles, the scenario's or a random one, and the start behind its first point."""
    waypoints, obstacles = sample_field(scenario, rng)
    eta, nu = start_state(scenario, waypoints, rng)
    n, times = scenario.swarm.num_vehicles, arrival_times(waypoints, scenario.trajectory.speed_mps)
    return EpisodeSetup(
        (waypoints,), (times,), obstacles, eta, nu,
        group=np.zeros(n, np.int64), informed=np.ones(n, np.bool_), duration_s=float(times[-1]),
    )  # fmt: skip
