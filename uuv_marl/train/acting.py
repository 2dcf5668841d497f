"""How the actor in training sees a swarm and drives it: as the policies do that its checkpoints become."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.memory_features import RECALLED
from uuv_marl.baselines.learned.percept_features import BARRIER, MOST_BARRIER, Features, num_features
from uuv_marl.baselines.learned.trimmed_scout import TrimmedLaw
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import MOST_TRIM, Trim
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import Float32

Arrays = dict[str, NDArray[Any]]
Sees = Literal["percept", "memory"]
"""What an actor sees: features of one percept, or of what is remembered."""


class Acting(Protocol):
    """The way from percepts to features, and from an actor's output to actions, for a swarm."""

    size: int
    """Features of a vehicle, see ``num_features``."""
    most: float
    """Outputs mean no more beyond this."""
    changed: Float32
    """1 where the safety filter changed the latest action, shape (world, vehicle)."""

    @staticmethod
    def num_features(scenario: Scenario) -> int:
        """Features of a vehicle in a scenario."""
        ...

    @staticmethod
    def num_outputs(trims: Sequence[Trim]) -> int:
        """Numbers that the actor gives for a vehicle."""
        ...

    def hear(self, percept: Percept) -> None:
        """Take in what is perceived while an output is held."""
        ...

    def look(self, percept: Percept, features: Float32) -> None:
        """The same, and fill the features, shape (world, vehicle, ``size``); twice where worlds begin anew."""
        ...

    def actions(self, output: Float32) -> Float32:
        """The actions, shape (world, vehicle, 2), for an output, shape (world, vehicle, ``num_outputs``)."""
        ...

    def snapshot(self) -> Arrays:
        """All that ``restore`` needs, besides a ``look`` at the same percept."""
        ...

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot."""
        ...


class Forces:
    """An actor without memory: its output is a force [full force], to which a fixed barrier is added.

    Args:
        scenario: what is simulated.
        num_worlds: of the swarm.
        law: of the hand-made law, which it does not use.
        safety: of the safety filter, which it does not use.
        trims: of an actor with memory.
    """

    most = MOST_BARRIER

    def __init__(
        self, scenario: Scenario, num_worlds: int, law: ScoutGains, safety: Barrier, trims: Sequence[Trim]  # noqa: ARG002
    ) -> None:  # fmt: skip
        self._features = Features(scenario, BARRIER)
        self.size = self._features.size
        shape = num_worlds, scenario.swarm.num_vehicles
        self._barrier, self.changed = np.zeros((*shape, 2), np.float32), np.zeros(shape, np.float32)
        self._clamps = np.zeros(num_worlds, np.int64)

    @staticmethod
    def num_features(scenario: Scenario) -> int:
        """Features that the actor sees."""
        return num_features(scenario.sonar.num_sectors, scenario.sonar.num_active_sectors)

    @staticmethod
    def num_outputs(trims: Sequence[Trim]) -> int:  # noqa: ARG004
        """A force, forward and to starboard."""
        return 2

    def hear(self, percept: Percept) -> None:
        """The barrier's force from what is perceived."""
        self.look(percept, np.empty((*self.changed.shape, self.size), np.float32))

    def look(self, percept: Percept, features: Float32) -> None:
        """Fill the features, and the barrier's force."""
        self._features.look(percept.flat, features, self._barrier, self._clamps)

    def actions(self, output: Float32) -> Float32:
        """The force and the barrier's."""
        return output + self._barrier

    def snapshot(self) -> Arrays:
        """Nothing: there is no memory."""
        return {}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Nothing to do."""


class Trims:
    """An actor with memory: its output trims the gains of the hand-made law, and the filter makes what it does safe.

    Args:
        scenario: what is simulated.
        num_worlds: of the swarm.
        law: gains of the hand-made law.
        safety: margins and rates of the safety filter.
        trims: what the actor changes.
    """

    size = RECALLED
    most = MOST_TRIM

    def __init__(
        self, scenario: Scenario, num_worlds: int, law: ScoutGains, safety: Barrier, trims: Sequence[Trim]  # noqa: ARG002
    ) -> None:  # fmt: skip
        self._policy = TrimmedLaw(scenario, num_worlds, gains=law, barrier=safety)
        self.changed = np.zeros((num_worlds, scenario.swarm.num_vehicles), np.float32)

    @staticmethod
    def num_features(scenario: Scenario) -> int:  # noqa: ARG004 - of what is remembered, whatever the sonar
        """Features that the actor sees."""
        return RECALLED

    @staticmethod
    def num_outputs(trims: Sequence[Trim]) -> int:
        """One for each trim."""
        return len(trims)

    def hear(self, percept: Percept) -> None:
        """Remember what is perceived."""
        self._percept = percept
        self._policy.hear(percept)

    def look(self, percept: Percept, features: Float32) -> None:
        """Remember what is perceived, then fill the features."""
        self.hear(percept)
        self._policy.look(features)

    def actions(self, output: Float32) -> Float32:
        """Those of the policy, which is told what it did."""
        action = self._policy.steered(self._percept, self._policy.trim(output))
        self._policy.acted(action, self._policy.active)
        self.changed[...] = self._policy.memory.filtered[:, :, 0]
        return action

    def snapshot(self) -> Arrays:
        """What is remembered."""
        return self._policy.snapshot()

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Remember it again."""
        self._policy.restore(snapshot)


ACTING: dict[Sees, type[Forces] | type[Trims]] = {"percept": Forces, "memory": Trims}
"""How actors act, by what they see."""
