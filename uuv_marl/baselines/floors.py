"""Floors that every other policy must beat: random actions, and none."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.policy import Policy
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario

Float32 = NDArray[np.float32]


class Random(Policy):
    """A new force, uniform on the disc of possible ones, for every vehicle at every decision."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        super().__init__(scenario, num_worlds)
        self._rngs: list[np.random.Generator] = []
        self.reset()

    def forget(self, worlds: Sequence[int], seeds: Sequence[int]) -> None:
        """Start the random streams of these worlds; never the stream that the world itself draws from."""
        if not self._rngs:
            self._rngs = [np.random.default_rng()] * self.num_worlds
        for w, seed in zip(worlds, seeds, strict=True):
            self._rngs[w] = np.random.default_rng((seed, 1))

    def act(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        n = self.flat(percept).shape[1]
        drawn = np.stack([rng.random((n, 2)) for rng in self._rngs])
        radius, angle = np.sqrt(drawn[..., 0]), 2.0 * math.pi * drawn[..., 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).astype(np.float32)


class Idle(Policy):
    """No force at all."""

    def act(self, percept: Percept) -> Float32:
        """Zeros of shape (world, vehicle, 2)."""
        return np.zeros((*self.flat(percept).shape[:2], 2), np.float32)
