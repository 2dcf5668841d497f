"""Networks of the first trainer, which `mappo` and `ppo` are: a force from features, beside a fixed barrier."""

from collections.abc import Sequence

import numpy as np

from uuv_marl.baselines.learned.actor import need_same
from uuv_marl.baselines.learned.checkpoint import Checkpoint, Layer
from uuv_marl.baselines.learned.layers import dense
from uuv_marl.baselines.learned.percept_features import Features
from uuv_marl.baselines.policy import Policy
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.vehicle import project
from uuv_marl.types import Float32


class Learned(Policy):
    """A checkpoint's actor: tanh layers from local, body-frame features to a force, plus the barrier. Deterministic.

    Args:
        name: of the policy in messages.
        checkpoint: the actor, and what it was trained on.
        any_vehicle: whether it may run on a vehicle that it was not trained on.

    Raises:
        PolicyError: the scenario has another percept, period, inner loop or vehicle than the training had.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, name: str, checkpoint: Checkpoint, any_vehicle: bool = False
    ) -> None:
        self.name, self.checkpoint, card = name, checkpoint, checkpoint.card
        self.declare_as(card)
        super().__init__(scenario, num_worlds)
        need_same(self, card, any_vehicle)
        self._features = Features(scenario, card.barrier)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        acting = np.flatnonzero(self.active)
        flat = self.flat(percept)
        worlds, n = len(acting), flat.shape[1]
        features, barrier = np.empty((worlds, n, self._features.size), np.float32), np.empty((worlds, n, 2), np.float32)
        clamps = np.zeros(worlds, np.int64)
        self._features.look(flat[acting], features, barrier, clamps)
        self.clamps[acting] += clamps
        wish = forward(self.checkpoint.layers, features.reshape(worlds * n, -1))
        action = np.empty((worlds * n, 2), np.float32)
        _add(wish, barrier.reshape(worlds * n, 2), action)
        whole = np.zeros((len(self.active), n, 2), np.float32)
        whole[acting] = action.reshape(worlds, n, 2)
        return whole


def forward(layers: Sequence[Layer], x: Float32) -> Float32:
    """The network's output (row, out) for inputs (row, in): tanh between layers, none after the last.

    A row's result does not depend on the rows beside it, which a BLAS library does not promise.
    """
    for k, layer in enumerate(layers):
        y = np.empty((len(x), len(layer.bias)), np.float32)
        dense(x, layer.weight, layer.bias, y)
        x = np.tanh(y) if k < len(layers) - 1 else y
    return x


@compiled
def _add(wish: Float32, barrier: Float32, action: Float32) -> None:
    """Body-frame shares of full force, summed and projected onto the unit disc."""
    for i in range(wish.shape[0]):
        a_x, a_y = project(wish[i, 0] + barrier[i, 0], wish[i, 1] + barrier[i, 1])
        action[i, 0], action[i, 1] = a_x, a_y
