"""How the actor in training sees a swarm and drives it: as the policies do that its checkpoints become."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.memory_features import NUM_MEMORY_FEATURES
from uuv_marl.baselines.learned.percept_features import BARRIER, Features, num_features
from uuv_marl.baselines.learned.trimmed_scout import TrimmedScout
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.train.training import Training
from uuv_marl.types import Float32

Arrays = dict[str, NDArray[Any]]


class Forces:
    """An actor without memory: its output is a force [full force], to which a fixed barrier is added."""

    def __init__(self, scenario: Scenario, num_worlds: int, training: Training) -> None:  # noqa: ARG002
        self._features = Features(scenario, BARRIER)
        self.size = self._features.size
        """Features of a vehicle."""
        self._barrier = np.zeros((num_worlds, scenario.swarm.num_vehicles, 2), np.float32)
        self._clamps = np.zeros(num_worlds, np.int64)

    @staticmethod
    def num_features(scenario: Scenario) -> int:
        """Features of a vehicle in a scenario."""
        return num_features(scenario.sonar.num_sectors, scenario.sonar.num_active_sectors)

    def hear(self, percept: Percept) -> None:
        """Take in what is perceived while an output is held: the barrier's force."""
        self.look(percept, np.empty((*self._barrier.shape[:2], self.size), np.float32))

    def look(self, percept: Percept, features: Float32) -> None:
        """The same, and fill the features, shape (world, vehicle, ``size``); twice where worlds begin anew."""
        self._features.look(percept.flat, features, self._barrier, self._clamps)

    def actions(self, output: Float32) -> Float32:
        """The actions, shape (world, vehicle, 2): the force, and the barrier's."""
        return output + self._barrier

    def snapshot(self) -> Arrays:
        """All that ``restore`` needs, besides a ``look`` at the same percept: nothing, there is no memory."""
        return {}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Nothing to do."""


class Trims:
    """An actor with memory: its output trims the gains of the hand-made law, and the filter makes what it does safe."""

    size = NUM_MEMORY_FEATURES

    def __init__(self, scenario: Scenario, num_worlds: int, training: Training) -> None:
        self._policy = TrimmedScout(scenario, num_worlds, gains=training.law, barrier=training.safety)

    @staticmethod
    def num_features(scenario: Scenario) -> int:  # noqa: ARG004 - of what is remembered, whatever the sonar
        """Features of a vehicle."""
        return NUM_MEMORY_FEATURES

    def hear(self, percept: Percept) -> None:
        """Remember what is perceived."""
        self._percept = percept
        self._policy.hear(percept)

    def look(self, percept: Percept, features: Float32) -> None:
        """Remember what is perceived, then fill the features."""
        self.hear(percept)
        self._policy.look(features)

    def actions(self, output: Float32) -> Float32:
        """Those of the policy, which is told what it did, for a number for each trim."""
        return self._policy.drive(self._percept, self._policy.trim(output))

    def snapshot(self) -> Arrays:
        """What is remembered."""
        return self._policy.snapshot()

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Remember it again."""
        self._policy.restore(snapshot)


ACTING = {"percept": Forces, "memory": Trims}
"""How actors act, by what they see."""
