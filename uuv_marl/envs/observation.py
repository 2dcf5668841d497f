"""The observation: every vehicle's percept, scaled by the table in ``uuv_marl.percept``."""

import numpy as np

from uuv_marl.percept import Percept
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float32


def observe(percept: Percept) -> Float32:
    """What all vehicles observe, a new array (world, vehicle, entry): ``Percept.to_observation``, compiled."""
    if len(percept.flat) == 1:
        return percept.to_observation()
    observation = np.empty_like(percept.flat)
    _scale(percept.flat, np.float32(1.0) / percept.layout.scale, observation)
    return observation


@compiled
def _scale(flat: Float32, inverse: Float32, observation: Float32) -> None:
    """Scales are powers of two: a product with the inverse has the quotient's bits."""
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            for k in range(flat.shape[2]):
                observation[w, i, k] = flat[w, i, k] * inverse[k]
