"""``TangentBug``: a controller for water with walls, which passes obstacles on one side and applies the safety filter.

The desired velocity follows the chosen direction, with pushes from near neighbours; it is made safe against all
remembered echoes and against neighbours.
"""

import math
from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines.bug.directions import RAYS, choose_directions, rays
from uuv_marl.baselines.bug.gains import BUG_BARRIER, BugGains
from uuv_marl.baselines.bug.walls import Walls, WallsMemory, update_walls, wall_planes
from uuv_marl.baselines.memory import Surroundings, update_memory
from uuv_marl.baselines.policy import Limits, tuned
from uuv_marl.baselines.safety.barrier import Barrier, neighbour_planes, steer_safely, with_numbers
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.controller import pushed
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32, Float64


class TangentBug(Filtered):
    """Towards the goal, or past the end of an obstacle; pushes among near neighbours, and the safety filter.

    Made for goals at rest: the vector to the goal then gives a vehicle's position, up to its heading. ``tuned_for`` is
    ``two_swarms``, or "" for hard water; ``gains`` and ``barrier`` replace the tuned ones.
    """

    Memory: ClassVar[type[Any] | None] = WallsMemory

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, tuned_for: str = "", gains: BugGains | None = None,
        barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        tuned_gains, safe = with_numbers(tuned("tangent_bug", tuned_for), BugGains(), BUG_BARRIER)
        super().__init__(scenario, num_worlds, barrier or safe)
        self.gains = gains or tuned_gains
        split = len(Surroundings._fields)
        self._surroundings, self._walls = Surroundings(*self.memory[:split]), Walls(*self.memory[split:])
        self.planes: Float64 = np.zeros((self._walls.echoes.shape[2] + scenario.sonar.num_sectors, 3))
        self._view = rays(), rays(), np.zeros(RAYS)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the memory and choose directions."""
        flat, at = self.flat(percept), self.layout.offsets
        update_memory(flat, at, worlds, self.model, self.memory_s, self._surroundings)
        update_walls(flat, at, worlds, self.model.sectors, self._surroundings, self._walls)
        choose_directions(worlds, BugGains(*map(float, self.gains)), *self._view, self._surroundings, self._walls)

    def decide(self, percept: Percept) -> Float32:  # noqa: ARG002 - it is in the memory
        """Actions of shape (world, vehicle, 2)."""
        action = np.zeros((*self._walls.num.shape, 2), np.float32)
        _decide_all(
            self.active, self.model.own.period_s, BugGains(*map(float, self.gains)), self.barrier, self.limits,
            self.gain, self._surroundings, self._walls, self.planes, action,
        )  # fmt: skip
        return action


@compiled
def _decide_all(
    worlds: Bool, period: float, g: BugGains, barrier: Barrier, limits: Limits, gain: float, memory: Surroundings,
    walls: Walls, planes: Float64, action: Float32,
) -> None:  # fmt: skip
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                pose, goal, direction = memory.pose[w, i], memory.reference[w, i], walls.direction[w, i]
                speed = min(g.cruise, g.pull * math.hypot(goal[0] - pose[0], goal[1] - pose[1]))
                w_x, w_y = pushed(speed * direction[0], speed * direction[1], w, i, g.push, g.push_range, memory)
                num = wall_planes(w, i, period, barrier, limits, memory, walls, planes)
                num = neighbour_planes(w, i, num, period, barrier, memory, planes)
                steer_safely(w, i, w_x, w_y, num, planes, gain, limits, memory, action)
