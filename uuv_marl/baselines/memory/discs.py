"""Detected obstacles as discs in a vehicle's map: recursive least-squares estimates of centre and radius.

Each echo is a point of a disc's surface; where echoes report centres, it also gives the centre. A disc that repeatedly
remains undetected where it should be detected is removed.
"""

import math
from typing import NamedTuple

from uuv_marl.baselines.memory.pose import to_body_axes, to_map, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.percept import Fields
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.sonar import cross, suite
from uuv_marl.types import Float64

NOISE_M, NOISE_SHARE = 0.05, 0.03
"""Standard deviation of an echo: constant [m], and share of its range. Assumed: noise of 2 % and of 1 degree."""
RADIUS_M, RADIUS_SD_M = 18.0, 10.0
"""Expected radius of an obstacle with one known point, and its deviation [m]. Assumed: those of random_field."""
SIDE_SD_M = 8.0
"""Lateral deviation of the centre of an obstacle whose nearest point may lie outside the sonar's arc [m]. Assumed."""
GATE = 3.0  # largest deviation of an echo from its disc, in standard deviations [1]
CONFIRMED = 3.0  # detections from which a disc counts
MOST_SCORE_S = 3.0
"""Largest score, as time [s]: the time for which a disc then remains undetected until it is removed. Assumed."""
LIFETIME = 40.0  # a disc detected for t seconds in all, less than that, is removed after this times t^2 [1/s]. Assumed.
SMALLEST_M, LARGEST_M = 0.5, 60.0  # bounds of a radius [m]
_FORGETS = 0.2  # growth of the covariance of a detected disc [1/s]: about the last 5 s count ...
_MOST_VARIANCE = 2.0 * RADIUS_SD_M * RADIUS_SD_M + SIDE_SD_M * SIDE_SD_M
"""... unless it is as large as that of a new one already [m2]."""


class ActiveSectors(NamedTuple):
    """Active sub-sectors and their reports."""

    lower: Float64  # unit vectors of lower edges, shape (active, 2)
    upper: Float64  # unit vectors of upper edges, shape (active, 2)
    range_m: Float64  # shape (active,)
    centres: bool  # whether echoes report centres, else points of surfaces
    period_s: float  # decision period [s]
    most_score: float  # decisions in ``MOST_SCORE_S``, at least twice ``CONFIRMED``

    @staticmethod
    def of(scenario: Scenario) -> "ActiveSectors":
        """Sub-sectors of a scenario's sonar."""
        all_of, period = suite(scenario), scenario.timing.decision_period_s
        return ActiveSectors(
            all_of.lower[all_of.active], all_of.upper[all_of.active], all_of.active_range,
            not all_of.reports_surface, period, max(MOST_SCORE_S / period, 2.0 * CONFIRMED),
        )  # fmt: skip


@compiled
def deviation(reach: float) -> float:
    """Standard deviation of an echo [m] at a range [m]."""
    return NOISE_M + NOISE_SHARE * reach


@compiled
def contains(a: int, x: float, y: float, sectors: ActiveSectors) -> bool:
    """Whether a direction (ahead, starboard) lies in an active sub-sector."""
    lower, upper = sectors.lower, sectors.upper
    return cross(lower[a, 0], lower[a, 1], x, y) > 0.0 and cross(upper[a, 0], upper[a, 1], x, y) <= 0.0


@compiled
def update_discs(w: int, i: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> None:
    """Update a vehicle's discs with its echoes, and remove those that are repeatedly undetected."""
    undetected = memory.undetected[w, i]
    for d in range(undetected.shape[0]):
        undetected[d] += sectors.period_s
    for a in range(see.echo.shape[2]):
        if see.echo[w, i, a] > 0.0:
            d = owner(w, i, a, see, sectors, memory)
            if d >= 0:
                _update_disc(w, i, d, a, see, sectors, memory)
    for _ in range(see.echo.shape[2]):  # what is left belongs to obstacles that are new
        a = _nearest_unexplained(w, i, see, sectors, memory)
        if a < 0:
            break
        d = _free_row(w, i, memory)
        _begin(w, i, d, a, see, sectors, memory)
        for b in range(see.echo.shape[2]):
            if b != a and see.echo[w, i, b] > 0.0 and owner(w, i, b, see, sectors, memory) == d:
                _update_disc(w, i, d, b, see, sectors, memory)
    _lower_scores(w, i, see, sectors, memory)
    _merge(w, i, sectors, memory)


@compiled
def _nearest_unexplained(w: int, i: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> int:
    """Active sub-sector of the nearest echo that no disc explains, -1 for none."""
    nearest, reach = -1, math.inf
    for a in range(see.echo.shape[2]):
        if (
            see.echo[w, i, a] > 0.0
            and see.echo_range[w, i, a] < reach
            and not _explained(w, i, a, see, sectors, memory)
        ):
            nearest, reach = a, see.echo_range[w, i, a]
    return nearest


@compiled
def _explained(w: int, i: int, a: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> bool:
    """Whether an echo belongs to a disc and lies on its surface after the disc's correction.

    Two obstacles with one detected point each may be taken for one, until no disc fits both.
    """
    d = owner(w, i, a, see, sectors, memory)
    if d < 0 or sectors.centres:
        return d >= 0
    x, y = surface_point(w, i, a, see, sectors)
    x, y = to_map(x, y, memory.pose[w, i])
    away = math.hypot(x - memory.disc[w, i, d, 0], y - memory.disc[w, i, d, 1])
    return abs(away - memory.disc[w, i, d, 2]) <= GATE * deviation(float(see.echo_range[w, i, a])) + 0.5


@compiled
def surface_point(w: int, i: int, a: int, see: Fields, sectors: ActiveSectors) -> tuple[float, float]:
    """Surface point of an echo in the body frame [m].

    Where echoes report centres it lies in the centre's direction, or on the edge of the sub-sector next to that.
    """
    x, y = float(see.echo_position[w, i, a, 0]), float(see.echo_position[w, i, a, 1])
    if not sectors.centres:
        return 1.0 * x, 1.0 * y  # double, as the other ways out
    away, reach = math.hypot(x, y), float(see.echo_range[w, i, a])
    if away < 1e-6:
        return 0.0, 0.0
    e_x, e_y = x / away, y / away
    if not contains(a, e_x, e_y, sectors):
        l_x, l_y, u_x, u_y = sectors.lower[a, 0], sectors.lower[a, 1], sectors.upper[a, 0], sectors.upper[a, 1]
        e_x, e_y = (l_x, l_y) if l_x * e_x + l_y * e_y > u_x * e_x + u_y * e_y else (u_x, u_y)
    return reach * e_x, reach * e_y


@compiled
def centre_of(w: int, i: int, a: int, see: Fields, memory: Surroundings) -> tuple[float, float]:
    """Centre that an echo reports, in the map [m]."""
    return to_map(float(see.echo_position[w, i, a, 0]), float(see.echo_position[w, i, a, 1]), memory.pose[w, i])


@compiled
def owner(w: int, i: int, a: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> int:
    """Index of the disc that an echo belongs to, with the least distance from its surface; -1 for none."""
    x, y = surface_point(w, i, a, see, sectors)
    x, y = to_map(x, y, memory.pose[w, i])
    sd = deviation(float(see.echo_range[w, i, a]))
    best, least = -1, math.inf
    for d in range(memory.score.shape[2]):
        if memory.score[w, i, d] > 0.0:
            disc, p = memory.disc[w, i, d], memory.spread[w, i, d]
            dx, dy = x - disc[0], y - disc[1]
            away = max(math.hypot(dx, dy), 1e-6)
            h_x, h_y = -dx / away, -dy / away
            variance = (
                h_x * (h_x * p[0] + 2.0 * h_y * p[1] - 2.0 * p[2]) + h_y * (h_y * p[3] - 2.0 * p[4]) + p[5] + sd * sd
            )
            miss = abs(away - disc[2])
            if sectors.centres:
                c_x, c_y = centre_of(w, i, a, see, memory)
                miss, variance = math.hypot(c_x - disc[0], c_y - disc[1]), p[0] + p[3] + 2.0 * sd * sd
            if miss <= GATE * math.sqrt(variance) + 0.5 and miss < least:
                best, least = d, miss
    return best


@compiled
def correct(disc: Float64, p: Float64, h: tuple[float, float, float], wrong: float, variance: float) -> None:
    """One step of recursive least squares with a measurement h . (x, y, R), in place.

    ``disc``, shape (3,), holds centre and radius [m], ``p``, shape (6,), their covariance [m2]: xx, xy, xR, yy, yR, RR.
    ``wrong`` is the measured less the expected value [m], with its ``variance`` [m2].
    """
    g_x = p[0] * h[0] + p[1] * h[1] + p[2] * h[2]
    g_y = p[1] * h[0] + p[3] * h[1] + p[4] * h[2]
    g_r = p[2] * h[0] + p[4] * h[1] + p[5] * h[2]
    s = h[0] * g_x + h[1] * g_y + h[2] * g_r + variance
    disc[0] += g_x * wrong / s
    disc[1] += g_y * wrong / s
    disc[2] = min(max(disc[2] + g_r * wrong / s, SMALLEST_M), LARGEST_M)
    p[0], p[1], p[2] = p[0] - g_x * g_x / s, p[1] - g_x * g_y / s, p[2] - g_x * g_r / s
    p[3], p[4], p[5] = p[3] - g_y * g_y / s, p[4] - g_y * g_r / s, p[5] - g_r * g_r / s


@compiled
def _correct_centre(w: int, i: int, d: int, a: int, sd: float, see: Fields, memory: Surroundings) -> None:
    """Correct a disc by the centre that an echo reports. ``sd``: its standard deviation [m]."""
    disc, p = memory.disc[w, i, d], memory.spread[w, i, d]
    x, y = centre_of(w, i, a, see, memory)
    correct(disc, p, (1.0, 0.0, 0.0), x - disc[0], sd * sd)
    correct(disc, p, (0.0, 1.0, 0.0), y - disc[1], sd * sd)


@compiled
def _update_disc(w: int, i: int, d: int, a: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> None:
    """Correct disc d by one echo."""
    disc, p = memory.disc[w, i, d], memory.spread[w, i, d]
    if memory.undetected[w, i, d] > 0.0:  # the first of this decision
        memory.undetected[w, i, d] = 0.0
        memory.score[w, i, d] = min(memory.score[w, i, d] + 1.0, sectors.most_score)
        if p[0] + p[3] + p[5] < _MOST_VARIANCE:
            for k in range(6):
                p[k] *= 1.0 + _FORGETS * sectors.period_s
    x, y = surface_point(w, i, a, see, sectors)
    x, y = to_map(x, y, memory.pose[w, i])
    sd = deviation(float(see.echo_range[w, i, a]))
    if sectors.centres:
        _correct_centre(w, i, d, a, sd, see, memory)
    dx, dy = x - disc[0], y - disc[1]
    away = max(math.hypot(dx, dy), 1e-6)
    correct(disc, p, (dx / away, dy / away, 1.0), away - disc[2], sd * sd)


@compiled
def _begin(w: int, i: int, d: int, a: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> None:
    """Begin disc d behind its nearest echo."""
    x, y = surface_point(w, i, a, see, sectors)
    away = max(math.hypot(x, y), 1e-6)
    sd = deviation(away)
    e_x, e_y = x / away, y / away
    inside = cross(sectors.lower[a, 0], sectors.lower[a, 1], e_x, e_y) > 1e-3
    inside = inside and cross(sectors.upper[a, 0], sectors.upper[a, 1], e_x, e_y) < -1e-3
    across = sd if inside or sectors.centres else SIDE_SD_M
    c_x, c_y = to_map(x + RADIUS_M * e_x, y + RADIUS_M * e_y, memory.pose[w, i])
    e_x, e_y = to_map_axes(e_x, e_y, memory.pose[w, i])
    disc, p = memory.disc[w, i, d], memory.spread[w, i, d]
    disc[0], disc[1], disc[2] = c_x, c_y, RADIUS_M
    along, side, size = RADIUS_SD_M * RADIUS_SD_M + sd * sd, across * across, RADIUS_SD_M * RADIUS_SD_M
    p[0] = along * e_x * e_x + side * e_y * e_y
    p[1] = (along - side) * e_x * e_y
    p[3] = along * e_y * e_y + side * e_x * e_x
    p[2], p[4], p[5] = size * e_x, size * e_y, size
    memory.score[w, i, d], memory.undetected[w, i, d] = 1.0, 0.0
    if sectors.centres:
        _correct_centre(w, i, d, a, sd, see, memory)


@compiled
def _free_row(w: int, i: int, memory: Surroundings) -> int:
    """Index for a new disc: a free one, or that of the farthest."""
    farthest, most = 0, -1.0
    for d in range(memory.score.shape[2]):
        if memory.score[w, i, d] <= 0.0:
            return d
        away = math.hypot(
            memory.disc[w, i, d, 0] - memory.pose[w, i, 0], memory.disc[w, i, d, 1] - memory.pose[w, i, 1]
        )
        if away - memory.disc[w, i, d, 2] > most:
            farthest, most = d, away - memory.disc[w, i, d, 2]
    return farthest


@compiled
def _lower_scores(w: int, i: int, see: Fields, sectors: ActiveSectors, memory: Surroundings) -> None:
    """Lower the score of discs that are undetected where they should be detected."""
    for d in range(memory.score.shape[2]):
        score, undetected = memory.score[w, i, d], memory.undetected[w, i, d]
        if score <= 0.0 or undetected == 0.0:
            continue
        evidence = MOST_SCORE_S * score / sectors.most_score
        if score < sectors.most_score - 1.0 and undetected > LIFETIME * evidence * evidence:
            memory.score[w, i, d] = 0.0
            continue
        disc, pose = memory.disc[w, i, d], memory.pose[w, i]
        x, y = to_body_axes(disc[0] - pose[0], disc[1] - pose[1], pose)
        away = max(math.hypot(x, y), 1e-6)
        reach = away - memory.disc[w, i, d, 2]
        for a in range(sectors.lower.shape[0]):
            if contains(a, x, y, sectors) and reach < 0.9 * sectors.range_m[a]:
                if see.echo[w, i, a] == 0.0 or see.echo_range[w, i, a] > reach + 1.0 + 0.1 * away:
                    memory.score[w, i, d] = score - 1.0
                break


@compiled
def _merge(w: int, i: int, sectors: ActiveSectors, memory: Surroundings) -> None:
    """Remove discs that overlap a detected disc of higher score: twice as high, or one centre inside the other.

    Surfaces alone do not show which of two detected discs is wrong: both stay.
    """
    disc, score = memory.disc[w, i], memory.score[w, i]
    for d in range(score.shape[0]):
        for e in range(score.shape[0]):
            detected_now = memory.undetected[w, i, d] == 0.0 and not sectors.centres
            if d != e and not detected_now and 0.0 < score[d] <= score[e] and memory.undetected[w, i, e] == 0.0:
                apart = math.hypot(disc[d, 0] - disc[e, 0], disc[d, 1] - disc[e, 1])
                weak = score[d] <= 0.5 * score[e] and apart < disc[d, 2] + disc[e, 2]
                if weak or apart < max(disc[d, 2], disc[e, 2]):
                    score[d] = 0.0
