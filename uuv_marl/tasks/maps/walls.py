"""Parts of maps: walls as rows of discs.

In a map's own frame, x ahead and y to starboard [m], the swarm starts around the origin, its goal lies ``length``
ahead, and the banks lie at ``half`` to each side. The complete map is then turned.
"""

from itertools import pairwise
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from uuv_marl.scenario.fields import ORDERED, NonNegative, Positive, Section, within
from uuv_marl.types import Float64

STEP = 1.6
"""Distance of two discs of a wall, in radii; notches between them are 0.4 radii deep. Assumed, tried by hand."""
INTO_BANK_M = 4.0
"""How far a wall extends into a bank [m]. Assumed, tried by hand; where a pier meets a notch of the bank, a hull may
pass behind it."""


Range = Annotated[tuple[NonNegative, NonNegative], ORDERED]
"""Lowest and highest value, between which each map samples its own."""
Span = Annotated[tuple[Positive, Positive], ORDERED]
"""The same, above 0."""

Share = Annotated[float, within(0, 1)]


class Basin(NamedTuple):
    """Closed water before its walls are sampled."""

    length: float
    """Distance from the start to the goal [m]."""
    half: float
    """Distance of each bank from the middle [m]."""
    near: float
    """Least distance of a wall ahead of the start [m]."""
    far: float
    """The largest [m]; the clear water of the goal begins there."""

    def ahead(self, x: float) -> float:
        """The distance nearest to ``x`` at which a wall may stand [m]."""
        return min(max(x, self.near), self.far)


class MapKind(Section):
    """Numbers of one kind of map."""

    blocks: ClassVar[bool] = True
    """Whether a map is accepted only if the straight path to the goal is blocked."""
    radius_m: Span
    """Radius of the discs that its walls are made of."""

    def walls(self, rng: np.random.Generator, water: Basin) -> Float64:
        """Discs, x, y and radius [m], shape (disc, 3). The same generator gives the same walls."""
        raise NotImplementedError


def between(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    """A number between two bounds."""
    return float(rng.uniform(*bounds))


def side(rng: np.random.Generator) -> float:
    """1 or -1."""
    return 1.0 if rng.random() < 0.5 else -1.0


def wall(start: tuple[float, float], end: tuple[float, float], radius: float) -> Float64:
    """A row of discs whose centres lead from one point to another, shape (disc, 3)."""
    a, b = np.array(start), np.array(end)
    offset = b - a
    num = max(1, int(np.ceil(np.sqrt(offset[0] * offset[0] + offset[1] * offset[1]) / (STEP * radius))))
    places = a + offset * (np.arange(num + 1)[:, None] / num)
    return np.concatenate([places, np.full((num + 1, 1), radius)], axis=1)


def joined(*walls: Any) -> Float64:
    """Walls as one array."""
    return np.concatenate([np.zeros((0, 3)), *walls])


def banks(length: float, half: float, behind: float, beyond: float, radius: float) -> Float64:
    """Large discs around the water, whose surfaces are its banks, shape (disc, 3), with this ``radius`` [m].

    Banks lie at ``half`` to the sides, ``behind`` the start and ``beyond`` the goal, which lies at ``length`` [m].
    """
    x = (-behind - radius, length + beyond + radius)
    y = (-half - radius, half + radius)
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]), (x[0], y[0])]
    return joined(*(wall(a, b, radius) for a, b in pairwise(corners)))
