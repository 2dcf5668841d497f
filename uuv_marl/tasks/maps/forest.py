"""``forest``: single discs everywhere, no nearer to each other than a gap."""

import numpy as np

from uuv_marl.sim.start import scatter
from uuv_marl.tasks.maps.walls import Basin, MapKind, Range, between
from uuv_marl.types import Float64

_TRIES, _MOST = 2000, 160
"""Discs that are tried, and most that are kept. Assumed: until hardly any finds a place."""
_CLEAR_M = 40.0
"""Around the goal [m]. Assumed: less than behind walls, since each vehicle finds its own place between discs."""


class Forest(MapKind):
    """As many discs as find a place."""

    gap_m: Range
    """Smallest gap between two of them."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Discs from where walls may stand up to the goal's free water."""
        gap, tried = between(rng, self.gap_m), rng.random((_TRIES, 3))
        low = np.array([water.near, -water.half, self.radius_m[0]])
        high = np.array([water.length - _CLEAR_M - self.radius_m[1], water.half, self.radius_m[1]])
        placed = np.zeros((_MOST, 3))
        return placed[: scatter(low + (high - low) * tried, gap, placed)]

    def blocks(self) -> bool:
        """No: between the discs every way is open."""
        return False
