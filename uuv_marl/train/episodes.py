"""What differs from one episode of a training to the next: echoes, decision period, disturbances."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pydantic

from uuv_marl.benchmark.robustness.axes import AXES, known
from uuv_marl.scenario import load_scenario

Conditions = Sequence[Mapping[str, object]]
"""Fields of a scenario, for one episode after the other."""
_VALIDATION_DRAW = 2**31
"""Seed of what is drawn for validation."""


class Episodes(pydantic.BaseModel, frozen=True, extra="forbid"):
    """How the conditions of episodes are drawn; every world goes through them, an episode each, in their order."""

    changes: dict[str, Any] = {}
    """Fields of the scenario that all have, but validation has not."""
    calm: float = pydantic.Field(1.0, ge=0.0, le=1.0)
    """Share of episodes without a disturbance."""
    surface: float = pydantic.Field(0.0, ge=0.0, le=1.0)
    """Share of episodes in which echoes report surfaces instead of centres."""
    periods_s: tuple[float, ...] = (0.1,)
    """Decision periods [s], as often as they are to come."""
    axes: tuple[str, ...] = ()
    """Disturbances: axes of the robustness suite. Its groups come equally often."""
    levels: tuple[int, ...] = (1, 2, 3, 4, 5)
    """Levels of these axes."""
    at_once: int = pydantic.Field(1, ge=1)
    """Number of disturbances in a disturbed episode, each of another group."""
    number: int = pydantic.Field(1, ge=1)
    """Number of different episodes that are drawn; then they come again."""
    validated: int = pydantic.Field(0, ge=0)
    """Number of other episodes that are drawn for validation, the same for every seed of a training."""

    @pydantic.model_validator(mode="after")
    def _levels_there(self) -> "Episodes":
        for axis in known(self.axes):
            if not {*AXES[axis].levels} & {*self.levels}:
                raise ValueError(f"axis {axis} has the levels {[*AXES[axis].levels]}; add one of them to levels")
        return self

    def draw(self, scenario: str, seed: int) -> Conditions:
        """Fields of the scenario for each of ``number`` episodes."""
        return tuple(self._drawn(scenario, self.number, self.changes, seed))

    def draw_validated(self, scenario: str) -> Conditions:
        """Fields of the scenario for each of ``validated`` episodes of validation, without ``changes``."""
        return tuple(self._drawn(scenario, self.validated, {}, _VALIDATION_DRAW))

    def _drawn(self, scenario: str, number: int, base: dict[str, Any], seed: int) -> Iterator[Mapping[str, object]]:
        rng = np.random.default_rng(seed)
        speed = load_scenario(scenario).trajectory.speed_mps
        groups: dict[str, list[str]] = {}
        for axis in known(self.axes):
            groups.setdefault(AXES[axis].group, []).append(axis)
        for _ in range(number):
            echo, disturbed = rng.random(2) < (self.surface, 1.0 - self.calm)
            changes = {**base, "timing.decision_period_s": float(rng.choice(self.periods_s))}
            if echo:
                changes["sonar.echo_reports"] = "surface"
            left = dict(groups) if disturbed else {}
            for _ in range(min(self.at_once, len(left))):
                axis = AXES[str(rng.choice(left.pop(str(rng.choice(list(left))))))]
                changes |= axis.overrides(int(rng.choice([k for k in axis.levels if k in self.levels])), speed)
            yield changes
