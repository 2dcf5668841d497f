"""Setup of an episode: references, obstacles and vehicles, sampled by the world's generator.

Trajectory and obstacles are the scenario's own, or a random field. Vehicles start in two groups behind the trajectory's
first point, with a guaranteed spacing.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.scenario.sections import RandomField, growth
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trajectory import arrival_times
from uuv_marl.types import Bool, Float64, Int64

_TRIES_PER_OBSTACLE, _TRIES_PER_VEHICLE = 32, 64


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


def sample_field(scenario: Scenario, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """Sample waypoints (point, 2) [m] and obstacles (obstacle, 3): centre north, east and radius [m]."""
    if scenario.random_field is None:
        obstacles = [(*obstacle.centre_m, obstacle.radius_m) for obstacle in scenario.obstacles]
        return np.array(scenario.trajectory.waypoints_m), np.array(obstacles, np.float64).reshape(-1, 3)
    waypoints = _polyline(scenario.random_field, rng)
    return waypoints, _obstacles(scenario, scenario.random_field, waypoints, rng)


def longest_duration(scenario: Scenario) -> float:
    """Longest duration of a trajectory of this scenario [s]."""
    speed, field = scenario.trajectory.speed_mps, scenario.random_field
    if field is not None:
        return field.legs[1] * field.leg_length_m[1] / speed
    return float(arrival_times(np.array(scenario.trajectory.waypoints_m), speed)[-1])


def _polyline(field: RandomField, rng: np.random.Generator) -> Float64:
    legs = int(rng.integers(field.legs[0], field.legs[1] + 1))
    lengths = rng.uniform(*field.leg_length_m, legs)
    turns = rng.uniform(-1.0, 1.0, legs) * math.radians(field.turn_max_deg)
    turns[0] = rng.uniform(-math.pi, math.pi)
    headings = np.cumsum(turns)
    steps = lengths[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _obstacles(scenario: Scenario, field: RandomField, waypoints: Float64, rng: np.random.Generator) -> Float64:
    """Sample discs, shape (obstacle, 3) [m], whose gaps are all at least 2 (s_o + s_u).

    Grown by half of that they stay disjoint, so that some path keeps s_o + s_u from every surface.
    """
    n, gap = scenario.swarm.num_vehicles, 2 * (scenario.constraints.s_o_m + scenario.constraints.s_u_m)
    end_clear = max(field.end_clear_m * growth(n), gap)
    wanted = int(rng.integers(field.obstacles[0], field.obstacles[1] + 1))
    first, second = (float(waypoints[0, 0]), float(waypoints[0, 1])), (float(waypoints[1, 0]), float(waypoints[1, 1]))
    placed: list[tuple[float, float, float]] = []
    for _ in range(wanted * _TRIES_PER_OBSTACLE):
        if len(placed) == wanted:
            break
        leg = int(rng.integers(len(waypoints) - 1))
        share, offset = rng.random(), rng.uniform(-1.0, 1.0) * field.offset_max_m
        radius = rng.uniform(*field.radius_m)
        step = waypoints[leg + 1] - waypoints[leg]
        across = np.array([-step[1], step[0]]) / np.hypot(*step)
        x, y = (float(value) for value in waypoints[leg] + share * step + offset * across)
        if (
            scenario.start.distance(n, first, second, (x, y)) >= radius + gap
            and math.hypot(x - waypoints[-1, 0], y - waypoints[-1, 1]) >= radius + end_clear
            and all(math.hypot(x - a, y - b) >= radius + other + gap for a, b, other in placed)
        ):
            placed.append((x, y, radius))
    return np.array(placed, np.float64).reshape(-1, 3)


def start_state(scenario: Scenario, waypoints: Float64, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """Sample poses eta and velocities nu, shape (vehicle, 3) each, from the scenario's start. Section 5.1.

    The first half of the vehicles, rounded up, forms the port group.
    """
    n, start = scenario.swarm.num_vehicles, scenario.start
    length, width = start.sides(n)
    num_port = (n + 1) // 2
    port = _group(scenario, num_port, rng)
    starboard = _group(scenario, n - num_port, rng)
    along = np.concatenate([port[:, 0], starboard[:, 0]]) - length
    across = np.concatenate([port[:, 1] - start.gap_m / 2 - width, starboard[:, 1] + start.gap_m / 2])
    ahead = (waypoints[1] - waypoints[0]) / np.hypot(*(waypoints[1] - waypoints[0]))
    eta, nu = np.zeros((n, 3)), np.zeros((n, 3))
    eta[:, 0] = waypoints[0, 0] + along * ahead[0] - across * ahead[1]
    eta[:, 1] = waypoints[0, 1] + along * ahead[1] + across * ahead[0]
    eta[:, 2] = rng.uniform(-math.pi, math.pi, n)
    nu[:, 0] = rng.uniform(start.speed_min_mps, start.speed_max_mps, n)
    return eta, nu


def _group(scenario: Scenario, count: int, rng: np.random.Generator) -> Float64:
    """Positions (vehicle, 2) in a rectangle [0, length] x [0, width] [m]: random, or on a lattice if too dense."""
    n, start = scenario.swarm.num_vehicles, scenario.start
    length, width = start.sides(n)
    candidates, placed = np.zeros((count * _TRIES_PER_VEHICLE, 3)), np.empty((count, 3))
    candidates[:, :2] = rng.random((len(candidates), 2)) * (length, width)
    if scatter(candidates, start.spacing_m, placed) == count:
        return placed[:, :2]
    columns, rows, row_m = start.lattice(n)
    row, column = np.divmod(rng.permutation(columns * rows)[:count], columns)
    lattice = np.stack([row * row_m, (column + 0.5 * (row % 2)) * start.spacing_m], axis=1)
    # Slightly wider, so that rounding never brings two vehicles below the spacing.
    return lattice * (1.0 + 1e-12)


@compiled
def scatter(candidates: Float64, gap: float, placed: Float64) -> int:
    """Fill ``placed`` with the discs that keep a gap [m] from all before them; return how many.

    Both arrays have shape (disc, 3): two coordinates and a radius [m], 0 for a point.
    """
    num_placed = 0
    for k in range(candidates.shape[0]):
        if num_placed == placed.shape[0]:
            break
        free = True
        for m in range(num_placed):
            dx, dy = candidates[k, 0] - placed[m, 0], candidates[k, 1] - placed[m, 1]
            near = candidates[k, 2] + placed[m, 2] + gap
            if dx * dx + dy * dy < near * near:
                free = False
                break
        if free:
            for c in range(3):
                placed[num_placed, c] = candidates[k, c]
            num_placed += 1
    return num_placed
