"""Obstacles near a vehicle, so that of hundreds only those are examined; results are as with all of them.

Obstacles are stored as columns, so that loops over them are vectorised.
"""

import math

from uuv_marl.sim.arrays import World, WorldMap
from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.model import Rules
from uuv_marl.sim.workspace import MOST_NEARBY, ObstacleBuffers, Obstacles, obstacle_columns

Edges = tuple[float, float, float, float]
"""Lower and upper edge of a cone of directions, north and east each; all 0 for all directions."""

ROUND_M = 1e-6
"""Margin for rounding [m]."""
_EVERYWHERE = (0.0, 0.0, 0.0, 0.0)
_SKIN_M = 5.0
"""Margin beyond a vehicle's clearance within which obstacles are remembered: about its motion in a decision."""


@compiled_inline
def load_obstacles(w: int, world_map: WorldMap, buffers: ObstacleBuffers) -> None:
    """Load the columns of world w's obstacles, choose all of them, and forget which are nearby."""
    obstacles = obstacle_columns(buffers)
    obstacles.num_nearby[: world_map.group.shape[1]] = -1
    load_places(w, world_map, buffers)
    for k in range(world_map.num_obstacles[w]):
        obstacles.radius[k], obstacles.chosen[k] = world_map.obstacles[w, k, 2], k


@compiled_inline
def load_places(w: int, world_map: WorldMap, buffers: ObstacleBuffers) -> None:
    """Load the positions of world w's obstacles again, once they may have moved."""
    obstacles = obstacle_columns(buffers)
    for k in range(world_map.num_obstacles[w]):
        obstacles.x[k], obstacles.y[k] = world_map.obstacles[w, k, 0], world_map.obstacles[w, k, 1]


@compiled_inline
def choose(num: int, x: float, y: float, reach: float, cone: Edges, obstacles: Obstacles) -> int:
    """Choose those of the first ``num`` obstacles that meet a cone from (x, y) within a reach [m]; return how many.

    A few more at the rim may be chosen. ``obstacles.chosen`` is written.
    """
    l_x, l_y, u_x, u_y = cone
    for k in range(num):
        dx, dy, radius = obstacles.x[k] - x, obstacles.y[k] - y, obstacles.radius[k] + ROUND_M
        near = reach + radius
        meets = (l_x * dy - l_y * dx >= -radius) & (u_x * dy - u_y * dx <= radius)
        obstacles.chosen[k] = int((dx * dx + dy * dy <= near * near) & meets)
    num_chosen = 0
    for k in range(num):
        wanted = obstacles.chosen[k]
        obstacles.chosen[num_chosen] = k
        num_chosen += wanted
    return num_chosen


@compiled_inner
def remember_nearby(w: int, world: World, rules: Rules, buffers: ObstacleBuffers) -> None:
    """Remember which obstacles may come near each vehicle until the next decision.

    The distance is estimated from the clearance of the previous step. ``buffers`` is written.
    """
    obstacles = obstacle_columns(buffers)
    eta, num, fastest = world.state.eta, world.world_map.num_obstacles[w], 0.0
    velocity, swing = world.world_map.obstacle_velocity, world.world_map.swing
    for k in range(num):
        fastest = max(fastest, abs(velocity[w, k, 0]) + abs(velocity[w, k, 1]))
        fastest = max(fastest, abs(swing[w, k, 2]) + abs(swing[w, k, 3]))
    for i in range(eta.shape[1]):
        x, y, first = eta[w, i, 0], eta[w, i, 1], i * MOST_NEARBY
        reach = max(world.facts.clearance[w, i], rules.hull_radius) + _SKIN_M
        num_nearby = choose(num, x, y, reach, _EVERYWHERE, obstacles)
        if num_nearby <= MOST_NEARBY:
            for t in range(num_nearby):
                obstacles.nearby[first + t] = obstacles.chosen[t]
            obstacles.num_nearby[i], obstacles.from_x[i], obstacles.from_y[i] = num_nearby, x, y
            obstacles.beyond[i] = reach - fastest * rules.control_steps * rules.control_step_s


@compiled_inline
def nearest_surface(i: int, x: float, y: float, obstacles: Obstacles) -> tuple[float, float]:
    """Distance of the nearest remembered surface from vehicle i, at (x, y), and a lower bound for all others [m].

    Where none are remembered, the bound is minus infinity.
    """
    if obstacles.num_nearby[i] < 0:
        return math.inf, -math.inf
    nearest = math.inf
    for t in range(obstacles.num_nearby[i]):
        k = int(obstacles.nearby[i * MOST_NEARBY + t])
        dx, dy = obstacles.x[k] - x, obstacles.y[k] - y
        nearest = min(nearest, math.sqrt(dx * dx + dy * dy) - obstacles.radius[k])
    dx, dy = x - obstacles.from_x[i], y - obstacles.from_y[i]
    return nearest, obstacles.beyond[i] - math.sqrt(dx * dx + dy * dy)
