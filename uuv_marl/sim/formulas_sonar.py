"""The paper's formulas of what is between vehicles and obstacles: distances, contacts, and who hears whom.

In plain Python, for a pair or a sub-sector at a time; ``engine="plain"`` uses them. Frames and symbols are those of
``uuv_marl.sim.formulas``; equation numbers are the paper's.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from uuv_marl.scenario.hardware import SonarArray
from uuv_marl.sim.formulas import Pair, Row, Rows, cross, hypot, to_body

# --- Distances and contacts ---


def middle(places: Sequence[Pair]) -> Pair:
    """The mean place, summed in order: Python's own ``sum`` rounds otherwise."""
    x, y = 0.0, 0.0
    for north, east in places:
        x, y = x + north, y + east
    return x / len(places), y / len(places)


def squared_distance(a: Row, b: Row) -> float:
    """Squared distance of two points [m2]."""
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])


def between_vehicles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float
) -> tuple[list[float], float, list[int]]:
    """Each vehicle's distance to the nearest other [m], the largest distance [m], and each one's contacts that begin.

    A contact begins where two hulls overlap and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
    """
    n, touch, largest = len(now), 2.0 * hull, -math.inf
    spacing, contacts = [math.inf] * n, [0] * n
    for i in range(n):
        for j in range(n):
            if i == j or not alive[i] or not alive[j]:
                continue
            squared = squared_distance(now[i], now[j])
            spacing[i] = min(spacing[i], math.sqrt(squared))
            largest = max(largest, math.sqrt(squared))
            if squared < touch * touch and squared_distance(before[i], before[j]) >= touch * touch:
                contacts[i] += 1
    return spacing, largest if largest >= 0.0 else math.inf, contacts


def to_obstacles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float, discs: Rows, discs_before: Rows
) -> tuple[list[float], list[float], list[int]]:
    """Each vehicle's distance to the nearest surface, each obstacle's to the nearest vehicle, and contacts that begin.

    Distances are in m. A contact begins where a hull meets an obstacle and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
        discs_before: the same one control hold ago, infinitely far away where there was none.
    """
    clearance, reached, contacts = [math.inf] * len(now), [math.inf] * len(discs), [0] * len(now)
    for i in range(len(now)):
        for k in range(len(discs)):
            if not alive[i]:
                continue
            gap = math.sqrt(squared_distance(discs[k], now[i])) - discs[k][2]
            clearance[i], reached[k] = min(clearance[i], gap), min(reached[k], gap)
            was = discs_before[k]
            if gap < hull and math.sqrt(squared_distance(was, before[i])) - was[2] >= hull:
                contacts[i] += 1
    return clearance, reached, contacts


# --- Sonar ---


class Sectors(NamedTuple):
    """Sub-sectors: the directions clockwise of the lower edge, up to and including the upper one."""

    lower: Rows
    """Unit vectors, body frame."""
    upper: Rows
    range_m: Row
    active: Sequence[int]
    """Those that hear obstacles."""


def sub_sectors(arrays: Sequence[SonarArray]) -> Sectors:
    """The sub-sectors of all arrays in order, those of an array of equal width. Eq. 12."""

    def unit(degrees: float) -> Pair:
        radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
        return math.cos(radians), math.sin(radians)

    parts = [(array, k) for array in arrays for k in range(array.sub_sectors)]
    edges = [
        [unit(array.mounting_deg + array.aperture_deg * ((k + side) / array.sub_sectors - 0.5)) for side in (0, 1)]
        for array, k in parts
    ]
    return Sectors(
        lower=[lower for lower, _ in edges],
        upper=[upper for _, upper in edges],
        range_m=[array.range_m for array, _ in parts],
        active=[k for k, (array, _) in enumerate(parts) if array.kind == "active"],
    )


def hear(i: int, eta: Rows, heading: Rows, alive: Sequence[bool], sectors: Sectors, discs: Rows) -> list[int]:
    """Whom a vehicle hears in each sub-sector: the nearest, the lower index of equals, -1 for nobody. Eq. 8-9, 13-15.

    Args:
        i: index of the vehicle.
        eta: poses: north and east [m], heading [rad], a row for each vehicle.
        heading: cosine and sine of the heading, a row for each vehicle.
        alive: False for lost vehicles.
        sectors: the sonar's sub-sectors.
        discs: obstacles that silence whom they hide: centre north and east, radius [m], a row each.
    """
    nearest = [range_m * range_m for range_m in sectors.range_m]
    heard = [-1] * len(nearest)
    for j in range(len(eta)):
        if j == i or not alive[j]:
            continue
        dx, dy = eta[j][0] - eta[i][0], eta[j][1] - eta[i][1]
        squared, there = dx * dx + dy * dy, to_body(dx, dy, heading[i])
        for k in range(len(nearest)):
            inside = cross(sectors.lower[k], there) > 0.0 and cross(sectors.upper[k], there) <= 0.0
            if squared < nearest[k] and inside and not hidden(eta[i][0], eta[i][1], dx, dy, discs):
                nearest[k], heard[k] = squared, j
    return heard


def hidden(x: float, y: float, dx: float, dy: float, discs: Rows) -> bool:
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy).

    Args:
        x: start of the segment, north [m].
        y: start of the segment, east [m].
        dx: how far north of it the segment ends [m].
        dy: how far east of it the segment ends [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
    """
    length2 = dx * dx + dy * dy
    for k in range(len(discs)):
        o_x, o_y = discs[k][0] - x, discs[k][1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if hypot(o_x - share * dx, o_y - share * dy) < discs[k][2]:
            return True
    return False


def echo(centre: Pair, radius: float, lower: Row, upper: Row) -> tuple[float, Pair]:
    """Range [m] and place, body frame, of the point of a disc within a sub-sector that is nearest. Eq. 11, 16-17.

    That lies towards the centre, or on an edge where the centre is outside; at range 0 for a vehicle inside the disc.

    Args:
        centre: of the disc, ahead and to starboard [m].
        radius: of the disc [m].
        lower: lower edge of the sub-sector, a unit vector in the body frame.
        upper: upper edge, likewise.
    """
    distance = hypot(*centre)
    if distance <= radius:
        return 0.0, (0.0, 0.0)
    if cross(lower, centre) > 0.0 and cross(upper, centre) <= 0.0:
        share = 1.0 - radius / distance
        return distance - radius, (share * centre[0], share * centre[1])
    nearest, point = math.inf, (0.0, 0.0)
    for edge in (lower, upper):
        along, off = edge[0] * centre[0] + edge[1] * centre[1], cross(edge, centre)
        if along > 0.0 and abs(off) <= radius:
            reach = along - math.sqrt(radius * radius - off * off)
            if reach < nearest:
                nearest, point = reach, (reach * edge[0], reach * edge[1])
    return nearest, point
