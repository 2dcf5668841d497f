"""Trajectory and obstacles of a world: the scenario's own, or a random field sampled by the world's generator."""

import math

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.scenario.sections import RandomField, growth
from uuv_marl.sim.trajectory import arrival_times
from uuv_marl.types import Float64

_TRIES_PER_OBSTACLE = 32


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
