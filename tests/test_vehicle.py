"""Properties of the vehicle's dynamics (Eq. 1-4, 23-24). Actuators (Eq. 22) are compared in test_oracle.py."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from research.dynamics.acceptance import sway_yaw
from tests.conftest import COUPLED, LIFT, RUDDER
from uuv_marl import load_scenario
from uuv_marl.scenario import ScenarioError, vehicle_checks
from uuv_marl.sim import vehicle
from uuv_marl.sim.vehicle import STILL, plant

speed = st.floats(-6.0, 6.0)
PLAIN = plant(load_scenario("tracking"))
FULL = plant(load_scenario("tracking", overrides=COUPLED))
TORPEDO = plant(load_scenario("tracking", overrides=LIFT | RUDDER))


@st.composite
def plants(draw):
    """Any vehicle that the scenario's checks accept."""
    sizes = {"x_G_m": 0.2, "Y_rdot_kgm": 30.0, "Y_r": 60.0, "N_v": 60.0, "Y_rr": 200.0, "N_rv": 200.0}
    overrides = {f"vehicle.{name}": draw(st.floats(-size, size)) for name, size in sizes.items()}
    try:
        return plant(load_scenario("tracking", overrides=overrides))
    except ScenarioError:
        assume(False)


@given(speed, speed, speed)
def test_lift_takes_energy_from_sway_and_yaw(u, v, r):
    with_lift, without = (vehicle.damping((u, v, r), p) for p in (TORPEDO, PLAIN._replace(N_vv=TORPEDO.N_vv)))
    taken = v * (with_lift[1] - without[1]) + r * (with_lift[2] - without[2])
    assert taken >= -1e-9
    assert with_lift[0] == without[0]
    if u <= 0.0:
        assert with_lift == without


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_positive_action_turns_to_starboard_whatever_sign_the_source_has(sign):
    change = {"actuators.Y_uud": sign * 60.0, "actuators.N_uud": sign * -40.0}
    p = plant(load_scenario("tracking", overrides=RUDDER | change))
    state = (0.0, 0.0, 0.0, 2.0, 0.0, 0.0)
    for _ in range(20):
        state = vehicle.advance(state, vehicle.actuators(0.3, 1.0, state[5], p), STILL, 0.1, p)
    assert state[5] > 0.0
    assert state[1] > 0.0, "to starboard"
    assert vehicle.actuators(0.3, 1.0, 0.5, p) == (900.0, math.radians(20.0))


@given(speed, speed, speed, plants())
def test_coriolis_forces_do_no_work(u, v, r, p):
    c = vehicle.coriolis((u, v, r), p)
    scale = sum(abs(a * b) for a, b in zip((u, v, r), c, strict=True))
    assert abs(u * c[0] + v * c[1] + r * c[2]) <= 1e-12 * scale + 1e-12


@given(speed, speed, speed, plants())
def test_damping_never_adds_energy(u, v, r, p):
    d = vehicle.damping((u, v, r), p)
    scale = sum(abs(a * b) for a, b in zip((u, v, r), d, strict=True))
    assert u * d[0] + v * d[1] + r * d[2] >= -1e-12 * scale


@given(speed, speed, speed, st.floats(-3, 3), st.floats(-3, 3), st.floats(-500, 500), st.floats(-500, 500))
def test_motion_does_not_depend_on_where_north_is(u, v, r, psi, turn, x, y):
    tau = (700.0, -300.0)
    a = np.array(vehicle.advance((0.0, 0.0, psi, u, v, r), tau, STILL, 0.1, FULL))
    b = np.array(vehicle.advance((x, y, psi + turn, u, v, r), tau, STILL, 0.1, FULL))
    c, s = math.cos(turn), math.sin(turn)
    moved = np.array([x + c * a[0] - s * a[1], y + s * a[0] + c * a[1], a[2] + turn])
    np.testing.assert_allclose(b[:3], moved, atol=1e-9)
    np.testing.assert_allclose(b[3:], a[3:], atol=1e-9)


@pytest.mark.parametrize(("damping", "limit_mps"), [(0.0, 0.682), (600.0, 2.459)])
def test_the_hull_is_directionally_unstable_above_the_speed_that_the_docs_state(damping, limit_mps):
    """The Munk moment: det < 0 of the sway-yaw equations, linearised at a speed u. docs/paper.md."""
    plain = load_scenario("single_obstacle")
    change = {"vehicle.N_r": plain.vehicle.N_r + damping, "timing.integration_step_s": 0.02}
    stable, unstable = (sway_yaw(load_scenario(plain, overrides=change), share * limit_mps) for share in (0.99, 1.01))
    assert stable.real.max() < 0.0 < unstable.real.max()


@pytest.mark.parametrize("munk", [True, False])
def test_the_trial_of_a_step_has_the_engine_s_equations(munk):
    scenario = load_scenario("tracking", overrides=COUPLED | LIFT | {"vehicle.munk_moment": munk})
    p = plant(scenario)
    for nu in np.random.default_rng(0).uniform(-5.0, 5.0, (50, 3)):
        products = np.outer(nu, [1.0, *nu, *abs(nu)]).ravel()
        there = vehicle_checks.resistance(scenario.vehicle) @ products
        here = -np.array(vehicle.coriolis(nu, p)) - np.array(vehicle.damping(nu, p))
        np.testing.assert_allclose(there, here, rtol=1e-12, atol=1e-9)
