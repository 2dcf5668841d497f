"""Distances between vehicles and to obstacles, and collisions: true values, independent of the sonar."""

import math

from uuv_marl.sim.arrays import World
from uuv_marl.sim.cells import Grid, covered
from uuv_marl.sim.compiled import compiled_inline, compiled_inner
from uuv_marl.sim.nearby import nearest_surface
from uuv_marl.sim.workspace import Cells, ObstacleBuffers, Obstacles, obstacle_columns
from uuv_marl.types import Float64

NOWHERE = (math.inf, math.inf, 0.0)
"""Previous centre and radius of an obstacle that did not exist."""


@compiled_inner
def find_nearest(cells: Cells, grid: Grid) -> None:
    """Fill ``cells.nearest`` [m2], infinite for a single vehicle."""
    cells.nearest[: grid.living] = math.inf
    if grid.rows * grid.columns == 1:
        for p in range(grid.living):
            lower_all(0, p, cells.x[p], cells.y[p], cells)
            lower_all(p + 1, grid.living, cells.x[p], cells.y[p], cells)
    else:
        for p in range(grid.living):
            cells.nearest[p] = nearest_squared(p, cells, grid)


@compiled_inline
def lower_all(first: int, end: int, x: float, y: float, cells: Cells) -> None:
    """Lower ``cells.nearest`` of entries ``first`` to ``end`` by their squared distance from (x, y)."""
    for q in range(first, end):
        dx, dy = cells.x[q] - x, cells.y[q] - y
        squared = dx * dx + dy * dy
        cells.nearest[q] = squared if squared < cells.nearest[q] else cells.nearest[q]


@compiled_inner
def nearest_squared(p: int, cells: Cells, grid: Grid) -> float:
    """Squared distance [m2] of entry p from the nearest other: in the cells around it, then in larger blocks."""
    x, y, least, reach = cells.x[p], cells.y[p], math.inf, grid.side
    while True:
        bottom, top, left, right = covered((x + reach, x - reach, y + reach, y - reach), grid)
        for r in range(bottom, top + 1):
            for q in range(cells.first[r * grid.columns + left], cells.first[r * grid.columns + right + 1]):
                dx, dy = cells.x[q] - x, cells.y[q] - y
                squared = dx * dx + dy * dy
                least = squared if squared < least and q != p else least
        covers_all = bottom == 0 and left == 0 and top == grid.rows - 1 and right == grid.columns - 1
        if least <= reach * reach or covers_all:
            return least
        reach *= 2.0


@compiled_inner
def new_collisions(w: int, p: int, touch: float, before: Float64, cells: Cells, grid: Grid) -> int:
    """Number of vehicles nearer to one than ``touch`` [m], between centres, that were not one control step ago."""
    i, count = cells.vehicle[p], 0
    rings = 0.0 if grid.rows * grid.columns == 1 else touch
    box = cells.x[p] + rings, cells.x[p] - rings, cells.y[p] + rings, cells.y[p] - rings
    bottom, top, left, right = covered(box, grid)
    for r in range(bottom, top + 1):
        for q in range(cells.first[r * grid.columns + left], cells.first[r * grid.columns + right + 1]):
            dx, dy = cells.x[q] - cells.x[p], cells.y[q] - cells.y[p]
            if q == p or dx * dx + dy * dy >= touch * touch:
                continue
            j = cells.vehicle[q]
            was_x, was_y = before[w, j, 0] - before[w, i, 0], before[w, j, 1] - before[w, i, 1]
            count += int(was_x * was_x + was_y * was_y >= touch * touch)
    return count


@compiled_inner
def measure_vehicles(w: int, hull_radius: float, world: World, cells: Cells, grid: Grid) -> int:
    """Update spacings and collisions of the living; return the number of new collisions between vehicles.

    A collision begins where two hulls overlap that did not one control step ago.
    """
    before, facts = world.state.before, world.facts
    touch, began = 2.0 * hull_radius, 0
    find_nearest(cells, grid)
    for p in range(grid.living):
        i = cells.vehicle[p]
        facts.spacing[w, i] = min(facts.spacing[w, i], math.sqrt(cells.nearest[p]))
        if cells.nearest[p] < touch * touch:
            new = new_collisions(w, p, touch, before, cells, grid)
            facts.vehicle_collisions[w, i] += new
            world.state.collided[w, i] = world.state.collided[w, i] or new > 0
            began += new
    return began // 2


@compiled_inner
def measure_obstacles(
    w: int, hull_radius: float, world: World, buffers: ObstacleBuffers, cells: Cells, grid: Grid
) -> int:
    """Update clearances of vehicles and obstacles, and collisions; return the number of new collisions with obstacles.

    A collision begins where a hull overlaps an obstacle and did not one control step ago; either may have moved.
    ``state.obstacles_before`` is written, too.
    """
    num, facts, obstacles_before = world.world_map.num_obstacles[w], world.facts, world.state.obstacles_before
    obstacles, began = obstacle_columns(buffers), 0
    obstacles.squared[:num] = math.inf
    for p in range(grid.living):
        i, x, y = cells.vehicle[p], cells.x[p], cells.y[p]
        nearest, others = nearest_surface(i, x, y, obstacles)
        if nearest >= hull_radius and others > nearest:
            facts.clearance[w, i] = min(facts.clearance[w, i], nearest)
            for k in range(num):
                dx, dy = obstacles.x[k] - x, obstacles.y[k] - y
                squared = dx * dx + dy * dy
                obstacles.squared[k] = squared if squared < obstacles.squared[k] else obstacles.squared[k]
        else:
            began += meet_obstacles(w, i, x, y, hull_radius, world, obstacles)
    for k in range(num):
        gap = math.sqrt(obstacles.squared[k]) - obstacles.radius[k]
        facts.obstacle_clearance[w, k] = min(facts.obstacle_clearance[w, k], gap)
        for c in range(3):
            obstacles_before[w, k, c] = world.world_map.obstacles[w, k, c]
    for k in range(num, obstacles_before.shape[1]):
        obstacles_before[w, k, 0], obstacles_before[w, k, 1], obstacles_before[w, k, 2] = NOWHERE
    return began


@compiled_inline
def meet_obstacles(w: int, i: int, x: float, y: float, hull_radius: float, world: World, obstacles: Obstacles) -> int:
    """Update clearances and collisions of vehicle i, at (x, y), with all obstacles; return the number of new ones."""
    facts, before, obstacles_before, began = world.facts, world.state.before, world.state.obstacles_before, 0
    for k in range(world.world_map.num_obstacles[w]):
        dx, dy = obstacles.x[k] - x, obstacles.y[k] - y
        gap = math.sqrt(dx * dx + dy * dy) - obstacles.radius[k]
        facts.clearance[w, i] = min(facts.clearance[w, i], gap)
        facts.obstacle_clearance[w, k] = min(facts.obstacle_clearance[w, k], gap)
        if gap >= hull_radius:
            continue
        was_x, was_y = obstacles_before[w, k, 0] - before[w, i, 0], obstacles_before[w, k, 1] - before[w, i, 1]
        if math.sqrt(was_x * was_x + was_y * was_y) - obstacles_before[w, k, 2] >= hull_radius:
            facts.vehicle_collisions[w, i] += 1
            world.state.collided[w, i] = True
            began += 1
    return began


@compiled_inner
def farthest(x: float, y: float, cells: Cells, grid: Grid) -> int:
    """Entry of ``cells`` farthest from a point, -1 for none."""
    best, most = -1, -1.0
    for p in range(grid.living):
        dx, dy = cells.x[p] - x, cells.y[p] - y
        squared = dx * dx + dy * dy
        if squared > most:
            best, most = p, squared
    return best


@compiled_inner
def extent(cells: Cells, grid: Grid) -> float:
    """Largest distance between two of the living [m], infinite for fewer than two.

    A pair's distance is at most the sum of the two from the centre, so that few vehicles can exceed a good first guess.
    """
    n = grid.living
    if n < 2:
        return math.inf
    x, y = 0.0, 0.0
    for p in range(n):
        x, y = x + cells.x[p], y + cells.y[p]
    x, y = x / n, y / n
    a = farthest(x, y, cells, grid)
    b = farthest(cells.x[a], cells.y[a], cells, grid)
    c = farthest(cells.x[b], cells.y[b], cells, grid)
    rim = math.hypot(cells.x[a] - x, cells.y[a] - y)
    dx, dy = cells.x[c] - cells.x[b], cells.y[c] - cells.y[b]
    most = dx * dx + dy * dy
    needed = max(math.sqrt(most) * (1.0 - 1e-9) - rim - 1e-9, 0.0)
    num = 0
    for p in range(n):
        dx, dy = cells.x[p] - x, cells.y[p] - y
        if dx * dx + dy * dy >= needed * needed:
            cells.some[num] = p
            num += 1
    for k in range(num):
        p = cells.some[k]
        for m in range(k):
            q = cells.some[m]
            dx, dy = cells.x[p] - cells.x[q], cells.y[p] - cells.y[q]
            most = max(most, dx * dx + dy * dy)
    return math.sqrt(most)
