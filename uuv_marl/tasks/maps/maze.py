"""``maze``: several bars one behind the other, from banks drawn at random."""

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, between, joined, side, wall
from uuv_marl.types import Float64

_ASLANT_M, _SAME_BANK = 12.0, 0.25
"""How far the tip of a bar is ahead of its foot, or behind [m]; share of bars that begin at the bank of the one before.
Assumed, as piloted."""


class Maze(MapKind):
    """Two or three bars."""

    open_m: Range
    """Width of the open water at the end of each."""
    apart_m: Range
    """From one to the next."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Bars that begin at either bank; the next one more often at the other."""
        radius, bank, x = between(rng, self.radius_m), side(rng), water.near
        rows: list[Float64] = []
        for _ in range(int(rng.integers(2, 4))):
            if x > water.far:
                break
            end = -bank * (water.half - between(rng, self.open_m) - radius)
            tip = water.ahead(x + between(rng, (-_ASLANT_M, _ASLANT_M)))
            rows.append(wall((x, bank * (water.half + INTO_BANK_M)), (tip, end), radius))
            bank, x = bank if rng.random() < _SAME_BANK else -bank, x + between(rng, self.apart_m)
        return joined(*rows)
