"""Learned policies: an actor from a checkpoint, in NumPy, beside a fixed short-range barrier."""

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from uuv_marl.baselines.checkpoint import Card, Checkpoint, Layer, load_checkpoint, rows_of, save_checkpoint, vehicle_of
from uuv_marl.baselines.features import Features
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import Float32
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.vehicle import project

__all__ = ["Card", "Layer", "Learned", "Trained", "forward", "rows_of", "save_checkpoint", "shipped"]


class Learned(Policy):
    """A checkpoint's actor: tanh layers from local, body-frame features to a force, plus the barrier. Deterministic.

    Args:
        scenario: gives the percept's layout and the vehicle's limits.
        num_worlds: first axis of the percepts.
        trained: the actor, and the name by which messages call it.
        any_vehicle: run it also on a vehicle that it was not trained on.

    Raises:
        PolicyError: the scenario has another percept, period, inner loop or vehicle than the training had.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, trained: "Trained", any_vehicle: bool = False
    ) -> None:
        self.name, self.checkpoint, card = trained.name, trained.checkpoint, trained.checkpoint.card
        self.channels, self.yaw_damping_nms = card.channels, card.yaw_damping_nms  # pyright: ignore[reportAttributeAccessIssue] - an instance's own
        super().__init__(scenario, num_worlds)
        then, now = ({f"field {k}": row for k, row in enumerate(rows)} for rows in (card.percept, rows_of(self.layout)))
        self._need_same("percept", then, now, "use a scenario with the sonar suite of its training")
        if not any_vehicle:
            remedy = "leave it out, run it all the same with make(..., any_vehicle=True)"
            self._need_same("vehicle", card.vehicle, vehicle_of(scenario), remedy)
        shortest, longest = card.decision_period_s
        if not shortest - 1e-9 <= scenario.timing.decision_period_s <= longest + 1e-9:
            raise PolicyError(
                f"{self.name} decides every {shortest:g} to {longest:g} s, and scenario {scenario.name!r} every "
                f"{scenario.timing.decision_period_s:g} s; override timing.decision_period_s"
            )
        self._features = Features(scenario, card.barrier)

    def _need_same(self, what: str, then: Mapping[str, object], now: Mapping[str, object], remedy: str) -> None:
        """Raise PolicyError where the scenario differs from that of the training.

        Args:
            what: is compared, for the message.
            then: its entries in the training, by name.
            now: its entries in the scenario, by name.
            remedy: for the message.
        """
        other = next((name for name in {**then, **now} if then.get(name) != now.get(name)), None)
        if other:
            raise PolicyError(
                f"{self.name} was trained on another {what} than scenario {self.scenario.name!r} has: {other} was "
                f"{then.get(other)} and is {now.get(other)}; {remedy}, or train on this one (uuv-marl train mappo "
                "--scenario)"
            )

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


class Trained:
    """A learned policy before it is made for a scenario: call it with the arguments of ``Learned``.

    Args:
        name: by which messages call it.
        path: of the checkpoint, a file or the folder that holds it; read when something of it is asked for.
        doc: what it is.
    """

    def __init__(self, name: str, path: Path, doc: str | None = Learned.__doc__) -> None:
        self.name, self._path, self.__doc__ = name, path, doc

    @functools.cached_property
    def checkpoint(self) -> Checkpoint:
        """What the file holds. Raises PolicyError where that is no policy."""
        return load_checkpoint(self._path)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels needed beyond the percept."""
        return self.checkpoint.card.channels

    @property
    def yaw_damping_nms(self) -> float:
        """Inner loop that it was trained with [N m s]."""
        return self.checkpoint.card.yaw_damping_nms

    def __call__(self, scenario: Scenario, num_worlds: int = 1, *, any_vehicle: bool = False) -> Learned:
        """The policy for a scenario. Raises PolicyError as ``Learned`` does."""
        return Learned(scenario, num_worlds, trained=self, any_vehicle=any_vehicle)


def shipped(name: str, doc: str) -> Trained:
    """The policy of a checkpoint in ``uuv_marl/baselines/trained``."""
    return Trained(name, Path(__file__).parent / "trained" / f"{name}.safetensors", doc)


def forward(layers: Sequence[Layer], x: Float32) -> Float32:
    """The network's output (row, out) for inputs (row, in): tanh between layers, none after the last.

    A row's result does not depend on the rows beside it, which a BLAS library does not promise.
    """
    for k, layer in enumerate(layers):
        y = np.empty((len(x), len(layer.bias)), np.float32)
        _dense(x, layer.weight, layer.bias, y)
        x = np.tanh(y) if k < len(layers) - 1 else y
    return x


@compiled
def _dense(x: Float32, weight: Float32, bias: Float32, out: Float32) -> None:
    """A layer without its activation.

    Args:
        x: shape (row, in).
        weight: shape (in, out).
        bias: shape (out,).
        out: filled, shape (row, out).
    """
    for i in range(x.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = bias[k]
        for j in range(x.shape[1]):
            value = x[i, j]
            if value != 0.0:  # most sub-sectors hear nobody
                for k in range(out.shape[1]):
                    out[i, k] += value * weight[j, k]


@compiled
def _add(wish: Float32, barrier: Float32, action: Float32) -> None:
    """Body-frame shares of full force, summed and projected onto the unit disc."""
    for i in range(wish.shape[0]):
        a_x, a_y = project(wish[i, 0] + barrier[i, 0], wish[i, 1] + barrier[i, 1])
        action[i, 0], action[i, 1] = a_x, a_y
