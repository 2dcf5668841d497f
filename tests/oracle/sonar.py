"""What is between vehicles and obstacles: distances, contacts, who hears whom (Eq. 8-9, 12-15), echoes (Eq. 11, 16-17).

Places are rows of north and east [m], discs rows of centre and radius [m], headings rows of cosine and sine. Sums have
the order of the compiled code, so that bearings on an edge, and distances on a limit, agree to the last bit.
"""

import math

import numpy as np


def cross(a, b):
    """Positive where b is clockwise of a, by less than half a turn."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def to_body(away, heading):
    """Vectors ahead and to starboard, from vectors north and east."""
    (x, y), (c, s) = np.moveaxis(away, -1, 0), np.moveaxis(heading, -1, 0)
    return np.stack([c * x + s * y, c * y - s * x], -1)


def between(a, b):
    """Vectors from each place of a to each of b, and their squared lengths; but for oneself, where that is infinite."""
    away = b[None, :, :2] - a[:, None, :2]
    squared = away[..., 0] * away[..., 0] + away[..., 1] * away[..., 1]
    return away, np.where(np.eye(len(a), dtype=bool), np.inf, squared) if a is b else squared


def vehicles(now, before, alive, hull):
    """Each vehicle's distance to the nearest other, the largest distance, and each one's contacts that begin."""
    there = alive[:, None] & alive & ~np.eye(len(now), dtype=bool)
    squared = np.where(there, between(now, now)[1], np.inf)
    begins = there & (squared < 4 * hull * hull) & (between(before, before)[1] >= 4 * hull * hull)
    far = np.sqrt(squared[there])
    return np.sqrt(squared.min(axis=1)), far.max() if far.size else np.inf, begins.sum(axis=1)


def obstacles(now, before, alive, hull, discs):
    """Each vehicle's distance to the nearest surface, each surface's to the nearest vehicle, contacts that begin."""
    gap, was = (np.sqrt(between(places, discs)[1]) - discs[:, 2] for places in (now, before))
    gap[~alive] = np.inf
    return gap.min(axis=1, initial=np.inf), gap.min(axis=0, initial=np.inf), ((gap < hull) & (was >= hull)).sum(axis=1)


def sectors(arrays):
    """Lower and upper edges of all sub-sectors, unit vectors in the body frame; their ranges; which are active."""

    def edge(array, k):
        degrees = array.mounting_deg + array.aperture_deg * (k / array.sub_sectors - 0.5)
        radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
        return math.cos(radians), math.sin(radians)

    parts = [(array, k) for array in arrays for k in range(array.sub_sectors)]
    lower, upper = (np.array([edge(array, k + side) for array, k in parts]) for side in (0, 1))
    ranges = np.array([array.range_m for array, _ in parts])
    return lower, upper, ranges, [k for k, (array, _) in enumerate(parts) if array.kind == "active"]


def heard(places, heading, alive, arrays, hiding):
    """Whom each vehicle hears in each sub-sector: the nearest, the lower index of equals, -1 for nobody.

    ``hiding`` are discs that silence whom they hide.
    """
    lower, upper, ranges, _ = sectors(arrays)
    away, squared = between(places, places)
    there = to_body(away, heading[:, None])[:, None]
    inside = (cross(lower[:, None], there) > 0.0) & (cross(upper[:, None], there) <= 0.0)
    inside &= (squared[:, None] < (ranges * ranges)[:, None]) & (alive[:, None] & alive)[:, None]
    inside &= ~hidden(places, away, hiding)[:, None]
    nearest = np.where(inside, squared[:, None], np.inf).argmin(axis=2)
    return np.where(inside.any(axis=2), nearest, -1)


def hidden(places, away, discs):
    """Whether a disc meets the way from a place to another."""
    found = np.zeros(away.shape[:2], bool)
    length2 = away[..., 0] * away[..., 0] + away[..., 1] * away[..., 1]
    for x, y, radius in discs:
        o_x, o_y = x - places[:, None, 0], y - places[:, None, 1]
        along = o_x * away[..., 0] + o_y * away[..., 1]
        share = np.clip(np.divide(along, length2, out=np.zeros_like(along), where=length2 > 0.0), 0.0, 1.0)
        found |= np.hypot(o_x - share * away[..., 0], o_y - share * away[..., 1]) < radius
    return found


def echo(centre, radius, edges):
    """Range and place, body frame, of the nearest point of a disc between two edges; infinite for none."""
    distance = float(np.hypot(*centre))
    if distance <= radius:
        return 0.0, np.zeros(2)
    if cross(edges[0], centre) > 0.0 and cross(edges[1], centre) <= 0.0:
        return distance - radius, (1.0 - radius / distance) * centre
    along, off = edges @ centre, cross(edges, centre)
    reach = [a - math.sqrt(radius**2 - o**2) if a > 0 and abs(o) <= radius else math.inf
             for a, o in zip(along.tolist(), off.tolist(), strict=True)]  # fmt: skip
    side = int(np.argmin(reach))
    return reach[side], reach[side] * edges[side] if math.isfinite(reach[side]) else np.zeros(2)


def echoes(place, heading, discs, sonar):
    """Flag, range and reported position of the nearest surface in each active sub-sector of one vehicle."""
    lower, upper, ranges, active = sectors(sonar.arrays)
    found = [(0.0, 0.0, np.zeros(2))] * len(active)
    for a, k in enumerate(active):
        nearest = ranges[k]
        for disc in discs:
            centre = to_body(disc[:2] - place, heading)
            reach, point = echo(centre, disc[2], np.stack([lower[k], upper[k]]))
            if reach < nearest:
                nearest, found[a] = reach, (1.0, reach, point if sonar.echo_reports == "surface" else centre)
    return tuple(np.array(part) for part in zip(*found, strict=True))
