"""The velocity nearest to a desired one within half-planes; where none exists, the one of least violation.

The linear programs of van den Berg, Guy, Lin and Manocha, Reciprocal n-body collision avoidance, ISRR 2009 (Springer
2011), section 5: one half-plane after the other, in the order given, a velocity that violates it moves to its border.
No step is random, and both solutions are unique, so that the order changes them by rounding alone.
"""

import math

from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float64

TOLERANCE = 1e-9  # largest violation of a satisfied half-plane [m/s]. Assumed: far above rounding, below any use.
_PARALLEL = 1e-12
"""Sine of the angle below which two borders are parallel. Assumed: their crossing would be beyond any speed."""


@compiled
def nearest_velocity(
    w_x: float, w_y: float, planes: Float64, num: int, firm: int, limit: float
) -> tuple[float, float, float]:
    """The velocity nearest to a desired one, within a speed limit, with ``n_x v_x + n_y v_y <= b`` for each plane.

    If none exists, the largest violation ``n_x v_x + n_y v_y - b`` of the planes that are not firm is minimized, and of
    the velocities that minimize it the nearest is taken. The time grows with the square of the number of planes, and
    with its cube if no velocity satisfies them.

    Args:
        w_x: desired velocity [m/s], in any frame.
        w_y: its other component.
        planes: n_x, n_y and b [m/s] of each, float64, shape (at least ``num``, 3). Normals have length 1, or a length
            near it that weighs the plane's violation; rows with a zero normal are ignored.
        num: number of rows that count.
        firm: number of first rows that must not be violated in favour of the others. If they can't be satisfied
            together, they count like the others.
        limit: largest speed, above 0 [m/s].

    Returns:
        The velocity (v_x, v_y) [m/s], and the largest violation [m/s], 0 where every plane is satisfied to
            ``TOLERANCE``.
    """
    v_x, v_y, satisfied = _program(w_x, w_y, False, planes, num, -1, firm, 0.0, limit)
    if satisfied == num:
        return v_x, v_y, 0.0
    firm = firm if satisfied >= firm else 0
    worst = 0.0
    for i in range(max(satisfied, firm), num):
        if _excess(v_x, v_y, planes, i) > worst:
            to_x, to_y, done = _program(-planes[i, 0], -planes[i, 1], True, planes, i, i, firm, 0.0, limit)
            if done == i:  # else by rounding alone: the velocity before is as good
                v_x, v_y = to_x, to_y
            worst = max(worst, _excess(v_x, v_y, planes, i))
    for i in range(firm, num):
        worst = max(worst, _excess(v_x, v_y, planes, i))
    to_x, to_y, done = _program(w_x, w_y, False, planes, num, -1, firm, worst, limit)
    return (to_x, to_y, worst) if done == num else (v_x, v_y, worst)


@compiled
def _excess(v_x: float, v_y: float, planes: Float64, i: int) -> float:
    """Violation of a plane by a velocity [m/s]; negative where it is satisfied."""
    return planes[i, 0] * v_x + planes[i, 1] * v_y - planes[i, 2]


@compiled
def _row(planes: Float64, j: int, rival: int, firm: int, slack: float) -> tuple[float, float, float, bool]:
    """Unit normal and bound of a plane, or of the velocities that violate it no more than they violate a rival.

    ``rival`` is the index of the other plane, -1 for none. Planes from ``firm`` on are moved outwards by ``slack``
    [m/s]. The fourth value is False if no border exists.
    """
    n_x, n_y, b = planes[j, 0], planes[j, 1], planes[j, 2]
    if j >= firm:
        b += slack
        if rival >= 0:
            n_x, n_y, b = n_x - planes[rival, 0], n_y - planes[rival, 1], b - planes[rival, 2]
    length = math.sqrt(n_x * n_x + n_y * n_y)
    if length <= TOLERANCE:
        return 0.0, 0.0, 0.0, False
    return n_x / length, n_y / length, b / length, True


@compiled
def _program(
    c_x: float, c_y: float, far: bool, planes: Float64, num: int, rival: int, firm: int, slack: float, limit: float
) -> tuple[float, float, int]:
    """The velocity nearest to c, or farthest along it, within the limit and the planes.

    c is the target [m/s]: the farthest along it with ``far``, else the nearest to it; ``rival``, ``firm`` and ``slack``
    as in ``_row``. Returns the velocity [m/s] and the number of planes satisfied before an infeasible one, ``num`` if
    all are.
    """
    size = math.sqrt(c_x * c_x + c_y * c_y)
    v_x, v_y = (limit * c_x / size, limit * c_y / size) if (far or size > limit) and size > 0.0 else (c_x, c_y)
    for i in range(num):
        n_x, n_y, b, exists = _row(planes, i, rival, firm, slack)
        if exists and n_x * v_x + n_y * v_y > b + TOLERANCE:
            t, feasible = _along_border(c_x, c_y, far, planes, i, rival, firm, slack, limit)
            if not feasible:
                return v_x, v_y, i
            v_x, v_y = b * n_x - t * n_y, b * n_y + t * n_x
    return v_x, v_y, num


@compiled
def _along_border(
    c_x: float, c_y: float, far: bool, planes: Float64, i: int, rival: int, firm: int, slack: float, limit: float
) -> tuple[float, bool]:
    """Position of the best velocity on the border of plane i [m/s], and whether it exists.

    The position counts from the border's foot along (-n_y, n_x). The planes before i are satisfied; arguments as in
    ``_program``.
    """
    n_x, n_y, b, _ = _row(planes, i, rival, firm, slack)
    if b * b > limit * limit:
        return 0.0, False
    high = math.sqrt(limit * limit - b * b)
    low = -high
    for j in range(i):
        m_x, m_y, a, exists = _row(planes, j, rival, firm, slack)
        if not exists:
            continue
        along, over = m_y * n_x - m_x * n_y, b * (m_x * n_x + m_y * n_y) - a
        if abs(along) <= _PARALLEL:
            if over > TOLERANCE:
                return 0.0, False
        elif along > 0.0:
            high = min(high, -over / along)
        else:
            low = max(low, -over / along)
    if low > high + TOLERANCE:
        return 0.0, False
    best = c_y * n_x - c_x * n_y
    if far and best != 0.0:
        best = math.copysign(2.0 * limit, best)
    return min(max(best, low), high), True
