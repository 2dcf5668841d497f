"""``harbour``: finger piers from both banks with basins between them, and a mole across the middle."""

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, Span, between, joined, side, wall
from uuv_marl.types import Float64

_FIRST_M, _FREE_M, _OFF = 20.0, 10.0, 0.3
"""Largest way to the first pier [m]; least way from a pier's head to the middle [m]; largest place of the mole aside,
as a share of half its length. Assumed."""


class Harbour(MapKind):
    """Piers stand square to the banks, every basin between two of them is a dead end."""

    pier_m: Range
    """Length of a pier from the bank."""
    basin_m: Span
    """Width of a basin, from pier to pier."""
    mole_m: Range
    """Length of the mole that lies across the way, off both banks."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Piers along both banks, and the mole between two of them."""
        radius, piers = between(rng, self.radius_m), list[Float64]()
        for bank in (1.0, -1.0):
            x = water.near + rng.uniform(0.0, _FIRST_M)
            while x < water.far:
                tip = bank * max(water.half - between(rng, self.pier_m), _FREE_M)
                piers.append(wall((x, bank * (water.half + INTO_BANK_M)), (x, tip), radius))
                x += between(rng, self.basin_m) + 2.0 * radius
        x, half = between(rng, (water.near, water.far)), between(rng, self.mole_m) / 2.0
        middle = side(rng) * between(rng, (0.0, _OFF)) * half
        piers.append(wall((x, middle - half), (x, middle + half), radius))
        return joined(*piers)
