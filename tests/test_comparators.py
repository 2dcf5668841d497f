"""Known properties of the comparators' sources: potential fields, flocking, reciprocal velocity obstacles."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad

from tests.swarms import fly, piloted
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.baselines.comparators import apf, olfati_saber, orca
from uuv_marl.percept import Percept, PerceptLayout

APF = apf.ApfGains(80.0, 40_000.0, 50.0, 500_000.0, 20.0)
FLOCK = olfati_saber.OlfatiSaberGains(2.0, 14.0, 1.5, 200.0, 2000.0, 3000.0, 40.0, 300.0, 1500.0, 50.0, 400.0)
SPEEDS = st.floats(-5.0, 5.0)
METRES = st.floats(-60.0, 60.0)


def seen(name, n=1, **overrides):
    """A scenario that grants what a policy needs, and a percept in which nothing is perceived yet."""
    scenario = with_policy_requirements(name, load_scenario("single_obstacle", num_vehicles=n, overrides=overrides))
    layout = PerceptLayout.of(scenario)
    return scenario, Percept(np.zeros((1, n, layout.size), np.float32), layout)


def gradient(potential, x, y, step=1e-4):
    """Of a potential at a place, by central differences."""
    return np.array([
        potential(x + step, y) - potential(x - step, y), potential(x, y + step) - potential(x, y - step)
    ]) / (2 * step)  # fmt: skip


# Artificial potential field


@given(METRES, METRES, METRES, METRES)
def test_the_obstacles_force_is_the_gradient_of_ge_and_cuis_potential(x, y, goal_x, goal_y):
    """eta / 2 (1 / rho - 1 / rho_0)^2 rho_goal^2, for a disc of 10 m around the origin."""
    assume(math.hypot(x, y) > 10.6)
    assume(abs(math.hypot(x, y) - 10.0 - APF.obstacle_range) > 0.01)

    def potential(x, y):
        rho = math.hypot(x, y) - 10.0
        wall = max(1.0 / rho - 1.0 / APF.obstacle_range, 0.0)
        return 0.5 * APF.obstacle * wall**2 * ((goal_x - x) ** 2 + (goal_y - y) ** 2)

    distance = math.hypot(x, y)
    f_x, f_y, bound = apf.apf_obstacle_force(-x / distance, -y / distance, distance - 10.0, goal_x - x, goal_y - y, APF)
    np.testing.assert_allclose((f_x, f_y), -gradient(potential, x, y), rtol=1e-4, atol=1e-3)
    assert bound == 0


@given(METRES, METRES)
def test_the_neighbours_force_is_the_gradient_of_khatibs_potential(x, y):
    assume(math.hypot(x, y) > 0.6)
    assume(abs(math.hypot(x, y) - APF.neighbour_range) > 0.01)

    def potential(x, y):
        return 0.5 * APF.neighbour * max(1.0 / math.hypot(x, y) - 1.0 / APF.neighbour_range, 0.0) ** 2

    # The vehicle is at (x, y), the neighbour at the origin.
    np.testing.assert_allclose(
        apf.apf_neighbour_force(-x, -y, APF)[:2], -gradient(potential, x, y), rtol=1e-4, atol=1e-3
    )


def test_the_field_is_zero_at_the_goal_though_an_obstacle_is_near():
    """What GNRON is for; Khatib's own repulsion would push the vehicle off."""
    scenario, percept = seen("apf")
    percept["echo"][0, 0, 3], percept["echo_range"][0, 0, 3] = 1.0, 5.0
    percept["echo_position"][0, 0, 3] = (30.0, 0.0)
    policy = make_policy("apf", scenario, gains=APF)
    np.testing.assert_array_equal(policy.act(percept)[0, 0], 0.0)
    percept["reference"][0, 0] = (70.0, 0.0)  # beyond the obstacle
    assert policy.act(percept)[0, 0, 0] < 0.0


# Olfati-Saber's flocking


@given(st.floats(0.1, 40.0), st.floats(10.0, 2000.0), st.floats(10.0, 2000.0), st.floats(1.0, 5.0))
def test_the_lattices_force_is_the_gradient_of_its_potential(distance, a, b, unit):
    """Per length of the source; psi_alpha is the integral of phi_alpha."""
    gains = FLOCK._replace(attraction=a, repulsion=b, unit=unit)

    def gained(near, far):
        ends = [olfati_saber.sigma_norm(metres / unit) for metres in (near, far)]
        return quad(lambda z: olfati_saber.phi_alpha(z, gains), *ends)[0]

    step = 1e-3 * unit
    found = gained(distance - step, distance + step) / 2e-3
    assert olfati_saber.neighbour_attraction(distance, gains) == pytest.approx(found, rel=1e-3, abs=0.05)


@given(st.floats(10.0, 2000.0), st.floats(10.0, 2000.0), st.floats(8.0, 20.0))
def test_neighbours_repel_within_the_spacing_and_attract_beyond(a, b, spacing):
    gains = FLOCK._replace(attraction=a, repulsion=b, spacing=spacing)
    assert olfati_saber.neighbour_attraction(spacing, gains) == pytest.approx(0.0, abs=1e-6 * (a + b))
    near, far, beyond = (olfati_saber.neighbour_attraction(share * spacing, gains) for share in (0.9, 1.1, 1.5))
    assert near < 0.0 < far
    assert beyond == 0.0
    assert -b < olfati_saber.phi_alpha(0.0, gains) < 0.0


@pytest.mark.parametrize("spacing", [12.0, 15.0])
def test_vehicles_in_free_water_settle_at_the_spacing(spacing):
    """An alpha-lattice: seven vehicles, led by a weak pull, end in triangles of side d."""
    gains = FLOCK._replace(
        spacing=spacing, reach=1.3, attraction=100.0, repulsion=500.0, pull=5.0, reference_velocity=300.0
    )
    swarm, policy = piloted("olfati_saber", "tracking", seed=10_000, n=7, gains=gains)
    angle = np.arange(6) * math.pi / 3
    ring = 12.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    swarm.state.eta[0, :, :2] = swarm.facts.reference[0, 0, :2] + np.concatenate([np.zeros((1, 2)), ring])
    swarm.state.eta[0, :, :2] += np.random.default_rng(0).uniform(-2.0, 2.0, (7, 2))
    swarm.observe()
    while swarm.facts.time_s[0] < 100.0:
        fly(swarm, policy, 1)
    place = swarm.state.eta[0, :, :2]
    away = np.sort(np.hypot(*(place[:, None] - place[None]).transpose(2, 0, 1)), axis=1)
    np.testing.assert_allclose(away[:, 1:3], spacing, rtol=0.02)  # at a corner a vehicle has two


# Reciprocal velocity obstacles


def nearest_approach(p_x, p_y, v_x, v_y, horizon):
    """Smallest distance to a point that a relative velocity reaches within a horizon."""
    speed2 = v_x * v_x + v_y * v_y
    time = min(max((p_x * v_x + p_y * v_y) / speed2, 0.0), horizon) if speed2 > 0.0 else 0.0
    return math.hypot(p_x - v_x * time, p_y - v_y * time)


@given(METRES, METRES, SPEEDS, SPEEDS, st.floats(2.0, 12.0), st.floats(1.0, 16.0))
def test_the_change_grazes_the_disc_and_is_the_smallest(p_x, p_y, v_x, v_y, radius, horizon):
    assume(math.hypot(p_x, p_y) > 1.01 * radius)
    u_x, u_y, n_x, n_y = orca.escape(p_x, p_y, radius, v_x, v_y, horizon, 0.1)
    assert math.hypot(n_x, n_y) == pytest.approx(1.0)
    assert abs(u_x * n_y - u_y * n_x) < 1e-9, "the change is along the normal"
    assert nearest_approach(p_x, p_y, v_x + u_x, v_y + u_y, horizon) == pytest.approx(radius, abs=1e-6)
    collides = nearest_approach(p_x, p_y, v_x, v_y, horizon) < radius
    assert collides == (u_x * n_x + u_y * n_y > 0.0) or abs(u_x * n_x + u_y * n_y) < 1e-6
    size = math.hypot(u_x, u_y)
    for angle in np.linspace(0.0, 2.0 * math.pi, 40):
        d_x, d_y = 0.99 * size * math.cos(angle), 0.99 * size * math.sin(angle)
        same = nearest_approach(p_x, p_y, v_x + d_x, v_y + d_y, horizon)
        assert (same < radius + 1e-6) if collides else (same > radius - 1e-6)


def test_the_field_is_bounded_and_what_was_cut_is_counted():
    scenario, percept = seen("apf", 2)
    percept["detected"][0, 0, 3] = 1.0  # a neighbour at the very same place
    percept["echo"][0, 1, 3] = 1.0  # an obstacle's surface
    policy = make_policy("apf", scenario, gains=APF)
    assert np.isfinite(policy.act(percept)).all()
    assert policy.clamps.tolist() == [2]
