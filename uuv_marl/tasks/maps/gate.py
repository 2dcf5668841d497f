"""``gate``: a wall from bank to bank with one gap."""

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, Share, between, joined, wall
from uuv_marl.types import Float64

_ASLANT = 0.25
"""Largest slant of the wall, ahead over across [1]. Assumed, as piloted."""


class Gate(MapKind):
    """A single gap, anywhere within a share of the width."""

    gap_m: Range
    """Width of the gap."""
    within: Share
    """How far from the middle it may lie, as a share of the banks' distance."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Two walls, a little aslant."""
        radius, gap = between(rng, self.radius_m), between(rng, self.gap_m)
        at, x = between(rng, (-1.0, 1.0)) * self.within * water.half, between(rng, (water.near, water.far))
        aslant, bank = between(rng, (-_ASLANT, _ASLANT)), water.half + INTO_BANK_M

        def on(y: float) -> tuple[float, float]:
            return water.ahead(x + aslant * y), y

        left, right = at - gap / 2 - radius, at + gap / 2 + radius
        parts = [(-bank, left)] * (left > -bank) + [(right, bank)] * (right < bank)
        return joined(*(wall(on(a), on(b), radius) for a, b in parts))
