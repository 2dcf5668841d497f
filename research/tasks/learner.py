"""A policy that a training made, so that it runs in the episodes of the laws, and is measured as they are."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# Stable-Baselines3 leaves the types of observations and spaces open.

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines import Policy
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike
from uuv_marl.sim.observation import Observe, observation_layout, observer
from uuv_marl.types import Float32

OBSERVE: Observe = "closeness"


def sight(scenario: Scenario, blind: bool) -> Float32:
    """Factors of an observation's entries: 0 for those of echoes, if blind, else 1; shape (entry,)."""
    layout = observation_layout(scenario, OBSERVE)
    names = np.repeat([field.name.startswith("echo") for field in layout.table], [f.size for f in layout.table])
    return np.where(names & blind, 0.0, 1.0).astype(np.float32)


class Learner(Policy):
    """A model of Stable-Baselines3, with or without a memory, that acts without noise.

    All worlds must be reset together.

    Args:
        model: has ``predict``.
        blind: whether echoes are zeroed.
    """

    yaw_damping_nms: ClassVar[float] = 600.0

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, model: Any, blind: bool) -> None:
        super().__init__(scenario, num_worlds)
        self._model, self._seen, self._state = model, sight(scenario, blind), None
        self._seeing = observation_layout(scenario, OBSERVE)

    def reset(self, seed: SeedLike = 0, worlds: Sequence[int] | None = None) -> None:
        """Forget everything."""
        super().reset(seed, worlds)
        self._state = None

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        observation, fill = observer(percept, self._seeing)
        fill(0, len(observation))
        rows = (observation * self._seen).reshape(-1, observation.shape[2])
        begins = np.full(len(rows), self._state is None)
        action, self._state = self._model.predict(rows, self._state, begins, deterministic=True)
        return action.reshape(*observation.shape[:2], 2)
