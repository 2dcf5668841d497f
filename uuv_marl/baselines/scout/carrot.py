"""``carrot``: ``scout`` to a goal at rest at a set speed, to starboard of its path.

Far from a goal at rest ``scout``'s pull is so strong that pushes from neighbours have no effect. A carrot is a moving
reference a little ahead on the path. Keeping to starboard is rule 9 of the COLREGs (narrow channels) and rule 14
(vessels that meet head-on pass port to port).
"""

import dataclasses

import numpy as np

from uuv_marl.baselines.policy import tuned
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.controller import Scout
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Bool, Float32

_TUNED = tuned("carrot")


class Carrot(Scout):
    """``scout`` behind a carrot on the straight line to a goal at rest; a moving reference is followed as by ``scout``.

    Args:
        speed: of the carrot [m/s]. Tuned with the preset ``gap``, as are the next two.
        ahead_m: its distance ahead [m]; nearer to the goal the reference is the goal.
        right_m: distance to starboard of the target point [m].
        preset: as for ``scout``, and so are ``gains`` and ``barrier``.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, speed: float = _TUNED["speed"],
        ahead_m: float = _TUNED["ahead_m"], right_m: float = _TUNED["right_m"], preset: str = "gap",
        gains: ScoutGains | None = None, barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        super().__init__(scenario, num_worlds, preset=preset, gains=gains, barrier=barrier)
        self.speed, self.ahead_m, self.right_m = speed, ahead_m, right_m

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the memory from a percept whose reference is the carrot."""
        super().remember(self.with_carrot(percept), worlds)

    def with_carrot(self, percept: Percept) -> Percept:
        """The percept with the carrot in place of a goal at rest."""
        changed, (to, left) = dataclasses.replace(percept, flat=percept.flat.copy()), self._goal_and_distance(percept)
        far = (left > self.ahead_m) & (percept["reference_velocity"] == 0.0).all(axis=-1)
        to += np.float32(self.right_m) * _unit(np.stack([-to[..., 1], to[..., 0]], axis=-1))
        along = _unit(to)[far]
        changed["reference"][far], changed["reference_velocity"][far] = self.ahead_m * along, self.speed * along
        return changed

    def _goal_and_distance(self, percept: Percept) -> tuple[Float32, Float32]:
        """Vector to the target point [m], shape (world, vehicle, 2), and distance of the goal [m], (world, vehicle)."""
        goal = percept["reference"].copy()
        return goal, np.hypot(goal[..., 0], goal[..., 1])


class CarrotInformed(Carrot):
    """``carrot`` on a given collision-free path: for tasks with the channel ``path``.

    With ``waits``, a vehicle without right of way stays. ``speed`` is that of l(t) in the paper, as no exploration is
    needed.
    """

    requirements = Carrot.requirements._replace(channels=("path",))

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, waits: bool = False, speed: float = 4.0,
        right_m: float = 0.0, preset: str = "gap",
    ) -> None:  # fmt: skip
        super().__init__(scenario, num_worlds, speed=speed, right_m=right_m, preset=preset)
        self.waits = waits and "right_of_way" in self.layout.starts

    def with_carrot(self, percept: Percept) -> Percept:
        """The percept with the carrot on the path; a vehicle that waits has a reference at rest at its position."""
        changed = super().with_carrot(percept)
        if self.waits:
            stays = percept["right_of_way"][..., 0] == 0.0
            changed["reference"][stays] = changed["reference_velocity"][stays] = 0.0
        return changed

    def _goal_and_distance(self, percept: Percept) -> tuple[Float32, Float32]:
        return percept["path"].copy(), percept["path_length"][..., 0]


def _unit(vectors: Float32) -> Float32:
    """Unit vectors, shape (..., 2)."""
    length = np.maximum(np.hypot(vectors[..., 0], vectors[..., 1]), 1e-6)
    return (vectors / length[..., None]).astype(np.float32)
