"""Baselines that every other policy must beat: random actions, and no actions."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike, world_seeds
from uuv_marl.sim.random import packed, unpacked
from uuv_marl.types import Bool, Float32


class RandomMemory(NamedTuple):
    """The latest random actions."""

    drawn: Annotated[Float32, "world vehicle entry", "Shares of full force, and a message [1]."]
    started: Annotated[Bool, "world", "Whether the world's random stream has started in this episode."]


class Random(Policy):
    """A new force, uniform on the unit disc, and a random message for every vehicle at every decision.

    An episode's random stream starts from its seed, or from that of an earlier ``reset(seed)``; it differs from the
    stream of the world itself.
    """

    Memory: ClassVar[type[Any] | None] = RandomMemory

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        self.axes = {"entry": scenario.action_size}
        super().__init__(scenario, num_worlds)
        self._rngs: list[np.random.Generator | None] = [None] * num_worlds

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> None:
        """Clear the memory of these worlds; a seed is that of their next episodes."""
        super().reset(seed, worlds)
        chosen = list(range(self.num_worlds) if worlds is None else worlds)
        for w, own in zip(chosen, world_seeds(seed, chosen), strict=True):
            self._rngs[w] = None if own is None else _stream(own)

    def _forget(self, worlds: list[int] | Bool) -> None:
        chosen = np.zeros(self.num_worlds, np.bool_)
        chosen[worlds] = True
        for w in np.flatnonzero(chosen & self.memory.started).tolist():
            self._rngs[w] = None  # but not one that ``reset`` has just seeded
        super()._forget(worlds)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Draw the actions of these worlds."""
        action, clock = self.memory.drawn, percept.clock
        for w in np.flatnonzero(worlds).tolist():
            rng = self._rngs[w] = self._rngs[w] or _stream(0 if clock is None else int(clock.seed[w]))
            drawn = rng.random((action.shape[1], 2))
            radius, angle = np.sqrt(drawn[:, 0]), 2.0 * math.pi * drawn[:, 1]
            action[w, :, :2] = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
            action[w, :, 2:] = rng.uniform(-1.0, 1.0, action[w, :, 2:].shape)
        self.memory.started[worlds] = True

    def decide(self, percept: Percept) -> Float32:  # noqa: ARG002 - random actions see nothing
        """Actions of shape (world, vehicle, ``scenario.action_size``)."""
        return self.memory.drawn.copy()

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """A copy of all state that later decisions depend on, random streams included."""
        return super().snapshot() | {"streams": packed(self._rngs)}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Continue from a snapshot. Raises PolicyError if it is another policy's."""
        super().restore(snapshot)
        try:
            self._rngs = unpacked(snapshot["streams"], self.num_worlds)
        except (KeyError, ValueError) as error:
            raise PolicyError(f"the snapshot is of another policy than {self.name}: {error}") from None


def _stream(seed: int) -> np.random.Generator:
    return np.random.default_rng((seed, 1))


class Idle(Policy):
    """No force."""

    def decide(self, percept: Percept) -> Float32:
        """Zeros of shape (world, vehicle, 2)."""
        return np.zeros((*self.flat(percept).shape[:2], 2), np.float32)
