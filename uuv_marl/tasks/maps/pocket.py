"""``pocket``: a dead end that is open towards the swarm; on one side it is mostly closed to the bank."""

from itertools import pairwise

import numpy as np

from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, Share, between, joined, side, wall
from uuv_marl.types import Float64

_OFF, _BACK, _PASS_M = 0.25, 0.2, 16.0
"""Largest place aside, as a share of the banks' distance; least width of the back, as a share of the mouth's; least
water between mouth and bank [m]. Assumed, as piloted."""


class Pocket(MapKind):
    """A U or a V."""

    depth_m: Range
    """From its mouth to its back."""
    half_width_m: Range
    """Half the width of its mouth."""
    closed: Share
    """Share of maps in which one of its sides is closed to the bank, so that only the other way leads past it."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Three walls, and the one to the bank."""
        radius, depth = between(rng, self.radius_m), between(rng, self.depth_m)
        x = between(rng, (min(water.near + depth, water.far), water.far))
        off = side(rng) * rng.uniform(0.0, _OFF) * water.half
        mouth = min(between(rng, self.half_width_m), water.half - abs(off) - _PASS_M)
        back = mouth * rng.uniform(_BACK, 1.0)
        front = water.ahead(x - depth)
        corners = [(front, off - mouth), (x, off - back), (x, off + back), (front, off + mouth)]
        sides = [wall(a, b, radius) for a, b in pairwise(corners)]
        if rng.random() < self.closed:
            which = side(rng)
            sides.append(wall(
                corners[3] if which > 0 else corners[0],
                (between(rng, (front, x)), which * (water.half + INTO_BANK_M)), radius,
            ))  # fmt: skip
        return joined(*sides)
