"""``TangentBug``: a controller for water with walls, which passes obstacles on one side and applies the safety filter.

The desired velocity follows the chosen direction, with pushes from near neighbours; it is made safe against all
remembered echoes and against neighbours.
"""

import math
from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines.bug.directions import RAYS, TURNS, choose_directions
from uuv_marl.baselines.bug.gains import BUG_BARRIER, BugGains
from uuv_marl.baselines.bug.walls import Walls, WallsMemory, update_walls, wall_planes
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.safety.barrier import Steering, neighbour_planes, steer_safely
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.controller import pushed
from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32


class TangentBug(Filtered):
    """Towards the goal, or past the end of an obstacle; pushes among near neighbours, and the safety filter.

    Made for goals at rest: the vector to the goal then gives a vehicle's position, up to its heading. ``tuned_for`` is
    ``two_swarms``, or "" for hard water; ``gains`` and ``barrier`` replace the tuned ones.
    """

    Memory: ClassVar[type[Any] | None] = WallsMemory
    Gains = BugGains
    tuned_as = "tangent_bug"
    usual_barrier = BUG_BARRIER

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the memory and choose directions."""
        super().remember(percept, worlds)
        walls = Walls(*self.own)
        update_walls(self.flat(percept), self.layout.offsets, worlds, self.sectors, self.surroundings, walls)
        looks, free = np.empty_like(TURNS), np.empty(RAYS)
        choose_directions(worlds, self.float_gains, TURNS, looks, free, self.surroundings, walls)

    def _write(self, percept: Percept, action: Float32) -> None:  # noqa: ARG002 - it is in the memory
        _act(self.active, self.float_gains, self.safe, self.surroundings, Walls(*self.own), action)


@compiled
def _act(worlds: Bool, g: BugGains, safe: Steering, memory: Surroundings, walls: Walls, action: Float32) -> None:
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                pose, goal, direction = memory.pose[w, i], memory.reference[w, i], walls.direction[w, i]
                speed = min(g.cruise, g.pull * math.hypot(goal[0] - pose[0], goal[1] - pose[1]))
                w_x, w_y = pushed(speed * direction[0], speed * direction[1], w, i, g.push, g.push_range, memory)
                num = neighbour_planes(w, i, wall_planes(w, i, safe, memory, walls), safe, memory)
                steer_safely(w, i, w_x, w_y, num, safe, memory, action)
