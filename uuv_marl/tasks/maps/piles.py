"""``piles``: the grid of piles below a platform, some of them joined by bracing, which closes ways between them."""

import numpy as np

from uuv_marl.tasks.maps.walls import Basin, MapKind, Share, Span, between, joined, wall
from uuv_marl.types import Float64

_ASLANT = 0.15
"""Largest slant of the grid, ahead over across [1]. Assumed."""


class Piles(MapKind):
    """A grid that fills the water from bank to bank."""

    apart_m: Span
    """From pile to pile, along and across."""
    braced: Share
    """Share of neighbouring piles across the way that a wall joins."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Rows of piles across the way, turned a little as a whole."""
        apart, radius = between(rng, self.apart_m), between(rng, self.radius_m)
        rows = max(1, int((water.far - water.near) // apart) + 1)
        columns = int(water.half // apart)
        aslant = between(rng, (-_ASLANT, _ASLANT))
        joins = rng.random((rows, 2 * columns + 2)) < self.braced
        piles: list[Float64] = []
        for row in range(rows):
            places = [
                (water.ahead(water.near + row * apart + aslant * k * apart), k * apart)
                for k in range(-columns, columns + 1)
            ]
            piles.append(np.array([(*place, radius) for place in places]))
            piles += [wall(a, b, radius) for a, b, join in zip(places, places[1:], joins[row], strict=False) if join]
        return joined(*piles)
