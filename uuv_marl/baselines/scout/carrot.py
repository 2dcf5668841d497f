"""``carrot`` and its kin: ``scout`` towards a goal at rest at a set speed, keeping to starboard, or waiting its turn.

At rest ``scout`` pulls harder the farther its goal is, so that from afar neighbours' pushes count for nothing. A carrot
is a reference a little ahead on the way that moves at a speed of its own. To keep to starboard is rule 9 of the COLREGs
(in a narrow channel) and rule 14 (who meet head-on pass port to port).
"""

import dataclasses
from typing import ClassVar

import numpy as np

from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import DEFAULT_PRESET, ScoutGains
from uuv_marl.baselines.scout.law import Scout
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Bool, Float32


class Carrot(Scout):
    """``scout`` behind a carrot on the straight way to a goal at rest.

    Args:
        speed: of the carrot [m/s].
        ahead_m: how far ahead it is, and how near the goal it ends [m].
        right_m: to starboard of the way [m].
    """

    right: ClassVar[float] = 0.0
    """What ``right_m`` is where nothing is said [m]."""

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, preset: str = DEFAULT_PRESET, gains: ScoutGains | None = None,
        barrier: Barrier | None = None, speed: float = 4.0, ahead_m: float = 6.0, right_m: float | None = None,
    ) -> None:  # fmt: skip
        super().__init__(scenario, num_worlds, preset=preset, gains=gains, barrier=barrier)
        self.speed, self.ahead_m, self.right_m = speed, ahead_m, self.right if right_m is None else right_m

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Remember a percept with the carrot for a reference."""
        super().remember(self._led(percept), worlds)

    def _led(self, percept: Percept) -> Percept:
        """The percept with the carrot for a goal at rest; with none while it waits."""
        led = dataclasses.replace(percept, flat=percept.flat.copy())
        way, left = self._way(percept)
        far = (left > self.ahead_m) & (percept["reference_velocity"] == 0.0).all(axis=-1)
        along = way / np.maximum(np.hypot(way[..., 0], way[..., 1]), 1e-6)[..., None]
        aim = way + self.right_m * np.stack([-along[..., 1], along[..., 0]], axis=-1)
        aim /= np.maximum(np.hypot(aim[..., 0], aim[..., 1]), 1e-6)[..., None]
        led["reference"][far], led["reference_velocity"][far] = self.ahead_m * aim[far], self.speed * aim[far]
        return led

    def _way(self, percept: Percept) -> tuple[Float32, Float32]:
        """Vector to a point on the way [m], shape (world, vehicle, 2), and how far the goal is."""
        goal = percept["reference"]
        return goal, np.hypot(goal[..., 0], goal[..., 1])


class KeepsRight(Carrot):
    """``carrot`` to starboard of the straight way; of the gap it knows nothing."""

    right = 7.0


class KeepsRightInformed(KeepsRight):
    """``carrot`` to starboard of the way through a gap that it is told. For ``two_swarms`` and ``hard_water``."""

    channels: ClassVar[tuple[str, ...]] = ("way",)

    def _way(self, percept: Percept) -> tuple[Float32, Float32]:
        return percept["way"], percept["way_length"][..., 0]


class OneSideWaits(KeepsRightInformed):
    """``carrot`` through the gap, the starboard group once the other is through. For ``two_swarms``."""

    right = 0.0

    def _led(self, percept: Percept) -> Percept:
        led, waits = super()._led(percept), percept["way_turn"][..., 0] == 0.0
        led["reference"][waits] = led["reference_velocity"][waits] = 0.0
        return led
