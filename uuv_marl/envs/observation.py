"""The observation: every vehicle's percept, scaled by the table in ``uuv_marl.percept``."""

from collections.abc import Callable

import numpy as np

from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float32


def observer(percept: Percept) -> tuple[Float32, Callable[[int, int], None]]:
    """A new array (world, vehicle, entry), and what fills it, from the first to the end of a range of worlds.

    It holds ``Percept.to_observation`` of what ``percept.flat`` holds at that time.
    """
    observation, inverse = np.empty_like(percept.flat), np.float32(1.0) / percept.layout.scale
    return observation, lambda begin, end: _scale(begin, end, percept.flat, inverse, observation)


@compiled
def _scale(begin: int, end: int, flat: Float32, inverse: Float32, observation: Float32) -> None:
    """Scales are powers of two: a product with the inverse has the quotient's bits."""
    for w in range(begin, end):
        for i in range(flat.shape[1]):
            for k in range(flat.shape[2]):
                observation[w, i, k] = flat[w, i, k] * inverse[k]
