"""Memory of walls: every echo, as a point of a surface, or as the disc whose centre it reports.

``memory.discs`` holds twelve discs, enough for separate obstacles; walls have hundreds of points.
"""

import math
from typing import Annotated, NamedTuple

from uuv_marl.baselines.memory.discs import ActiveSectors, centre_of, surface_point
from uuv_marl.baselines.memory.pose import to_map
from uuv_marl.baselines.memory.table import Surroundings, with_surroundings
from uuv_marl.baselines.safety.barrier import MOST_CLOSED, Steering
from uuv_marl.baselines.steering import full_speed
from uuv_marl.percept import Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.tables import described
from uuv_marl.sim.views import fields
from uuv_marl.types import Bool, Float32, Float64

SAME_M = 2.0  # an echo this near to a remembered one replaces it [m]. Assumed: less than any disc's radius.


@described
class Walls(NamedTuple):
    """Echoes in the vehicle's map, and the side on which it passes an obstacle."""

    echoes: Annotated[Float64, "world vehicle 384 3", "Position in the map, and radius, 0 for a point [m]; a ring."]
    num: Annotated[Float64, "world vehicle", "Number of echoes."]
    next: Annotated[Float64, "world vehicle", "Index of the next new echo."]
    side: Annotated[Float64, "world vehicle", "1 where it passes to starboard, -1 to port, 0 on the line to the goal."]
    hit_m: Annotated[Float64, "world vehicle", "Distance of the goal when the line to it was blocked [m]."]
    turned: Annotated[Float64, "world vehicle", "Number of reversals since then."]
    direction: Annotated[Float64, "world vehicle 2", "Unit vector of its direction in the map."]


WallsMemory = with_surroundings("WallsMemory", Walls)  # memory of ``tangent_bug``: surroundings, then walls


@compiled
def update_walls(
    flat: Float32, at: Starts, worlds: Bool, sectors: ActiveSectors, memory: Surroundings, walls: Walls
) -> None:
    """Add every vehicle's echoes to its walls."""
    see = fields(flat, at)
    for w in range(worlds.shape[0]):
        for i in range(walls.num.shape[1] if worlds[w] else 0):
            if memory.begun[w, i] == 0.0:
                walls.num[w, i] = walls.next[w, i] = walls.side[w, i] = 0.0
            for a in range(see.echo.shape[2]):
                if memory.begun[w, i] > 0.0 and see.echo[w, i, a] > 0.0:
                    x, y = surface_point(w, i, a, see, sectors)
                    x, y = to_map(x, y, memory.pose[w, i])
                    radius = 0.0
                    if sectors.centres:
                        c_x, c_y = centre_of(w, i, a, see, memory)
                        x, y, radius = c_x, c_y, math.hypot(x - c_x, y - c_y)
                    _put(w, i, x, y, radius, walls)


@compiled
def _put(w: int, i: int, x: float, y: float, radius: float, walls: Walls) -> None:
    """Store an echo in place of the one that it repeats, or of the oldest."""
    echoes, at = walls.echoes[w, i], int(walls.next[w, i])
    for k in range(int(walls.num[w, i])):
        if max(abs(echoes[k, 0] - x), abs(echoes[k, 1] - y)) < SAME_M:
            at = k
            break
    if at == int(walls.next[w, i]):
        walls.next[w, i] = (at + 1) % echoes.shape[0]
        walls.num[w, i] = max(walls.num[w, i], at + 1)
    echoes[at, 0], echoes[at, 1], echoes[at, 2] = x, y, radius


@compiled
def wall_planes(w: int, i: int, safe: Steering, memory: Surroundings, walls: Walls) -> int:
    """Write the half-planes n . v <= b of near walls in the vehicle's map; returns their number."""
    pose, planes, num = memory.pose[w, i], safe.planes, 0
    rate, fastest = min(safe.barrier.obstacle_rate, MOST_CLOSED / safe.period), full_speed(safe.limits)
    for k in range(int(walls.num[w, i])):
        n_x, n_y = walls.echoes[w, i, k, 0] - pose[0], walls.echoes[w, i, k, 1] - pose[1]
        away = max(math.hypot(n_x, n_y), 1e-6)
        bound = rate * (away - walls.echoes[w, i, k, 2] - safe.barrier.obstacle_m)
        if bound < fastest:
            planes[num, 0], planes[num, 1], planes[num, 2] = n_x / away, n_y / away, bound
            num += 1
    return num
