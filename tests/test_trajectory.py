"""The reference point l(t) (Eq. 5)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from uuv_marl.sim.trajectory import arrival_times, reference

CORNERS = np.array([[180.0, 180.0], [800.0, 100.0], [500.0, 600.0], [1000.0, 1000.0]])
TIMES = arrival_times(CORNERS, 4.0)


def test_corners_are_passed_on_time_and_the_end_is_at_rest():
    for corner, t in zip(CORNERS[:-1], TIMES[:-1], strict=True):
        assert reference(t, CORNERS, TIMES, 3, False)[:2] == pytest.approx(corner)
    assert reference(TIMES[-1], CORNERS, TIMES, 3, False) == (1000.0, 1000.0, 0.0, 0.0)
    assert reference(1e6, CORNERS, TIMES, 3, False) == (1000.0, 1000.0, 0.0, 0.0)
    assert TIMES[-1] == pytest.approx(462.137, abs=1e-3)


@given(st.floats(0.0, float(TIMES[-1]) - 1e-3))
def test_speed_is_constant_and_velocity_is_the_rate_of_position(t):
    x, y, v_x, v_y = reference(t, CORNERS, TIMES, 3, False)
    assert np.hypot(v_x, v_y) == pytest.approx(4.0)
    h = 1e-6
    x2, y2, w_x, w_y = reference(t + h, CORNERS, TIMES, 3, False)
    if (w_x, w_y) == (v_x, v_y):
        assert (x2 - x, y2 - y) == pytest.approx((v_x * h, v_y * h), abs=1e-9)


def test_padding_after_the_last_corner_is_never_reached():
    padded = np.vstack([CORNERS, [[9e9, 9e9]]])
    times = np.append(TIMES, TIMES[-1])
    assert reference(TIMES[-1] + 1.0, padded, times, 3, False)[:2] == (1000.0, 1000.0)


@given(st.floats(0.0, 2.0 * float(TIMES[-1])))
def test_passing_the_end_keeps_the_velocity(t):
    before, after = (reference(t, CORNERS, TIMES, 3, passes) for passes in (False, True))
    if t < TIMES[-1]:
        assert after == before
        return
    last = reference(np.nextafter(TIMES[-1], 0.0), CORNERS, TIMES, 3, True)
    assert after[2:] == last[2:]
    assert after[:2] == pytest.approx(CORNERS[-1] + (t - TIMES[-1]) * np.array(last[2:]))
