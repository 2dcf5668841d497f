"""The sonar suite (Eq. 8-12): arrays of sub-sectors, and the table that finds a direction's sub-sector.

``perception.py`` computes echoes, ``detection.py`` detections of vehicles.

A direction is a vector in the body frame, x forward and y starboard. A sub-sector contains the directions clockwise of
its lower edge up to and including its upper edge, so that arrays that tile the circle cover every direction once. Signs
of cross products decide membership.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled_inline
from uuv_marl.types import Float64, Int64

_TINY = 1e-300
"""Avoids division by zero for a null vector."""
_MIN_BINS = 1024
"""Least number of bins, so that few directions fall into a bin with an edge."""


class SonarSuite(NamedTuple):
    """The arrays' sub-sectors, whose edges are unit vectors, and the table that finds a direction's sub-sector."""

    lower: Float64  # lower edge of each sub-sector, shape (sector, 2)
    upper: Float64  # upper edge of each sub-sector, shape (sector, 2)
    # Squared range of each sub-sector [m2], and -1 for directions outside all, shape (sector + 1,)
    squared_range: Float64
    # Sub-sector of each bin of direction, or sector + 1 + index of the edge in it, shape (layer, bin). The number of
    # bins is a power of two.
    codes: Int64
    edges: Float64  # edges between sub-sectors of a layer, shape (edge, 2)
    sides: Int64  # sub-sectors counter-clockwise and clockwise of each edge, shape (edge, 2)
    active: Int64  # the active sub-sectors, shape (active,)
    active_range: Float64  # their ranges [m], shape (active,)
    reach: float  # the longest of them [m], 0 for none
    # Lower and upper edge, unit vectors, of a cone around all active sub-sectors; zeros if not below 180 deg
    cone: tuple[float, float, float, float]
    reports_surface: bool  # whether an echo's position is the detected surface point, not the obstacle's centre
    obstacles_hide: bool  # whether an obstacle on the line of sight hides a vehicle


def suite(scenario: Scenario) -> SonarSuite:
    """Constants of the scenario's sonar suite for the compiled functions. Eq. 12."""
    lower: list[tuple[float, float]] = []
    upper: list[tuple[float, float]] = []
    ranges: list[float] = []
    active: list[int] = []
    for array in scenario.sonar.arrays:
        edges = [
            _unit(array.mounting_deg + array.aperture_deg * (k / array.sub_sectors - 0.5))
            for k in range(array.sub_sectors + 1)
        ]
        if array.kind == "active":
            active += range(len(lower), len(lower) + array.sub_sectors)
        lower += edges[:-1]
        upper += edges[1:]
        ranges += [array.range_m] * array.sub_sectors
    codes, edges, sides = _table(lower, upper)
    return SonarSuite(
        lower=np.array(lower),
        upper=np.array(upper),
        squared_range=np.array([*(range_m * range_m for range_m in ranges), -1.0]),
        codes=codes,
        edges=edges,
        sides=sides,
        active=np.array(active, np.int64),
        active_range=np.array([ranges[k] for k in active]),
        reach=max((ranges[k] for k in active), default=0.0),
        cone=_cone([(lower[k], upper[k]) for k in active]),
        reports_surface=scenario.sonar.echo_reports == "surface",
        obstacles_hide=scenario.sonar.obstacles_hide_vehicles,
    )


def _cone(beams: list[tuple[tuple[float, float], tuple[float, float]]]) -> tuple[float, float, float, float]:
    """``SonarSuite.cone``, below 180 degrees, for beams given by lower and upper edge."""
    for lower, _ in beams:
        for _, upper in beams:
            edges = [lower, *itertools.chain(*beams), upper]
            inside = all(cross(*lower, *edge) >= 0.0 and cross(*edge, *upper) >= 0.0 for edge in edges)
            if inside and all(cross(*a, *b) > 0.0 for a, b in [*beams, (lower, upper)]):
                return *lower, *upper
    return 0.0, 0.0, 0.0, 0.0


def _unit(degrees: float) -> tuple[float, float]:
    """Unit vector of a direction [deg]; directions equal modulo 360 give equal bits."""
    radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
    return math.cos(radians), math.sin(radians)


@compiled_inline
def cross(a_x: float, a_y: float, b_x: float, b_y: float) -> float:
    """Cross product of a and b: positive where b is clockwise of a by less than 180 degrees."""
    return a_x * b_y - a_y * b_x


@compiled_inline
def diamond(b_x: float, b_y: float) -> float:
    """Direction of b as a number: from 0 astern clockwise, 1 port, 2 ahead, 3 starboard, to 4; 2 for a null vector."""
    share = b_y / (abs(b_x) + abs(b_y) + _TINY)
    behind = 4.0 - share if b_y >= 0.0 else -share
    return 2.0 + share if b_x >= 0.0 else behind


def _table(lower: list[tuple[float, float]], upper: list[tuple[float, float]]) -> tuple[Int64, Float64, Int64]:
    """``SonarSuite``'s codes, edges and sides.

    Sub-sectors of a layer don't overlap. A bin is so narrow that it contains at most one edge of its layer, with a
    margin for rounding.
    """
    start = [diamond(*edge) for edge in lower]
    span = [(diamond(*b) - diamond(*a)) % 4.0 for a, b in zip(lower, upper, strict=True)]
    bins = max(_MIN_BINS, 2 ** math.ceil(math.log2(12.0 / min(span))))
    apart = 12.0 / bins

    def follows(b: int, a: int) -> bool:
        """Whether sub-sector b starts at the end of a or beyond the margin after it."""
        return upper[a] == lower[b] or (start[b] - start[a]) % 4.0 >= span[a] + apart

    layers: list[list[int]] = []
    for k in range(len(lower)):
        layer = next((held for held in layers if all(follows(k, m) and follows(m, k) for m in held)), None)
        if layer is None:
            layers.append([k])
        else:
            layer.append(k)
    none = len(lower)
    codes = np.full((len(layers), bins), none, np.int64)
    edges: list[tuple[float, float]] = []
    sides: list[list[int]] = []
    for row, layer in zip(codes, layers, strict=True):
        middle = (np.arange(bins) + 0.5) * 4.0 / bins
        for k in layer:
            row[(middle - start[k]) % 4.0 < span[k]] = k
        for edge in dict.fromkeys([*(lower[k] for k in layer), *(upper[k] for k in layer)]):
            below = next((k for k in layer if upper[k] == edge), none)
            above = next((k for k in layer if lower[k] == edge), none)
            at = diamond(*edge) / 4.0 * bins
            row[[int((at + side) % bins) for side in (-1e-6, 1e-6)]] = none + 1 + len(edges)
            edges.append(edge)
            sides.append([below, above])
    return codes, np.array(edges), np.array(sides, np.int64)
