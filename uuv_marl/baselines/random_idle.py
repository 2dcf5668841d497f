"""Floors that every other policy must beat: random actions, and no actions."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike, world_seeds
from uuv_marl.sim.streams import packed, unpacked
from uuv_marl.types import Float32


class Random(Policy):
    """A new force, uniform on the disc of possible ones, for every vehicle at every decision."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        super().__init__(scenario, num_worlds)
        self._rngs = [np.random.default_rng()] * num_worlds
        self.reset()

    def reset(self, seed: SeedLike = 0, worlds: Sequence[int] | None = None) -> None:
        """Start the random streams of these worlds; never the stream that the world itself draws from."""
        super().reset(seed, worlds)
        chosen = list(range(self.num_worlds) if worlds is None else worlds)
        for w, own in zip(chosen, world_seeds(seed, chosen), strict=True):
            self._rngs[w] = np.random.default_rng((own or 0, 1))

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """A copy of all that later decisions depend on, random streams included."""
        return super().snapshot() | {"streams": packed(self._rngs)}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Continue from a snapshot. Raises PolicyError if it is another policy's."""
        super().restore(snapshot)
        try:
            streams = unpacked(snapshot["streams"], self.num_worlds)
        except (KeyError, ValueError) as error:
            raise PolicyError(f"the snapshot is of another policy than {self.name}: {error}") from None
        self._rngs = [stream or np.random.default_rng() for stream in streams]

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        n = self.flat(percept).shape[1]
        drawn = np.stack([rng.random((n, 2)) for rng in self._rngs])
        radius, angle = np.sqrt(drawn[..., 0]), 2.0 * math.pi * drawn[..., 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).astype(np.float32)


class Idle(Policy):
    """No force at all."""

    def decide(self, percept: Percept) -> Float32:
        """Zeros of shape (world, vehicle, 2)."""
        return np.zeros((*self.flat(percept).shape[:2], 2), np.float32)
