"""Kinds of maps of ``hard_water``: walls of discs in closed water. Constants are assumed, and were tried by hand."""

from itertools import pairwise
from typing import ClassVar

import numpy as np

from uuv_marl.sim.episode_setup import scatter
from uuv_marl.tasks.maps.walls import INTO_BANK_M, Basin, MapKind, Range, Share, Span, between, joined, side, wall
from uuv_marl.types import Float64

_POCKET_OFF, _POCKET_BACK, _POCKET_PASS_M = 0.25, 0.2, 16.0
"""Largest offset from the middle, as a share of the banks' distance; least width of the back, as a share of the
mouth's; least gap between mouth and bank [m]."""
_BAR_MIDDLE, _BAR_SLANT_M = 0.4, 25.0
"""Largest offset of the bend, as a share of the banks' distance; of the tip from the foot, ahead or behind [m]."""
_GATE_SLANT = 0.25
"""Largest slant of the wall, ahead over across [1]."""
_FOREST_TRIES, _FOREST_DISCS = 2000, 160
"""Discs that are tried, until few find a place, and the most that are kept."""
_FOREST_CLEAR_M = 40.0
"""Clearance around the goal [m], less than behind walls, since each vehicle finds its own place between discs."""
_MAZE_SLANT_M, _MAZE_SAME_BANK = 12.0, 0.25
"""Offset of a bar's tip from its foot, ahead or behind [m]; share of bars from the bank of the previous one."""
_PIER_FIRST_M, _PIER_FREE_M, _MOLE_OFF = 20.0, 10.0, 0.3
"""Largest distance of the first pier [m]; least distance of a pier's head from the middle [m]; largest offset of the
mole, as a share of half its length."""
_PILES_SLANT = 0.15
"""Largest slant of the grid, ahead over across [1]."""


class Pocket(MapKind):
    """A dead end, U or V, open towards the swarm."""

    depth_m: Range
    """Distance from its mouth to its back."""
    half_width_m: Range
    """Half the width of its mouth."""
    closed: Share
    """Share of maps in which one of its sides is closed to the bank, so that only the other side can be passed."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Three walls, and a fourth to the bank."""
        radius, depth = between(rng, self.radius_m), between(rng, self.depth_m)
        x = between(rng, (min(water.near + depth, water.far), water.far))
        off = side(rng) * rng.uniform(0.0, _POCKET_OFF) * water.half
        mouth = min(between(rng, self.half_width_m), water.half - abs(off) - _POCKET_PASS_M)
        back = mouth * rng.uniform(_POCKET_BACK, 1.0)
        front = water.ahead(x - depth)
        corners = [(front, off - mouth), (x, off - back), (x, off + back), (front, off + mouth)]
        sides = [wall(a, b, radius) for a, b in pairwise(corners)]
        if rng.random() < self.closed:
            which = side(rng)
            bank = between(rng, (front, x)), which * (water.half + INTO_BANK_M)
            sides.append(wall(corners[3] if which > 0 else corners[0], bank, radius))
        return joined(*sides)


class Bar(MapKind):
    """A wall from one bank past the middle, open at the other bank, straight or bent."""

    open_m: Range
    """Width of the open water at its end."""
    bent: Share
    """Share of maps in which it is bent."""
    bend_m: Range
    """Offset of its bend from its foot, ahead or behind."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Two walls that meet near the middle."""
        radius, x, bank = between(rng, self.radius_m), between(rng, (water.near, water.far)), side(rng)
        end = -bank * (water.half - between(rng, self.open_m) - radius)
        bend = side(rng) * between(rng, self.bend_m) if rng.random() < self.bent else 0.0
        middle = (water.ahead(x + bend), between(rng, (-_BAR_MIDDLE, _BAR_MIDDLE)) * water.half)
        tip = (water.ahead(x + between(rng, (-_BAR_SLANT_M, _BAR_SLANT_M))), end)
        return joined(wall((x, bank * (water.half + INTO_BANK_M)), middle, radius), wall(middle, tip, radius))


class Gate(MapKind):
    """A wall from bank to bank with a single gap."""

    gap_m: Range
    """Width of the gap."""
    within: Share
    """Largest offset of the gap from the middle, as a share of the banks' distance."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Two walls, slightly slanted."""
        radius, gap = between(rng, self.radius_m), between(rng, self.gap_m)
        at, x = between(rng, (-1.0, 1.0)) * self.within * water.half, between(rng, (water.near, water.far))
        aslant, bank = between(rng, (-_GATE_SLANT, _GATE_SLANT)), water.half + INTO_BANK_M

        def on(y: float) -> tuple[float, float]:
            return water.ahead(x + aslant * y), y

        left, right = at - gap / 2 - radius, at + gap / 2 + radius
        parts = [(-bank, left)] * (left > -bank) + [(right, bank)] * (right < bank)
        return joined(*(wall(on(a), on(b), radius) for a, b in parts))


class Forest(MapKind):
    """As many single discs as find a place."""

    blocks: ClassVar[bool] = False  # paths lead between the discs everywhere
    gap_m: Range
    """Smallest gap between two of them."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Discs from the nearest place of a wall up to the clear water around the goal."""
        gap, tried = between(rng, self.gap_m), rng.random((_FOREST_TRIES, 3))
        low = np.array([water.near, -water.half, self.radius_m[0]])
        high = np.array([water.length - _FOREST_CLEAR_M - self.radius_m[1], water.half, self.radius_m[1]])
        placed = np.zeros((_FOREST_DISCS, 3))
        return placed[: scatter(low + (high - low) * tried, gap, placed)]


class Maze(MapKind):
    """Two or three bars, one behind the other."""

    open_m: Range
    """Width of the open water at the end of each."""
    apart_m: Range
    """Distance from one to the next."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Bars from either bank, mostly from alternating ones."""
        radius, bank, x = between(rng, self.radius_m), side(rng), water.near
        rows: list[Float64] = []
        for _ in range(int(rng.integers(2, 4))):
            if x > water.far:
                break
            end = -bank * (water.half - between(rng, self.open_m) - radius)
            tip = water.ahead(x + between(rng, (-_MAZE_SLANT_M, _MAZE_SLANT_M)))
            rows.append(wall((x, bank * (water.half + INTO_BANK_M)), (tip, end), radius))
            bank, x = bank if rng.random() < _MAZE_SAME_BANK else -bank, x + between(rng, self.apart_m)
        return joined(*rows)


class Harbour(MapKind):
    """Piers perpendicular to the banks, with dead ends between them, and a mole across the middle."""

    pier_m: Range
    """Length of a pier from the bank."""
    basin_m: Span
    """Width of a basin, from pier to pier."""
    mole_m: Range
    """Length of the mole, which reaches neither bank."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Piers along both banks, and the mole."""
        radius, piers = between(rng, self.radius_m), list[Float64]()
        for bank in (1.0, -1.0):
            x = water.near + rng.uniform(0.0, _PIER_FIRST_M)
            while x < water.far:
                tip = bank * max(water.half - between(rng, self.pier_m), _PIER_FREE_M)
                piers.append(wall((x, bank * (water.half + INTO_BANK_M)), (x, tip), radius))
                x += between(rng, self.basin_m) + 2.0 * radius
        x, half = between(rng, (water.near, water.far)), between(rng, self.mole_m) / 2.0
        middle = side(rng) * between(rng, (0.0, _MOLE_OFF)) * half
        piers.append(wall((x, middle - half), (x, middle + half), radius))
        return joined(*piers)


class Piles(MapKind):
    """A grid of piles from bank to bank, some of them joined by bracing."""

    apart_m: Span
    """Distance from pile to pile, along and across."""
    braced: Share
    """Share of neighbouring piles in a row that a wall joins."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Rows of piles across the water, slightly slanted."""
        apart, radius = between(rng, self.apart_m), between(rng, self.radius_m)
        rows = max(1, int((water.far - water.near) // apart) + 1)
        columns = int(water.half // apart)
        aslant = between(rng, (-_PILES_SLANT, _PILES_SLANT))
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


KINDS: dict[str, type[MapKind]] = {
    "pocket": Pocket, "bar": Bar, "gate": Gate, "forest": Forest, "maze": Maze, "harbour": Harbour, "piles": Piles,
}  # fmt: skip
"""Every kind of map by name."""
