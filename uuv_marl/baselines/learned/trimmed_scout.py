"""A learned policy with memory: a network trims the steering of ``scout``, and the filter has the last word.

The network says how softly each vehicle steers at each decision, as far as its actuators lag (``memory.doubt``): not at
all where they answer at once. If the network gives zeros, the policy is the law.
"""

import numpy as np

from uuv_marl.baselines.learned.actor import need_same
from uuv_marl.baselines.learned.checkpoint import Checkpoint
from uuv_marl.baselines.learned.memory_features import NUM_MEMORY_FEATURES, fill_memory_features
from uuv_marl.baselines.learned.network import forward
from uuv_marl.baselines.scout.law import Scout
from uuv_marl.baselines.scout.trims import MOST_TRIM, heeded
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.types import Bool, Float32


class TrimmedScout(Scout):
    """``scout``'s law, which an actor trims."""

    num_trims = 1

    def look(self, features: Float32, rows: Bool | None = None) -> None:
        """Fill the features of the memory that an actor sees.

        Args:
            features: filled, shape (world, vehicle, ``NUM_MEMORY_FEATURES``).
            rows: the vehicles that are looked at, shape (world, vehicle); all of the running worlds unless given.
        """
        if rows is None:
            rows = np.broadcast_to(self.active[:, None], features.shape[:2]).copy()
        fill_memory_features(
            rows, self.scenario.swarm.num_vehicles, self.model.own.period_s, self.grown(), self.barrier,
            self.limits, self.memory, self.planes, features,
        )  # fmt: skip

    def trim(self, output: Float32) -> Float32:
        """The actions, shape (world, vehicle, 2), for an actor's output, shape (world, vehicle, 1)."""
        self._trims[...] = np.clip(output, -MOST_TRIM, MOST_TRIM)
        return self._decided()


class LearnedScout(TrimmedScout):
    """A checkpoint's actor inside ``scout``'s law, memory and filter, made as ``network.Learned`` is. Deterministic."""

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, name: str, checkpoint: Checkpoint, any_vehicle: bool = False
    ) -> None:
        self.name, self.checkpoint, card = name, checkpoint, checkpoint.card
        self.declare_as(card)
        super().__init__(scenario, num_worlds, gains=card.law, barrier=card.safety)
        need_same(self, card, any_vehicle)
        worlds_and_vehicles = self._trims.shape[:2]
        self._features = np.zeros((*worlds_and_vehicles, NUM_MEMORY_FEATURES), np.float32)
        self._heeded = np.zeros(worlds_and_vehicles, np.bool_)

    def decide(self, percept: Percept) -> Float32:  # noqa: ARG002 - it was remembered
        """Actions of shape (world, vehicle, 2). The network is asked only where its output counts."""
        heeded(self.active, float(self.gains.lead), self.memory, self._heeded)
        self.look(self._features, self._heeded)
        output = np.zeros(self._trims.shape, np.float32)
        output[self._heeded] = forward(self.checkpoint.layers, self._features[self._heeded])
        return self.trim(output)
