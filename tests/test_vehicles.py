"""The vehicles of the catalogue swim as their sources say, and every number has its source."""

import math
import re
import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from research.dynamics import acceptance
from tests.swarms import fly, piloted, started
from uuv_marl import load_scenario
from uuv_marl.benchmark import handling
from uuv_marl.scenario import ScenarioError, load_vehicle, show_vehicle, to_toml, vehicle_names
from uuv_marl.scenario.turning import turning_radius

HEAVY = "\n[variants.heavy.vehicle]\n"
SLOW = {"trajectory.speed_mps": 1.0, "start.speed_max_mps": 1.0, "timing.integration_step_s": 0.0125}


@pytest.fixture(scope="module")
def measured():
    return {
        name: acceptance.measured(name) for name in (*vehicle_names(), "remus100+munk_on", "bluerov2_heavy+drag_wu")
    }


@pytest.mark.parametrize("figure", acceptance.FIGURES, ids=lambda figure: figure.vehicle)
def test_a_vehicle_does_what_its_source_states(figure, measured):
    assert getattr(measured[figure.vehicle], figure.quantity) == pytest.approx(figure.stated, abs=figure.within)


def test_presteros_sums_without_the_munk_moment_turn_as_lift_with_it():
    """They hold the added masses' part of sway and yaw; of the surge they don't, so the speed in the turn differs."""
    sums, lift = (handling.turn(handling.alone(f"remus100+{name}")) for name in ("sums", "munk_on"))
    assert sums[2] == pytest.approx(lift[2], rel=0.002)
    eigenvalues = [acceptance.sway_yaw(handling.alone(f"remus100+{name}"), 1.3) for name in ("sums", "munk_on")]
    np.testing.assert_allclose(*eigenvalues, rtol=1e-6)
    with pytest.raises(ScenarioError, match="N_uv = -24 .* adds energy .* give the lift's part alone"):
        load_scenario("tracking", overrides={"vehicle": "remus100+munk_on+sums"})


@pytest.mark.parametrize("name", ["lauv", "remus100", "remus100+munk_on", "remus100+small_rudder"])
def test_the_turning_radius_is_that_of_the_acceptance_test(name):
    """That one turns at full thrust, which loses speed to the turn; a hull with linear damping turns wider then."""
    alone = handling.alone(name)
    radius = turning_radius(alone.vehicle, alone.actuators, alone.vehicle.cruise_mps)
    assert radius == pytest.approx(handling.turn(alone)[2], rel=0.02)


class Lauv:
    """Da Silva et al. 2007: signs of the source, D and the lift as they stand there."""

    thrust_n, rudder_deg, lags = 14.0, 30.0, (0.05, 0.2)
    m, i_z, added = 18.0, 1.77, (-1.0, -16.0, 0.0, -1.3)
    fin, munk = (19.2, -7.68), True

    @staticmethod
    def damping(u, v, r):
        return np.array([
                [-2.4 - 2.4 * abs(u), 0.0, 0.0],
                [0.0, -23.0 - 80.0 * abs(v), 11.5 + 0.3 * abs(r)],
                [0.0, -3.1 - 1.5 * abs(v), -9.7 - 9.1 * abs(r)],
        ]) + u * np.array([[0.0, 0.0, 0.0], [0.0, -30.16, 7.68], [0.0, 10.99, -3.07]])  # fmt: skip


class Remus:
    """Prestero 2001, with the drag of Allen et al. and Fossen's zeros in the added masses' Coriolis matrix."""

    thrust_n, rudder_deg, lags = 41.0, 15.0, (1.0, 0.1)
    m, i_z, added = 30.48, 3.45, (-0.93, -35.5, 1.93, -4.88)
    fin, munk = (9.64, -6.15), False

    @staticmethod
    def damping(u, v, r):
        return np.array([
            [-6.11 * abs(u), 0.0, 0.0], [0.0, -1310.0 * abs(v), 0.632 * abs(r)], [0.0, -3.18 * abs(v), -94.0 * abs(r)]
        ]) + u * np.array([[0.0, 0.0, 0.0], [0.0, -28.6, 6.15], [0.0, 10.57, -3.93]])  # fmt: skip


def fossen(source, asked):
    """Rates of (x, y, psi, u, v, r, thrust, rudder): M nu' + C(nu) nu = D nu + tau; a positive rudder turns to port."""
    x_u, y_v, y_r, n_r = source.added
    added = -np.array([[x_u, 0.0, 0.0], [0.0, y_v, y_r], [0.0, y_r, n_r]])
    inertia = np.diag([source.m, source.m, source.i_z]) + added

    def rate(_, state):
        psi, nu, thrust, rudder = state[2], state[3:6], state[6], state[7]
        u, v, r = nu
        c_rb = np.array([[0.0, 0.0, -source.m * v], [0.0, 0.0, source.m * u], [source.m * v, -source.m * u, 0.0]])
        a_u, a_v = added[0, 0] * u, added[1, 1] * v + added[1, 2] * r
        c_a = np.array([[0.0, 0.0, -a_v], [0.0, 0.0, a_u], [a_v, -a_u, 0.0]]) if source.munk else 0.0
        tau = np.array([thrust, source.fin[0] * u * u * rudder, source.fin[1] * u * u * rudder])
        turn = np.array([[math.cos(psi), -math.sin(psi), 0.0], [math.sin(psi), math.cos(psi), 0.0], [0.0, 0.0, 1.0]])
        moved = np.linalg.solve(inertia, tau + source.damping(u, v, r) @ nu - (c_rb + c_a) @ nu)
        return [*(turn @ nu), *moved, (asked[0] - thrust) / source.lags[0], (asked[1] - rudder) / source.lags[1]]

    return rate


@pytest.mark.parametrize(("name", "source"), [("lauv", Lauv), ("remus100", Remus)])
def test_a_minute_of_a_steady_turn_is_scipys(name, source):
    """Full thrust and half the rudder to starboard, from rest, lags included."""
    swarm = started("tracking", SLOW | {"vehicle": name, "timing.integration_step_s": 0.01}, n=1)
    swarm.state.eta[...] = swarm.state.nu[...] = 0.0
    for _ in range(600):
        swarm.step(np.array([[[1.0, 0.5]]], np.float32))
    asked = source.thrust_n, -0.5 * math.radians(source.rudder_deg)
    solved = solve_ivp(fossen(source, asked), (0.0, 60.0), np.zeros(8), "DOP853", rtol=1e-12, atol=1e-12)
    x, y, psi, *nu = solved.y[:6, -1]
    assert math.dist(swarm.state.eta[0, 0, :2], (x, y)) < 1e-6
    assert math.remainder(swarm.state.eta[0, 0, 2] - psi, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-7)
    np.testing.assert_allclose(swarm.state.nu[0, 0], nu, atol=1e-7)
    assert psi > 2.0 * math.pi, "to starboard, more than a full circle"


@pytest.mark.parametrize("name", handling.every())
def test_every_vehicle_and_variant_runs_and_is_shown(name, tmp_path):
    changes = SLOW | {"vehicle": name, "trajectory.speed_mps": 0.5}
    swarm, policy = piloted("bio_inspired_plus", "single_obstacle", changes, n=4)
    scenario = swarm.scenario
    assert scenario.vehicle.name == name
    fly(swarm, policy, 20)
    assert np.isfinite(swarm.state.eta).all()
    assert (swarm.state.nu[0, :, 0] > 0.0).any()
    (tmp_path / "again.toml").write_text(to_toml(scenario))
    assert load_scenario(tmp_path / "again.toml").vehicle == scenario.vehicle
    shown = tomllib.loads(show_vehicle(name))
    plain, *variants = name.split("+")
    loaded = load_vehicle(plain)
    for section in ("vehicle", "actuators"):
        assert {field: loaded[section][field] for field in shown[section]} == shown[section]
    assert {*variants} <= {*shown.get("variants", {})}


def test_a_file_of_ones_own_has_variants_too(tmp_path):
    own = tmp_path / "my+boat.toml"
    own.write_text(
        show_vehicle("lauv").replace('"lauv"', '"mine"') + "\n[variants.heavy.vehicle]\nm_kg = 25.0  # weighed\n"
    )
    heavy = load_scenario("tracking", overrides=SLOW | {"vehicle": f"{own}+heavy"})
    assert (heavy.vehicle.name, heavy.vehicle.m_kg) == ("mine+heavy", 25.0)
    (tmp_path / "course.toml").write_text(
        'vehicle = "my+boat.toml+heavy"\nextends = "tracking"\n[trajectory]\nspeed_mps = 1\n'
    )
    assert load_scenario(tmp_path / "course.toml").vehicle == heavy.vehicle


@pytest.mark.parametrize(("before", "after", "name", "message"), [
        (r"\Z", f"{HEAVY}m_kg = 25.0", "+havy", "has no variant 'havy'; it has heavy"),
        (r"\Z", "\n[variants.heavy]\nm_kg = 25.0", "+heavy", "holds 'm_kg'; it may hold vehicle and actuators only"),
        (r"\Z", f"{HEAVY}mass = 25.0", "+heavy", "vehicle.mass is unknown"),
        ("^m_kg = .*", "", "", "lacks vehicle.m_kg; add this number to the file"),
        ("^lever_arm_m = .*", "", "", "lacks actuators.lever_arm_m"),
        (r"^\[vehicle\]", "[swarm]\nnum_vehicles = 3\n[vehicle]", "", "may hold vehicle and actuators only"),
        ("^m_kg = .*", "m_kg = ", "", "is not valid TOML"),
])  # fmt: skip
def test_a_vehicle_file_that_is_not_complete_or_lacks_a_variant_is_refused(before, after, name, message, tmp_path):
    own, (text, changes) = tmp_path / "mine.toml", re.subn(before, after, show_vehicle("lauv"), count=1, flags=re.M)
    assert changes == 1
    own.write_text(text)
    with pytest.raises(ScenarioError, match=re.escape(message)):
        load_scenario("tracking", overrides=SLOW | {"vehicle": f"{own}{name}"})


def test_a_vehicle_that_replaces_another_leaves_nothing_of_it():
    torpedo = load_scenario("tracking", overrides=SLOW | {"vehicle": "lauv"})
    assert (torpedo.actuators.kind, torpedo.actuators.yaw_lag_s) == ("rudder", 0.2)
    back, never = (load_scenario(s, overrides={**SLOW, "vehicle": "literature_185"}) for s in (torpedo, "tracking"))
    assert back.vehicle == never.vehicle
    assert back.actuators == never.actuators
