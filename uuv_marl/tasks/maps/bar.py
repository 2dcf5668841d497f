"""``bar``: a wall from one bank past the middle, open at the other bank; straight or bent."""

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, Share, between, joined, side, wall
from uuv_marl.types import Float64

_MIDDLE, _ASLANT_M = 0.4, 25.0
"""How far from the middle it bends, as a share of the banks' distance; how far its tip is ahead of its foot, or behind
[m]. Assumed, as piloted."""


class Bar(MapKind):
    """Where the open side is, nobody knows before he comes there."""

    open_m: Range
    """Width of the open water at its end."""
    bent: Share
    """Share of maps in which it is bent."""
    bend_m: Range
    """How far its bend is ahead of its foot, or behind."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Two walls that meet somewhere around the middle."""
        radius, x, bank = between(rng, self.radius_m), between(rng, (water.near, water.far)), side(rng)
        end = -bank * (water.half - between(rng, self.open_m) - radius)
        bend = side(rng) * between(rng, self.bend_m) if rng.random() < self.bent else 0.0
        middle = (water.ahead(x + bend), between(rng, (-_MIDDLE, _MIDDLE)) * water.half)
        tip = (water.ahead(x + between(rng, (-_ASLANT_M, _ASLANT_M))), end)
        return joined(wall((x, bank * (water.half + INTO_BANK_M)), middle, radius), wall(middle, tip, radius))
