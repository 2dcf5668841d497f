"""Properties of the sonar suite (Eq. 8-17): its edges and its symmetries. Brute force is in test_oracle.py."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.sim.perception import echo
from uuv_marl.sim.sonar import suite

seeds = st.integers(0, 2**32 - 1)
BASE = load_scenario("tracking")


@given(st.floats(-math.pi, math.pi), st.floats(0.5, 99.0))
def test_arrays_that_tile_the_circle_cover_every_direction_once(bearing, distance):
    sectors = suite(BASE)
    b = distance * math.cos(bearing), distance * math.sin(bearing)
    low = sectors.lower[:, 0] * b[1] - sectors.lower[:, 1] * b[0] > 0.0
    up = sectors.upper[:, 0] * b[1] - sectors.upper[:, 1] * b[0] <= 0.0
    (k,) = np.flatnonzero(low & up)
    first = [-60.0, -180.0, 60.0][k // 7] + 120.0 / 7 * (k % 7)
    assert (
        -1e-9 <= (math.degrees(bearing) - first) % 360.0 <= 120.0 / 7 + 1e-9
        or (math.degrees(bearing) - first) % 360.0 > 360.0 - 1e-9
    )


@given(st.floats(-150, 150), st.floats(-150, 150), st.floats(1.0, 60.0), st.floats(-180, 180), st.floats(3, 110))
def test_an_echo_is_the_nearest_point_of_the_disc_within_the_beam(x, y, radius, axis, width):
    low, up = (math.radians(axis + side * width / 2) for side in (-1, 1))
    edges = math.cos(low), math.sin(low), math.cos(up), math.sin(up)
    reach, p_x, p_y = echo(x, y, radius, *edges)
    if math.hypot(x, y) <= radius:
        assert (reach, p_x, p_y) == (0.0, 0.0, 0.0)
        return
    angles = np.linspace(low, up, 20001)
    along = x * np.cos(angles) + y * np.sin(angles)
    off2 = x * x + y * y - along * along
    hits = (along > 0) & (off2 <= radius**2)
    if hits.any():
        best = (along[hits] - np.sqrt(radius**2 - off2[hits])).min()
        # Sampled rays miss the nearest point by a little, most where they graze.
        assert reach <= best + 1e-9
        assert math.hypot(p_x - x, p_y - y) == pytest.approx(radius, rel=1e-9)
        assert math.hypot(p_x, p_y) == pytest.approx(reach)
    elif math.isfinite(reach):
        assert math.hypot(x, y) * math.radians(width) / 20000 > 1e-9  # grazed between two rays
        assert math.hypot(p_x - x, p_y - y) == pytest.approx(radius, rel=1e-9)


@settings(max_examples=25)
@given(seeds, st.floats(-3, 3), st.floats(-300, 300), st.floats(-300, 300))
def test_percepts_do_not_change_when_the_world_is_rotated_and_moved(seed, turn, x, y):
    swarm = started("single_obstacle", {"sonar.channels": ["link"]}, seed=seed % 1000, n=12)
    swarm.state.nu[0] = np.random.default_rng(seed).uniform(-3, 3, (12, 3))
    before = swarm.observe().flat.copy()
    c, s = math.cos(turn), math.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    swarm.state.eta[0, :, :2] = swarm.state.eta[0, :, :2] @ rotation.T + (x, y)
    swarm.state.eta[0, :, 2] += turn
    swarm.world_map.obstacles[0, :, :2] = swarm.world_map.obstacles[0, :, :2] @ rotation.T + (x, y)
    swarm.world_map.waypoints[0, 0] = swarm.world_map.waypoints[0, 0] @ rotation.T + (x, y)
    np.testing.assert_allclose(swarm.observe().flat, before, rtol=1e-4, atol=1e-3)


@settings(max_examples=20)
@given(seeds)
def test_permuting_vehicles_permutes_the_percepts(seed):
    swarm = started("single_obstacle", seed=seed % 1000, n=15)
    before, heard = swarm.observe().flat[0].copy(), swarm.detected_index[0].copy()
    order = np.random.default_rng(seed).permutation(15)
    swarm.state.eta[0] = swarm.state.eta[0, order]
    swarm.state.nu[0] = swarm.state.nu[0, order]
    np.testing.assert_array_equal(swarm.observe().flat[0], before[order])
    rank = np.append(np.argsort(order), -1)
    np.testing.assert_array_equal(swarm.detected_index[0], rank[heard[order]])


def test_the_reference_saturates_with_its_direction_kept():
    swarm = started(BASE, n=1)
    swarm.state.eta[0, 0] = -30000.0, -40000.0 + 180, 0.0
    x, y = swarm.observe()["reference"][0, 0]
    assert math.hypot(x, y) == pytest.approx(4096.0, rel=1e-6)
    assert y / x == pytest.approx(40000.0 / 30180.0, rel=1e-5)
