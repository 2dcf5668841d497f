"""Exploration noise: vehicles of a world share a part of it, and a part of it is left at the next decision."""

import math
from collections.abc import Iterator

import numpy as np

from uuv_marl.types import Float32, Int64


def exploration(rng: np.random.Generator, world: Int64, outputs: int, shared: float, kept: float) -> Iterator[Float32]:
    """Standard normal numbers for the outputs of each decision, shape (row, output), without end.

    Args:
        rng: draws them.
        world: of each row, counted from 0 without gaps, shape (row,).
        outputs: of the actor.
        shared: share of the variance that all rows of a world have in common, 0 to 1.
        kept: share of the noise that is left at the next decision, 0 to 1.
    """
    own = _lasting(rng, (len(world), outputs), kept)
    if shared == 0.0:
        yield from own
    common = _lasting(rng, (int(world[-1]) + 1, outputs), kept)
    for mine, ours in zip(own, common, strict=True):
        drawn = ours[world]
        drawn *= math.sqrt(shared)
        drawn += math.sqrt(1.0 - shared) * mine
        yield drawn


def _lasting(rng: np.random.Generator, shape: tuple[int, int], kept: float) -> Iterator[Float32]:
    """Standard normal numbers of a shape, of which ``kept`` is left at the next decision."""
    noise = rng.standard_normal(shape, np.float32)
    while True:
        yield noise
        fresh = rng.standard_normal(shape, np.float32)
        fresh *= math.sqrt(1.0 - kept * kept)
        fresh += kept * noise
        noise = fresh
