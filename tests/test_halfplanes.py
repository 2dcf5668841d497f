"""The half-plane solver against every point that can be the answer, one by one."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from uuv_marl.baselines.safety.halfplanes import nearest_velocity

LIMIT = 4.0
COORDINATES = st.floats(-6.0, 6.0).map(lambda value: round(value, 3))
WISHES = st.tuples(COORDINATES, COORDINATES)
ANGLES = st.integers(0, 359).map(np.radians)


def planes_of(most):
    """Lists of (n_x, n_y, b) with unit normals."""
    plane = st.builds(lambda angle, b: (np.cos(angle), np.sin(angle), b), ANGLES, COORDINATES)
    return st.lists(plane, min_size=0, max_size=most)


def solved(desired, planes, firm=0, limit=LIMIT):
    rows = np.array(planes, float).reshape(-1, 3)
    v_x, v_y, violation = nearest_velocity(*desired, rows, len(rows), firm, limit)
    return np.array([v_x, v_y]), violation


def excess(points, planes):
    """Largest violation of the planes by each point, shape (point,)."""
    rows = np.array(planes, float).reshape(-1, 3)
    return (points @ rows[:, :2].T - rows[:, 2]).max(axis=1, initial=-np.inf)


def on_circle(normal, b, limit):
    """Points of a line n.v = b at the speed limit."""
    length = np.hypot(*normal)
    if length < 1e-9 or abs(b) > limit * length * (1 + 1e-9):
        return []
    foot, along = normal * b / length**2, np.array([-normal[1], normal[0]]) / length
    half = np.sqrt(max(limit**2 - foot @ foot, 0.0))
    return [foot + half * along, foot - half * along]


def crossing(a, b):
    """The point of two lines n.v = b, if they cross."""
    matrix = np.array([a[:2], b[:2]])
    return [] if abs(np.linalg.det(matrix)) < 1e-9 else [np.linalg.solve(matrix, [a[2], b[2]])]


def least_violation(planes, limit=LIMIT):
    """The smallest largest violation that any velocity has, over all points at which it can lie."""
    rows = [np.array(plane) for plane in planes]
    points = [-limit * row[:2] for row in rows]
    for a, b in itertools.combinations(rows, 2):
        points += on_circle((a - b)[:2], (a - b)[2], limit)
        points += [point for c in rows for point in crossing(a - b, a - c)]
    near = [point for point in points if np.hypot(*point) <= limit * (1 + 1e-9)]
    return excess(np.array(near), planes).min()


def nearest_by_force(desired, planes, limit=LIMIT):
    """The nearest of all points at which the answer can lie, for planes that can be kept; None where they can't."""
    desired, rows = np.array(desired), [np.array(plane) for plane in planes]
    points = [desired, desired * min(1.0, limit / max(np.hypot(*desired), 1e-9))]
    for row in rows:
        points += [desired - (desired @ row[:2] - row[2]) * row[:2], *on_circle(row[:2], row[2], limit)]
    points += [point for a, b in itertools.combinations(rows, 2) for point in crossing(a, b)]
    near = np.array([point for point in points if np.hypot(*point) <= limit * (1 + 1e-9)])
    near = near[excess(near, planes) <= 1e-7]
    return near[np.argmin(np.hypot(*(near - desired).T))] if len(near) else None


@given(WISHES, planes_of(6))
@example((0.0, 0.0), [(1.0, 0.0, -1.0), (1.0, 0.0, -1.0)])
@example((0.0, 0.0), [(1.0, 0.0, -1.0), (-1.0, 0.0, 1.0)])
def test_the_answer_is_the_nearest_velocity_that_keeps_all(desired, planes):
    velocity, violation = solved(desired, planes)
    expected = nearest_by_force(desired, planes)
    assert np.hypot(*velocity) <= LIMIT * (1 + 1e-9)
    if expected is None:
        assert violation > 0.0
    elif violation == 0.0:
        np.testing.assert_allclose(velocity, expected, atol=1e-5)
        assert excess(velocity[None], planes) <= 2e-9
    else:
        assert violation < 1e-6, "planes that can just be kept were given up"


@given(WISHES, planes_of(5))
@example((1.0, 2.0), [(1.0, 0.0, -1.0), (-1.0, 0.0, -1.0)])
@example((1.0, 2.0), [(1.0, 0.0, -5.0)])
def test_what_cannot_be_kept_is_violated_least_and_next_to_the_wish(desired, planes):
    velocity, violation = solved(desired, planes)
    if not planes:
        return
    least = max(least_violation(planes), 0.0)
    assert violation == pytest.approx(least, abs=1e-7)
    assert excess(velocity[None], planes) <= violation + 1e-8
    if violation > 1e-6:
        relaxed = [(n_x, n_y, b + violation + 1e-6) for n_x, n_y, b in planes]
        found = nearest_by_force(desired, relaxed)
        assert np.hypot(*(velocity - desired)) <= np.hypot(*(found - desired)) + 1e-2


@given(WISHES, planes_of(4), planes_of(4))
def test_firm_planes_are_kept_where_they_can_be(desired, firm, loose):
    velocity, violation = solved(desired, firm + loose, len(firm))
    if firm and nearest_by_force(desired, [(x, y, b - 1e-6) for x, y, b in firm]) is not None:
        assert excess(velocity[None], firm) <= 1e-8
    if violation == 0.0:
        np.testing.assert_array_equal(velocity, solved(desired, firm + loose)[0])
