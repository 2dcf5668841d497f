"""Both engines compute the same, bit for bit: speed never changes physics, and the plain Python says what it is."""

import functools
import json
import math
import os
import subprocess
import sys
import types

import numba
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import uuv_marl
from tests import contract
from uuv_marl import load_scenario, scenario_names
from uuv_marl.baselines import make
from uuv_marl.sim import formulas, formulas_sonar
from uuv_marl.sim import model as model_module
from uuv_marl.sim.cells import ONE_CELL_UP_TO, fit, max_cells
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import plant
from uuv_marl.sim.workspace import Columns

BASE = load_scenario("tracking")
SIZES = (1, 2, 3, 54, 300, 600)
GRIDS = [n for n in SIZES if n > ONE_CELL_UP_TO]


def array(name, mounting, aperture, sub_sectors, range_m, kind="passive"):
    return {"name": name, "kind": kind, "mounting_deg": mounting, "aperture_deg": aperture, "range_m": range_m,
            "sub_sectors": sub_sectors}  # fmt: skip


OVERLAPPING = [
    array("a", 0, 120, 7, 100, "active"), array("b", 20, 180, 5, 300.5), array("c", 7, 360, 9, 150),
    array("d", -55, 33, 4, 4000), array("e", -30, 90, 3, 60, "active"),
]  # fmt: skip

# --- Whole episodes ---

COUPLED = {"vehicle.x_G_m": 0.05, "vehicle.Y_rdot_kgm": -4.0, "vehicle.Y_r": 12.0, "vehicle.N_v": -20.0,
           "vehicle.Y_rr": 15.0, "vehicle.N_rv": -40.0}  # fmt: skip
LIFT = {"vehicle.Y_uv": -60.0, "vehicle.Y_ur": 20.0, "vehicle.N_uv": 15.0, "vehicle.N_ur": -10.0, "vehicle.N_vv": -9.0}
ASTERN = {"actuators.max_astern_n": 700.0, "vehicle.munk_moment": False}
RUDDER = {"actuators.kind": "rudder", "actuators.Y_uud": 60.0, "actuators.N_uud": -40.0,
          "actuators.rudder_max_deg": 20.0, "actuators.max_astern_n": 0.0}  # fmt: skip
HIDING = {"sonar.obstacles_hide_vehicles": True}
CORNERS = {"trajectory.waypoints_m": [[0.0, 0.0], [4.0, 0.0], [4.0, 8.0]]}  # at 1 s and 3 s
FATAL = {"contact.ends_vehicle": True}
DAMPED = {"actuators.yaw_damping_nms": 600.0}
MANY_LOSSES = {"disturbance.loss_times_s": [0.6, 1.0, 1.1, 1.2]}
FINE = {"timing.decision_period_s": 0.5, "timing.integration_step_s": 0.02}
LOSSES = {"disturbance.loss_times_s": [0.3, 1.25, 1.25]}
SEA = {
    "current.speed_mps": 0.4, "current.variation_mps": 0.2, "current.eddies": 6, "current.eddy_speed_mps": 0.5,
    "mismatch.mass": 0.2, "mismatch.added_mass": 0.2, "mismatch.drag": 0.3, "mismatch.thrust": 0.2,
    "actuators.thrust_lag_s": 0.5, "actuators.yaw_lag_s": 0.3, "actuators.yaw_authority": 0.7,
    "sonar.channels": ["compass", "link", "current", "age", "modem"], "modem.period_s": 1.0,
    "faults": [
        {"kind": "thruster", "share": 0.4, "onset_s": 1.0},
        {"kind": "yaw", "share": 0.3, "onset_s": 0.5, "duration_s": 1.0, "efficiency": 0.3},
        {"kind": "member", "share": 0.2, "onset_s": 1.5},
    ],
}  # fmt: skip
SONAR = {
    "latency.travel_time": True, "latency.processing_s": 0.3, "latency.compensated": True,
    "latency.active_period_s": 0.25, "latency.passive_period_s": 0.5,
    "noise.bearing_deg": 4.0, "noise.range_m": 0.5, "noise.range_share": 0.03, "noise.passive_range_log_sd": 0.2,
    "noise.active_r50_m": 80.0, "noise.passive_r50_m": 200.0, "noise.silence_probability": 0.1,
    "noise.silence_readings": 3, "noise.false_echo_probability": 0.05,
    "navigation.drift_share": 0.05, "navigation.compass_bias_deg": 5.0,
    "sonar.channels": ["compass", "link", "age", "ranged"],
    "faults": [{"kind": "array", "array": "bow", "share": 0.3, "onset_s": 1.0, "duration_s": 1.0}],
}  # fmt: skip
RAW = {
    "latency.travel_time": True, "latency.sound_speed_mps": 150.0, "latency.processing_s": 0.1,
    "noise.passive_ranges": False, "noise.false_echo_probability": 0.2, "sonar.echo_reports": "surface",
}  # fmt: skip
QUICK = {
    "timing.decision_period_s": 0.1, "timing.control_hold_s": 0.1, "timing.integration_step_s": 0.0125
}  # fmt: skip
EPISODES = {
    **{name: (name, {"num_vehicles": n}, "") for n, name in enumerate(scenario_names(), 7)},
    "starter": ("starter", {}, "arrival"),
    "losses": ("lossy", {"overrides": LOSSES}, "lost"),
    "losses within a decision": ("lossy", {"overrides": {**LOSSES, **FINE}}, "lost arrival"),
    "all are lost": ("starter", {"overrides": {**FINE, **FATAL, **MANY_LOSSES}}, "lost end"),
    "a contact ends a vehicle": ("starter", {"overrides": {**FINE, **FATAL}}, "lost arrival"),
    "channels, echoes of surfaces": (
        "starter", {"overrides": {"sonar.channels": ["compass", "link"], "sonar.echo_reports": "surface"}}, "arrival"
    ),
    "link alone": ("multi_obstacle", {"num_vehicles": 9, "overrides": {"sonar.channels": ["link"]}}, ""),
    "obstacles hide": ("multi_obstacle", {"num_vehicles": 12, "overrides": HIDING}, ""),
    "corners on a tick": ("tracking", {"overrides": CORNERS}, ""),
    "overlapping arrays": ("single_obstacle", {"num_vehicles": 7, "overrides": {"sonar.arrays": OVERLAPPING}}, ""),
    "the sea": ("random_field", {"overrides": SEA}, "lost"),
    "the sea, five holds": ("starter", {"overrides": {**SEA, **FINE}}, "lost arrival"),
    "late and wrong sonar": ("random_field", {"overrides": {**SEA, **SONAR}}, ""),
    "late and wrong sonar, five holds": ("starter", {"overrides": {**SONAR, **FINE}}, "arrival"),
    "raw readings at each hold": ("multi_obstacle", {"num_vehicles": 9, "overrides": RAW}, ""),
    "five holds, lift, rudder": ("starter", {"overrides": {**FINE, **COUPLED, **LIFT, **RUDDER}}, "arrival"),
    "five holds, lift, less astern, no Munk moment": (
        "starter", {"overrides": {**FINE, **COUPLED, **LIFT, **ASTERN, **DAMPED}}, "arrival"
    ),
    "the sea, lift, rudder that lags": ("random_field", {"overrides": {**SEA, **LIFT, **RUDDER}}, "lost"),
    "in passage": ("starter", {"overrides": {"arrival.by": "passage"}}, "arrival"),
    "in passage, rudder, in scale": (
        "random_field", {"num_vehicles": 7, "overrides": {"vehicle": "lauv", "scale": "vehicle", **QUICK}}, "arrival"
    ),
    "five holds, coupled, damped": ("starter", {"overrides": {**FINE, **COUPLED, **DAMPED}}, "arrival"),
}  # fmt: skip
"""Scenario, changes, and what must happen beside echoes and contacts."""


def both(scenario, worlds=2, seed=0):
    """A swarm of each engine, at the same start."""
    swarms = [Swarm(scenario, worlds, engine=engine) for engine in ("numba", "plain")]
    for swarm in swarms:
        swarm.reset(seed)
    assert_same(*swarms)
    return swarms


def assert_same(ours, theirs):
    """Every array has the same bits."""
    theirs = theirs.snapshot()
    for name, array in ours.snapshot().items():
        np.testing.assert_array_equal(array, theirs[name], name)
        assert array.tobytes() == theirs[name].tobytes(), f"the sign of a zero in {name}"


def crowd(swarm, rng):
    """Vehicles about to touch an obstacle or each other, on one spot, inside an obstacle; headings beyond pi."""
    state, course, n = swarm.state, swarm.course, swarm.num_vehicles
    for w in range(swarm.num_worlds):
        x, y, radius = course.obstacles[w, 0] if course.num_obstacles[w] else (50.0, 20.0, 10.0)
        angle = rng.uniform(-math.pi, math.pi, n)
        away = radius + rng.uniform(1.05, 1.6, n)
        state.eta[w] = np.stack([x + away * np.cos(angle), y + away * np.sin(angle), angle + math.pi], 1)
        state.before[w] = state.eta[w, :, :2] + rng.normal(0.0, 3.0, (n, 2))
        state.nu[w] = [6.0, 0.5, 0.1] * rng.uniform(0.9, 1.1, (n, 1))
        state.eta[w, 1] = state.eta[w, 0] + [2.1 * math.cos(angle[0]), 2.1 * math.sin(angle[0]), 0.0]
        state.eta[w, 3, :2] = state.eta[w, 2, :2]
        state.eta[w, 4, :2] = x, y


def assemble(swarm, rng):
    """At rest around the trajectory's end, when l(t) is there."""
    for w in range(swarm.num_worlds):
        end = swarm.course.waypoints[w, swarm.course.last[w]]
        places = end + np.linspace(-9.0, 9.0, swarm.num_vehicles)[:, None] * [0.6, 0.8]
        swarm.state.eta[w, :, :2] = swarm.state.before[w] = places
        swarm.state.nu[w] = 0.0
        swarm.state.tick[w] = math.ceil(swarm.duration_s[w] / swarm.scenario.timing.control_hold_s)


def at_random(swarm, rng):
    action = rng.uniform(-1.2, 1.2, (swarm.num_worlds, swarm.num_vehicles, 2)).astype(np.float32)
    action[~swarm.state.alive] = np.nan
    return action


def episode(scenario, seed, worlds):
    """Decisions of both engines: random ones and a policy's, states written by hand, now and then a world that waits.

    Yields the compiled swarm after each step, once the other is known to be the same.
    """
    swarms = ours, _ = both(scenario, worlds, seed)
    policy = "bio_inspired_plus" if scenario.actuators.yaw_damping_nms else "bio_inspired"
    actor, rng = make(policy, scenario, worlds), np.random.default_rng(seed)
    actor.reset(seed)
    writes = {15: crowd, 25: assemble}
    for k in range(50):
        if k in writes:
            for swarm in swarms:
                writes[k](swarm, np.random.default_rng(k))
                swarm.observe()
            assert_same(*swarms)
        action = actor.act(ours.percept) if k % 10 < 5 else at_random(ours, rng)
        active = None if k % 7 else np.arange(worlds) != k % 2
        for swarm in swarms:
            swarm.step(0.0 * action if k >= 25 else action, active)
        assert_same(*swarms)
        yield ours


@pytest.mark.parametrize("name", EPISODES)
def test_engines_give_the_same_bits(name):
    scenario, change, happens = EPISODES[name]
    scenario, seen = load_scenario(scenario, **{"num_vehicles": 5, **change}), set()
    for worlds in (1, 2):
        for swarm in episode(scenario, worlds, worlds):
            facts, percept = swarm.facts, swarm.percept
            flags = {
                "heard": percept["heard"],
                "echo": percept["echo"],
                "contact": facts.contacts,
                "lost": facts.lost,
                "end": ~swarm.state.alive.any(1),
                "arrival": swarm.arrived,
                "diverged": facts.diverged >= 0,
            }
            seen |= {what for what, array in flags.items() if array.any()}
    assert seen == {"heard", "contact", *happens.split(), *(["echo"] if scenario.max_obstacles else [])}


def test_engines_agree_on_a_phantom_as_far_off_as_the_vehicle_beside_it():
    """Heard by bearings alone, all are put at one range, which float32 rounds up; who is there stays."""
    bearings = {"noise.passive_ranges": False, "noise.nominal_range_m": 12.3}
    false = {"noise.false_echo_probability": 1.0}
    true, _ = both(load_scenario("starter", overrides=bearings), 1)
    ours, _ = both(load_scenario("starter", overrides=bearings | false), 1)
    np.testing.assert_array_equal(ours.heard, true.heard)


@pytest.mark.parametrize("fine", [{}, FINE])
def test_engines_lose_the_same_vehicle_to_its_speed(fine, monkeypatch):
    monkeypatch.setattr(model_module, "plant", lambda scenario: plant(scenario)._replace(X_u=-2000.0, X_uu=0.0))
    swarms = both(load_scenario("starter", overrides=fine), 3)
    action = np.zeros((3, 5, 2), np.float32)
    action[0, 2], action[1, 4] = (1.0, 0.0), (-0.5, 0.0)
    for swarm in swarms:
        swarm.state.nu[...] = 0.0
    for _ in range(50):
        for swarm in swarms:
            swarm.step(action)
        assert_same(*swarms)
    assert swarms[0].facts.diverged.tolist() == [2, 4, -1]


# --- What a user takes an engine by ---


def test_environments_take_an_engine_and_give_the_same_episode():
    ours, theirs = (uuv_marl.parallel_env("starter", engine=engine) for engine in ("numba", "plain"))
    vector = uuv_marl.vector_env(2, "starter", engine="plain")
    for env in (ours, theirs, vector):
        env.reset(seed=3)
    for _ in range(10):
        (_, reward, *_), (_, same, *_) = (env.step({key: [0.9, 0.2] for key in env.agents}) for env in (ours, theirs))
        vector.step(np.full((2, 5, 2), [0.9, 0.2], np.float32))
        assert_same(ours.swarm, theirs.swarm)
        assert reward == same
    np.testing.assert_array_equal(vector.swarm.state.eta[0], ours.swarm.state.eta[0])


def test_an_engine_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="engine must be 'numba' or 'plain', got 'jax'"):
        Swarm(BASE, engine="jax")


@pytest.mark.parametrize("overrides", [{}, contract.SEA])
def test_without_a_compiler_a_run_is_the_same(overrides):
    """Either engine under NUMBA_DISABLE_JIT=1; policies decide the same but for rounding to float32 in between."""
    run = """
import json, sys
import numpy as np
from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES, granted, make
from uuv_marl.sim.swarm import Swarm
scenario = load_scenario("starter", overrides=json.loads(sys.argv[1]))
flat = []
for engine in ("numba", "plain"):
    swarm = Swarm(scenario, 2, engine)
    swarm.reset(0)
    for _ in range(8):
        percept = swarm.step(np.full((2, 5, 2), 0.5))
    flat.append(percept.flat.tobytes().hex())
actions = []
for name in POLICIES:
    swarm, policy = Swarm(granted(name, scenario)), make(name, granted(name, scenario))
    policy.reset(0)
    actions.append(policy.act(swarm.reset(0)).tolist())
print(json.dumps([flat, actions]))
"""
    (flat, actions), (slow_flat, slow_actions) = (
        json.loads(
            subprocess.run(
                [sys.executable, "-W", "error", "-c", run, json.dumps(overrides)], check=True,
                env={**os.environ, "NUMBA_DISABLE_JIT": disable},
                capture_output=True, text=True,
            ).stdout
        )
        for disable in "01"
    )  # fmt: skip
    assert len({*flat, *slow_flat}) == 1
    np.testing.assert_allclose(slow_actions, actions, rtol=0, atol=1e-4)


# --- Motion ---

CLOCKS = {
    "one hold": {},
    "five holds": {"timing.decision_period_s": 0.5},
    "fine steps": {"timing.integration_step_s": 0.02},
    "five holds of fine steps": FINE,
    "yaw damping": {"timing.decision_period_s": 0.5, **DAMPED},
    "coupled": {"timing.decision_period_s": 0.5, **COUPLED},
    "lift, less astern": {"timing.decision_period_s": 0.5, **COUPLED, **LIFT, **ASTERN},
    "nothing astern": {"timing.decision_period_s": 0.5, "actuators.max_astern_n": 0.0},
    "lift, rudder": {"timing.decision_period_s": 0.5, **COUPLED, **LIFT, **RUDDER},
}


@functools.cache
def fleets(clock):
    return both(load_scenario(BASE, num_vehicles=16, overrides=CLOCKS[clock]), 1)


@pytest.mark.parametrize("clock", CLOCKS)
@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e-6, 300.0]), st.booleans())
def test_engines_move_vehicles_alike_from_any_state(clock, seed, size, astern):
    rng, swarms = np.random.default_rng(seed), fleets(clock)
    n = swarms[0].num_vehicles
    places = rng.uniform(-1000, 1000, (n, 2)) * size
    headings = rng.uniform(-math.pi, math.pi, n)
    if astern:  # where the heading wraps
        headings = math.pi * (1.0 - 10.0 ** rng.uniform(-16, -1, n)) * rng.choice([-1, 1], n)
    velocities = rng.uniform(-1, 1, (n, 3)) * [6, 3, 3] * size
    action = (rng.uniform(-1.5, 1.5, (1, n, 2)) * size).astype(np.float32)
    for swarm in swarms:
        swarm.state.eta[0, :, :2], swarm.state.eta[0, :, 2], swarm.state.nu[0] = places, headings, velocities
        swarm.observe()
    assert_same(*swarms)
    for swarm in swarms:
        swarm.step(action)
    assert_same(*swarms)


@pytest.mark.parametrize("size", [1.0, 1e10, 1e25, 3e38])
def test_an_action_of_any_size_is_projected_onto_the_unit_disc(size):
    for swarm in fleets("one hold"):
        swarm.reset(0)
        swarm.step(np.full((1, swarm.num_vehicles, 2), size, np.float32))
        np.testing.assert_allclose(swarm.facts.effort, 1.0, rtol=1e-15)


# --- Sine and cosine ---


@given(st.floats(-1000, 1000))
@example(1000.0)
@example(-math.pi)
def test_cos_sin_is_the_library_s(angle):
    c, s = cos_sin(angle)
    assert abs(c - math.cos(angle)) <= 1e-15
    assert abs(s - math.sin(angle)) <= 1e-15
    assert abs(c * c + s * s - 1.0) <= 1e-15


def test_cos_sin_at_and_around_the_edges_of_quadrants():
    for quarter in range(-640, 641):
        for edge in (quarter * math.pi / 2, quarter * math.pi / 2 + math.pi / 4):
            for angle in (edge, math.nextafter(edge, math.inf), math.nextafter(edge, -math.inf)):
                c, s = cos_sin(angle)
                assert abs(c - math.cos(angle)) <= 1e-15
                assert abs(s - math.sin(angle)) <= 1e-15
                mirrored = cos_sin(-angle)
                assert abs(c - mirrored[0]) <= 2.3e-16
                assert abs(s + mirrored[1]) <= 2.3e-16


def test_cosine_is_even_and_sine_odd_and_both_exact_at_zero():
    for angle in np.random.default_rng(0).uniform(-1000, 1000, 1000):
        c, s = cos_sin(angle)
        assert cos_sin(-angle) == (c, -s)
    assert cos_sin(0.0) == (1.0, 0.0)
    assert cos_sin(1e-200) == (1.0, 1e-200)
    assert all(map(math.isnan, cos_sin(math.nan)))


# --- Neighbours, distances, contacts ---


def compiled_copy(*modules):
    """Modules' functions compiled as they stand, so that swarms of hundreds can be compared with them."""
    space = {name: value for module in modules for name, value in vars(module).items()}
    for name, function in list(space.items()):
        if isinstance(function, types.FunctionType) and function.__module__ in {module.__name__ for module in modules}:
            space[name] = numba.njit(types.FunctionType(function.__code__, space, name))
    return types.SimpleNamespace(**space)


PLAIN = compiled_copy(formulas, formulas_sonar)


SUITES = {
    "as set": None,
    "hiding": None,
    "overlapping": OVERLAPPING,
    "twice": [array("a", 0, 120, 4, 100), array("b", 0, 120, 4, 500), array("c", 0, 120, 4, 100)],
    "blind gaps": [array("a", 0, 60, 3, 100, "active"), array("b", 180, 30, 1, 500), array("c", 32, 4, 1, 250)],
    "one wide": [array("a", 0, 120, 1, 500)],
    "narrow": [array("a", 0, 5, 64, 500), array("b", 180, 5, 64, 500)],
    "nearly coincident edges": [
        array("a", 0, 60, 2, 500), array("b", 45 + 1e-7, 30, 1, 500), array("c", 90, 60 - 2e-7, 1, 500),
        array("d", -30, 60 + 2e-7, 3, 300), array("e", 180, 120, 3, 500),
    ],
}  # fmt: skip


def turned_by_30(rng, n):
    return rng.integers(-6, 6, n) * (math.pi / 6)


def headed(rng, x, y, psi=None):
    n = len(x)
    return np.stack([x, y, rng.uniform(-math.pi, math.pi, n) if psi is None else psi], 1)


def uniform(rng, n):
    return headed(rng, *rng.uniform(-30, 30, (2, n)) * math.sqrt(n))


def lattice(rng, n):
    """Equal distances, and bearings on edges."""
    side = math.ceil(math.sqrt(1.3 * n))
    chosen = rng.permutation(side * side)[:n]
    return headed(rng, chosen // side * 20.0, chosen % side * 20.0, turned_by_30(rng, n))


def line(rng, n):
    along = rng.permutation(n) * 13.0
    return headed(rng, *((along, 0.0 * along) if rng.random() < 0.5 else (0.0 * along, along)), turned_by_30(rng, n))


def oblique_line(rng, n):
    along = rng.uniform(0, 20.0 * n, n)
    return headed(rng, 0.6 * along, -0.8 * along)


def all_in_a_metre(rng, n):
    return headed(rng, *rng.uniform(50, 51, (2, n)))


def coincident(rng, n):
    x, y = rng.uniform(-100, 100, (2, (n + 2) // 3))
    return headed(rng, np.resize(x, n), np.resize(y, n))


def two_clusters(rng, n):
    away = rng.integers(0, 2, n)
    return headed(rng, *rng.normal(0, 40, (2, n)) + np.outer([3000.0, -4000.0], away))


def outlier(rng, n):
    eta = uniform(rng, n)
    eta[rng.integers(n), :2] = 12000.0, -16000.0
    return eta


def range_edges(rng, n):
    """Around the first vehicle, one ulp inside, at and outside the ranges of 100 m and 500 m."""
    edge = rng.choice([100.0, 500.0], n)
    radius = np.choose(rng.integers(0, 3, n), [edge, np.nextafter(edge, 0), np.nextafter(edge, 1e9)])
    where = rng.integers(0, 12, n)
    axes = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [0.6, 0.8], [-0.8, 0.6]])[where % 6].T
    angle = rng.uniform(-math.pi, math.pi, n)
    x, y = radius * np.where(where < 6, axes, [np.cos(angle), np.sin(angle)])
    x[0] = y[0] = 0.0
    return headed(rng, x, y, turned_by_30(rng, n))


def rows_on_cell_edges(rng, n):
    """Few vehicles far apart on a lattice of whole cells, the others in a corner; bearings on edges."""
    along = np.arange(36) * 97.5
    x, y = (along % (6 * 97.5))[:n], (along // (6 * 97.5) * 97.5)[:n]
    eta = headed(rng, np.zeros(n), np.zeros(n), turned_by_30(rng, n))
    eta[: len(x), 0], eta[: len(x), 1] = x, y
    eta[36:, :2] = rng.uniform(0, 0.5, (max(n - 36, 0), 2))
    return rng.permuted(eta, axis=0) if n < 36 else eta


def far_away(rng, n):
    return uniform(rng, n) + np.array([1e7, -3e7, 0.0])


def some_lost(rng, n):
    return uniform(rng, n)


def all_lost(rng, n):
    return uniform(rng, n)


def all_lost_but_one(rng, n):
    return uniform(rng, n)


LAYOUTS = (uniform, lattice, line, oblique_line, all_in_a_metre, coincident, two_clusters, outlier, range_edges,
           rows_on_cell_edges, far_away, some_lost, all_lost, all_lost_but_one)  # fmt: skip
DISCS = ((40.0, 30.0, 25.0), (-80.0, 20.0, 10.0), (50.5, 50.5, 0.3), (150.0, -200.0, 60.0))


@functools.cache
def world(suite, n):
    """A world to be filled by hand."""
    changes = {"sonar.obstacles_hide_vehicles": suite == "hiding"}
    if SUITES[suite]:
        changes["sonar.arrays"] = SUITES[suite]
    discs = [{"centre_m": [5000.0 + 200.0 * k, 9000.0], "radius_m": disc[2]} for k, disc in enumerate(DISCS)]
    swarm = Swarm(load_scenario(BASE, num_vehicles=n, overrides={**changes, "obstacles": discs}))
    swarm.reset(0)
    swarm.course.obstacles[0] = DISCS
    return swarm


def fill(swarm, layout, seed):
    rng, n = np.random.default_rng(seed), swarm.num_vehicles
    state = swarm.state
    state.eta[0] = layout(rng, n)
    state.before[0] = state.eta[0, :, :2] + rng.normal(0, 1, (n, 2))
    state.alive[0] = rng.random(n) < {some_lost: 0.7, all_lost: 0.0, all_lost_but_one: 0.0}.get(layout, 1.0)
    if layout is all_lost_but_one:
        state.alive[0, rng.integers(n)] = True
    if layout is far_away:
        swarm.course.obstacles[0, :, :2] = np.array(DISCS)[:, :2] + [1e7, -3e7]
    else:
        swarm.course.obstacles[0] = DISCS
    state.obstacles_before[0] = swarm.course.obstacles[0]
    swarm.observe()


def sectors(swarm):
    return formulas_sonar.Sectors(*(np.array(part) for part in formulas_sonar.sub_sectors(swarm.scenario.sonar.arrays)))


def check(swarm):
    """The world as the plain functions see it."""
    facts, alive, hull = swarm.facts, swarm.state.alive[0], swarm.scenario.contact.hull_radius_m
    eta, before = swarm.state.eta[0], swarm.state.before[0]
    discs = swarm.course.obstacles[0, : swarm.course.num_obstacles[0]]
    heading = np.array([formulas.cos_sin(psi) for psi in eta[:, 2].tolist()])
    np.testing.assert_array_equal(swarm.heading[0], heading)

    suite, hiding = sectors(swarm), discs if swarm.scenario.sonar.obstacles_hide_vehicles else discs[:0]
    heard = np.full(swarm.heard[0].shape, -1)
    for i in np.flatnonzero(alive):
        heard[i] = PLAIN.hear(i, eta, heading, alive, suite, hiding)
    np.testing.assert_array_equal(swarm.heard[0], heard)
    dx, dy = (eta[heard, axis] - eta[:, None, axis] for axis in (0, 1))
    c, s = heading[:, None, 0], heading[:, None, 1]
    there = np.stack([c * dx + s * dy, c * dy - s * dx], 2).astype(np.float32)
    np.testing.assert_array_equal(swarm.percept["neighbour"][0], np.where(heard[:, :, None] >= 0, there, 0))

    spacing, largest, met = PLAIN.between_vehicles(eta, before, alive, hull)
    clearance, reached, touched = PLAIN.to_obstacles(eta, before, alive, hull, discs, discs)
    np.testing.assert_array_equal(facts.spacing[0], spacing)
    assert (facts.min_spacing[0], facts.max_spacing[0]) == (min(spacing), largest)
    np.testing.assert_array_equal(facts.clearance[0], clearance)
    np.testing.assert_array_equal(facts.obstacle_clearance[0, : len(discs)], reached)
    np.testing.assert_array_equal(facts.contacts[0], np.add(met, touched))
    assert facts.collisions[0] == sum(met) // 2 + sum(touched)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
@pytest.mark.parametrize("suite", SUITES)
def test_neighbours_distances_and_contacts_are_those_of_the_plain_functions(suite, layout):
    for n in SIZES if suite in ("as set", "hiding") else (3, 54, 300):
        for seed in range(2 if n > 54 else 4):
            swarm = world(suite, n)
            fill(swarm, layout, seed)
            check(swarm)


@pytest.mark.parametrize("n", [ONE_CELL_UP_TO, ONE_CELL_UP_TO + 1])
@pytest.mark.parametrize("suite", ["as set", "overlapping"])
def test_the_last_swarm_of_one_cell_and_the_first_of_many(suite, n):
    for layout in LAYOUTS:
        fill(world(suite, n), layout, 5)
        check(world(suite, n))


def test_a_bearing_on_an_edge_along_the_border_of_a_cell_is_heard():
    """Far from the listener, where rounding puts the sub-sector's edge into the next row or column of cells."""
    n, cell = 300, 16.25
    for mounting in np.arange(-166.0, -158.0) + 0.3:
        sonar = {"sonar.arrays": [array("a", mounting, 60, 1, 500)]}
        swarm = Swarm(load_scenario(BASE, num_vehicles=n, overrides=sonar))
        swarm.reset(0)
        (lower,), (upper,), *_ = sectors(swarm)
        for k, distance in ((k, distance) for k in range(8) for distance in (6 * cell, 8 * cell)):
            edge, quarter = (lower, upper)[k // 4], k % 4
            ahead = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)][quarter])
            eta = np.zeros((n, 3))
            eta[:, :2] = -12 * cell
            eta[:, 1 - quarter % 2] = -cell
            eta[0, 2] = math.remainder(quarter * math.pi / 2 - math.atan2(edge[1], edge[0]), 2 * math.pi)
            eta[0, :2], eta[1, :2], eta[2, :2] = 0.0, distance * ahead, 12 * cell
            swarm.state.eta[0], swarm.state.before[0] = eta, eta[:, :2]
            swarm.observe()
            check(swarm)


def test_bearings_within_rounding_of_an_edge_where_two_bins_of_direction_meet():
    """There the bearing may fall into the one bin and the edge into the other."""
    for bearing in range(-127, 128, 15):
        share = bearing / 128.0
        lower = math.degrees(math.atan2(share, 1.0 - abs(share)))
        sonar = {"sonar.arrays": [array("a", lower - 10, 20, 2, 500), array("b", lower + 10, 20, 2, 500)]}
        swarm = Swarm(load_scenario(BASE, num_vehicles=2, overrides=sonar))
        swarm.reset(0)
        edge = sectors(swarm).upper[1] * 64.0
        for nudge in np.ndindex(5, 5):
            swarm.state.eta[0] = 0.0
            swarm.state.eta[0, 1, :2] = edge + (np.array(nudge) - 2) * np.spacing(edge)
            swarm.observe()
            check(swarm)


def grid_of(eta, side=16.25):
    now = Columns(*np.zeros((len(Columns._fields), len(eta))))
    now.x[:], now.y[:] = eta[:, 0], eta[:, 1]
    return fit(0, np.ones((1, len(eta)), bool), side, now)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_large_swarms_have_a_grid_of_bounded_size_and_small_ones_one_cell(layout):
    for n in GRIDS:
        grid = grid_of(layout(np.random.default_rng(0), n))
        assert 1 <= grid.rows * grid.columns <= max_cells(n)
        if layout not in (all_in_a_metre,):
            assert grid.rows * grid.columns > 1
    for n in (1, ONE_CELL_UP_TO):
        grid = grid_of(layout(np.random.default_rng(0), n))
        assert (grid.rows, grid.columns) == (1, 1)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_one_lost_vehicle_more_calls_for_a_grid_and_changes_nothing(layout):
    few, more = world("as set", ONE_CELL_UP_TO), world("as set", ONE_CELL_UP_TO + 1)
    few.state.nu[0] = 0.0
    fill(few, layout, 7)
    for ours, theirs in zip(more.state[:4], few.state[:4], strict=True):
        ours[0, :-1] = theirs[0]
    more.state.alive[0, -1] = False
    more.course.obstacles[0] = more.state.obstacles_before[0] = few.course.obstacles[0]
    more.observe()
    np.testing.assert_array_equal(more.heard[0, :-1], few.heard[0])
    np.testing.assert_array_equal(more.percept.flat[0, :-1], few.percept.flat[0])
    np.testing.assert_array_equal(more.facts.spacing[0, :-1], few.facts.spacing[0])
    np.testing.assert_array_equal(more.facts.contacts[0, :-1], few.facts.contacts[0])
    assert more.facts.max_spacing[0] == few.facts.max_spacing[0]


@pytest.mark.parametrize("engine", ["numba", "plain"])
def test_a_vehicle_at_rest_on_a_hull_s_distance_from_an_obstacle_never_touches_it(engine):
    """Where two ways of computing a distance differ by an ulp, an old gap must not count as a new contact."""
    offset = np.random.default_rng(0).uniform(20, 40, (10000, 2))
    x, y = next((x, y) for x, y in offset if math.sqrt(x * x + y * y) < math.hypot(x, y))
    disc = {"centre_m": [9e3, 9e3], "radius_m": 1.0}
    one = Swarm(load_scenario(BASE, num_vehicles=1, overrides={"obstacles": [disc]}), engine=engine)
    one.reset(0)
    one.state.eta[0], one.state.nu[0], one.course.obstacles[0, 0] = 0.0, 0.0, (x, y, math.hypot(x, y) - 1.0)
    one.state.obstacles_before[...] = one.course.obstacles
    for _ in range(3):
        one.step(np.zeros((1, 1, 2), np.float32))
        assert one.facts.collisions[0] == 0


SHAPES = {
    "single": lambda n: np.zeros((1, 2)),
    "two": lambda n: np.array([[0.0, 0.0], [3.0, 4.0]]),
    "identical": lambda n: np.full((n, 2), 7.3),
    "circle": lambda n: 200.0 * np.array([[math.cos(6.3 * k / n), math.sin(6.3 * k / n)] for k in range(n)]),
    "triangle": lambda n: np.array([[0.0, 0.0], [100.0, 0.0], [50.0, 50.0 * math.sqrt(3)]])[np.arange(n) % 3],
    "line": lambda n: np.outer(np.arange(n), [3.0, 4.0]),
    "heavy end": lambda n: np.vstack([np.zeros((n - 2, 2)), [[300.0, 0.0], [280.0, 120.0]]]),
    "lens": lambda n: np.vstack([np.outer(np.linspace(-1, 1, n - 2), [99.0, 0.0]), [[0.0, 100.0], [0.0, -100.0]]]),
    "random": lambda n: np.random.default_rng(n).normal(0, 100, (n, 2)),
}  # fmt: skip


@pytest.mark.parametrize("n", [54, 300])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_largest_distance_is_found_whatever_the_shape(shape, n):
    for shift in (0.0, 1e6):
        points = SHAPES[shape](n) + shift
        swarm = world("as set", n)
        swarm.state.eta[0, : len(points), :2] = swarm.state.before[0, : len(points)] = points
        swarm.state.alive[0] = np.arange(n) < len(points)
        swarm.observe()
        check(swarm)
