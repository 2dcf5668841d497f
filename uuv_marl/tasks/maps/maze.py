"""``maze``: several bars one behind the other, from banks drawn at random."""

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, between, joined, side, wall
from uuv_marl.types import Float64


class Maze(MapKind):
    """Two or three bars."""

    open_m: Range
    """Width of the open water at the end of each."""
    apart_m: Range
    """From one to the next."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Bars that begin at either bank; the next one more often at the other."""
        radius, bank, x = between(rng, self.radius_m), side(rng), water.near
        made: list[Float64] = []
        for _ in range(int(rng.integers(2, 4))):
            if x > water.far:
                break
            end = -bank * (water.half - between(rng, self.open_m) - radius)
            tip = water.ahead(x + float(rng.uniform(-12.0, 12.0)))
            made.append(wall((x, bank * (water.half + INTO_BANK_M)), (tip, end), radius))
            bank, x = side(rng) if rng.random() < 0.5 else -bank, x + between(rng, self.apart_m)
        return joined(*made)
