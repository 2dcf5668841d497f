"""``forest``: single discs everywhere, no nearer to each other than a gap."""

import numpy as np

from uuv_marl.tasks.maps.walls import Kind, Range, Water, joined, uniform
from uuv_marl.types import Float64

_TRIES, _MOST = 2000, 160
_CLEAR_M = 40.0
"""Around the goal [m]. Assumed: less than behind walls, since each vehicle finds its own place between discs."""


class Forest(Kind):
    """As many discs as find a place."""

    gap_m: Range
    """Smallest gap between two of them."""

    def walls(self, rng: np.random.Generator, water: Water) -> Float64:
        """Discs from just ahead of the start up to the goal's free water."""
        gap, low, high = uniform(rng, self.gap_m), 60.0, water.length - _CLEAR_M - self.radius_m[1]
        drawn = rng.random((_TRIES, 3))
        x, y = low + (high - low) * drawn[:, 0], water.half * (2.0 * drawn[:, 1] - 1.0)
        radius = self.radius_m[0] + (self.radius_m[1] - self.radius_m[0]) * drawn[:, 2]
        placed = np.zeros((0, 3))
        for disc in np.stack([x, y, radius], axis=1):
            away = (placed[:, 0] - disc[0]) ** 2 + (placed[:, 1] - disc[1]) ** 2
            if (away >= (placed[:, 2] + disc[2] + gap) ** 2).all():
                placed = np.concatenate([placed, disc[None]])
                if len(placed) == _MOST:
                    break
        return joined(placed)

    def blocks(self) -> bool:
        """No: between the discs every way is open."""
        return False
