"""``forest``: single discs everywhere, no nearer to each other than a gap."""

import numpy as np

from uuv_marl.sim.compiled import compiled
from uuv_marl.tasks.maps.walls import Basin, MapKind, Range, between, joined
from uuv_marl.types import Float64

_TRIES, _MOST = 2000, 160
_CLEAR_M = 40.0
"""Around the goal [m]. Assumed: less than behind walls, since each vehicle finds its own place between discs."""


class Forest(MapKind):
    """As many discs as find a place."""

    gap_m: Range
    """Smallest gap between two of them."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Discs from just ahead of the start up to the goal's free water."""
        gap, low, high = between(rng, self.gap_m), 60.0, water.length - _CLEAR_M - self.radius_m[1]
        drawn = rng.random((_TRIES, 3))
        x, y = low + (high - low) * drawn[:, 0], water.half * (2.0 * drawn[:, 1] - 1.0)
        radius = self.radius_m[0] + (self.radius_m[1] - self.radius_m[0]) * drawn[:, 2]
        placed = np.zeros((_MOST, 3))
        num = _plant(np.stack([x, y, radius], axis=1), gap, placed)
        return joined(placed[:num])

    def blocks(self) -> bool:
        """No: between the discs every way is open."""
        return False


@compiled
def _plant(discs: Float64, gap: float, placed: Float64) -> int:
    """Fill ``placed`` with the discs that keep their gap [m] from all before them; how many were found."""
    num = 0
    for k in range(discs.shape[0]):
        if num == placed.shape[0]:
            break
        free = True
        for m in range(num):
            dx, dy, near = placed[m, 0] - discs[k, 0], placed[m, 1] - discs[k, 1], placed[m, 2] + discs[k, 2] + gap
            if dx * dx + dy * dy < near * near:
                free = False
                break
        if free:
            placed[num, 0], placed[num, 1], placed[num, 2] = discs[k, 0], discs[k, 1], discs[k, 2]
            num += 1
    return num
