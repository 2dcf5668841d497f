"""The simulation against ``tests/oracle``, an independent implementation of the paper; the same bits uncompiled."""

import functools
import json
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import contract
from tests.conftest import COUPLED, LIFT, RUDDER
from tests.golden import STARTER
from tests.oracle import motion, sonar
from tests.processes import python
from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy
from uuv_marl.sim.cells import ONE_CELL_UP_TO
from uuv_marl.sim.trigonometry import cos_sin, rotated

BASE = load_scenario("tracking")
SIZES = (1, 2, 3, 54, ONE_CELL_UP_TO, ONE_CELL_UP_TO + 1, 300, 600)


@pytest.mark.parametrize("overrides", [{}, contract.SEA, contract.TALK])
def test_without_a_compiler_a_run_is_the_same(overrides):
    """Under NUMBA_DISABLE_JIT=1; actions of policies differ only by rounding to float32."""
    run = """
import json, sys
import numpy as np
from uuv_marl import load_scenario
from tests.nets import ANYWHERE
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.sim.swarm import Swarm
scenario = load_scenario("starter", num_vehicles=3, overrides=json.loads(sys.argv[1]))
swarm = Swarm(scenario, 2)
swarm.reset(0)
for _ in range(8):
    swarm.step(np.full((2, 3, scenario.action_size), 0.5))
bits = {name: array.tobytes().hex() for name, array in swarm.snapshot().items()}
actions = []
for name in () if scenario.current.flows else ANYWHERE:
    own = with_policy_requirements(name, scenario)
    swarm, policy = Swarm(own), make_policy(name, own)
    policy.reset(0)
    actions.extend(policy.act(swarm.reset(0)).ravel().tolist())
print(json.dumps([bits, actions]))
"""
    (bits, actions), (slow_bits, slow_actions) = (
        json.loads(python("-c", run, json.dumps(overrides), PYTHONWARNINGS="error", NUMBA_DISABLE_JIT=disable))
        for disable in "01"
    )
    assert [name for name in bits if slow_bits[name] != bits[name]] == []
    np.testing.assert_allclose(slow_actions, actions, rtol=0, atol=1e-4)


ASTERN = {"actuators.max_astern_n": 700.0, "vehicle.munk_moment": False}
HELD = {"timing.decision_period_s": 0.5}
FINE = {**HELD, "timing.integration_step_s": 0.02}
LATE = {"actuators.thrust_lag_s": 0.5, "actuators.yaw_lag_s": 0.3, "actuators.yaw_authority": 0.7,
        "current.speed_mps": 0.4, "current.direction_deg": 60.0}  # fmt: skip
CLOCKS = {
    "one hold": {},
    "five holds of fine steps": FINE,
    "yaw damping": {**HELD, "actuators.yaw_damping_nms": 600.0},
    "lift, less astern": {**HELD, **COUPLED, **LIFT, **ASTERN},
    "nothing astern": {**HELD, "actuators.max_astern_n": 0.0},
    "lift, rudder": {**HELD, **COUPLED, **LIFT, **RUDDER},
    "lagging, in a current": {**HELD, **COUPLED, **LATE},
    "lagging, rudder": {**FINE, **LIFT, **RUDDER, **LATE},
}  # fmt: skip


@functools.cache
def fleet(clock):
    return started(BASE, CLOCKS[clock], n=8)


@pytest.mark.parametrize("clock", CLOCKS)
@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e-6]), st.booleans())
def test_vehicles_move_as_the_paper_says_from_any_state(clock, seed, size, astern):
    rng, swarm = np.random.default_rng(seed), fleet(clock)
    n, state, disturbances = swarm.num_vehicles, swarm.state, swarm._disturbances
    state.eta[0, :, :2], state.eta[0, :, 2] = rng.uniform(-1000, 1000, (n, 2)), rng.uniform(-math.pi, math.pi, n)
    if astern:  # where the heading wraps
        state.eta[0, :, 2] = math.pi * (1.0 - 10.0 ** rng.uniform(-16, -1, n)) * rng.choice([-1, 1], n)
    state.nu[0] = rng.uniform(-1, 1, (n, 3)) * [6, 3, 3] * size
    swarm.observe()
    given = np.zeros((n, 2)) if disturbances is None else disturbances.hull.tau[0].copy()
    if swarm.scenario.actuators.kind == "rudder":
        given[:, 1] *= math.copysign(1.0, swarm.scenario.actuators.N_uud)
    action = (rng.uniform(-1.5, 1.5, (1, n, 2)) * size).astype(np.float32)
    before, flow = np.hstack([state.eta[0], state.nu[0]]), swarm.flow[0].copy()
    swarm.step(action)
    for i in range(n):
        after, _, demand = motion.decide(before[i], action[0, i].astype(float), swarm.scenario, given[i], flow[i])
        np.testing.assert_allclose(state.eta[0, i, :2], after[:2], rtol=0, atol=1e-9)
        assert abs(math.remainder(state.eta[0, i, 2] - after[2], 2 * math.pi)) <= 1e-9
        np.testing.assert_allclose(state.nu[0, i], after[3:], rtol=1e-9, atol=1e-9 * size)
        assert swarm.facts.effort[0, i] == pytest.approx(demand, rel=1e-9)


@pytest.mark.parametrize("size", [1.0, 1e10, 1e25, 3e38])
def test_an_action_of_any_size_is_projected_onto_the_unit_disc(size):
    swarm = fleet("one hold")
    swarm.reset(0)
    swarm.step(np.full((1, swarm.num_vehicles, 2), size, np.float32))
    np.testing.assert_allclose(swarm.facts.effort, 1.0, rtol=1e-15)


def test_rotated_points_are_rounded_twice_as_a_fused_product_is():
    rng = np.random.default_rng(0)
    points, angles = rng.uniform(-300.0, 300.0, (200, 2)), rng.uniform(-np.pi, np.pi, 200)
    for (x, y), angle in zip(points.tolist(), angles.tolist(), strict=True):
        c, s = cos_sin(angle)
        wanted = [float(Fraction(y) * Fraction(a) + Fraction(x * b)) for a, b in ((-s, c), (c, s))]
        assert rotated(np.array([x, y]), c, s).tolist() == wanted
    many = rotated(points, *cos_sin(0.7))
    np.testing.assert_array_equal(many, [rotated(point, *cos_sin(0.7)) for point in points])


def test_cos_sin_is_the_library_s_even_and_odd():
    quarters = np.arange(-640, 641) * math.pi / 2
    edges = np.concatenate([quarters, quarters + math.pi / 4])
    at_random = np.random.default_rng(0).uniform(-1000, 1000, 2000)
    for angle in np.concatenate(
        [edges, np.nextafter(edges, 1e9), np.nextafter(edges, -1e9), at_random, [1000.0]]
    ).tolist():
        c, s = cos_sin(angle)
        assert abs(c - math.cos(angle)) <= 1e-15
        assert abs(s - math.sin(angle)) <= 1e-15
        np.testing.assert_allclose(cos_sin(-angle), (c, -s), rtol=0, atol=2.3e-16)
    for angle in at_random.tolist():
        assert cos_sin(-angle) == (cos_sin(angle)[0], -cos_sin(angle)[1])
    assert cos_sin(0.0) == (1.0, 0.0)
    assert cos_sin(1e-200) == (1.0, 1e-200)
    assert all(map(math.isnan, cos_sin(math.nan)))


def array(name, mounting, aperture, sub_sectors, range_m, kind="passive"):
    return {"name": name, "kind": kind, "mounting_deg": mounting, "aperture_deg": aperture, "range_m": range_m,
            "sub_sectors": sub_sectors}  # fmt: skip


OVERLAPPING = [
    array("a", 0, 120, 7, 100, "active"), array("b", 20, 180, 5, 300.5), array("c", 7, 360, 9, 150),
    array("d", -55, 33, 4, 4000), array("e", -30, 90, 3, 60, "active"),
]  # fmt: skip

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


LAYOUTS = {layout.__name__: layout for layout in (
    uniform, lattice, line, oblique_line, all_in_a_metre, coincident, two_clusters, outlier, range_edges,
    rows_on_cell_edges, far_away,
)} | dict.fromkeys(("some_lost", "all_lost", "all_lost_but_one"), uniform)  # fmt: skip
DISCS = ((40.0, 30.0, 25.0), (-80.0, 20.0, 10.0), (50.5, 50.5, 0.3), (150.0, -200.0, 60.0))


@functools.cache
def world(suite, n):
    """A world to be filled by the test."""
    changes = {"sonar.obstacles_hide_vehicles": suite == "hiding"}
    if SUITES[suite]:
        changes["sonar.arrays"] = SUITES[suite]
    discs = [{"centre_m": [5000.0 + 200.0 * k, 9000.0], "radius_m": disc[2]} for k, disc in enumerate(DISCS)]
    swarm = started(BASE, {**changes, "obstacles": discs}, n=n)
    swarm.world_map.obstacles[0] = DISCS
    return swarm


def fill(swarm, layout, seed):
    rng, n = np.random.default_rng(seed), swarm.num_vehicles
    state = swarm.state
    state.eta[0] = LAYOUTS[layout](rng, n)
    state.before[0] = state.eta[0, :, :2] + rng.normal(0, 1, (n, 2))
    state.alive[0] = rng.random(n) < {"some_lost": 0.7, "all_lost": 0.0, "all_lost_but_one": 0.0}.get(layout, 1.0)
    if layout == "all_lost_but_one":
        state.alive[0, rng.integers(n)] = True
    if layout == "far_away":
        swarm.world_map.obstacles[0, :, :2] = np.array(DISCS)[:, :2] + [1e7, -3e7]
    else:
        swarm.world_map.obstacles[0] = DISCS
    state.obstacles_before[0] = swarm.world_map.obstacles[0]
    swarm.observe()


def check(swarm):
    """Compare distances, collisions and detections with the oracle's."""
    facts, alive, hull = swarm.facts, swarm.state.alive[0], swarm.scenario.collision.hull_radius_m
    eta, now, before = swarm.state.eta[0], swarm.state.eta[0, :, :2], swarm.state.before[0]
    discs, heading = swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0]], swarm.heading[0]
    np.testing.assert_allclose(heading, np.stack([np.cos(eta[:, 2]), np.sin(eta[:, 2])], 1), rtol=0, atol=1e-15)

    hiding = discs if swarm.scenario.sonar.obstacles_hide_vehicles else ()
    heard = sonar.heard(now, heading, alive, swarm.scenario.sonar.arrays, hiding)
    np.testing.assert_array_equal(swarm.detected_index[0], heard)
    there = sonar.to_body(now[heard] - now[:, None], heading[:, None]).astype(np.float32)
    np.testing.assert_array_equal(swarm.percept["neighbour"][0], np.where(heard[:, :, None] >= 0, there, 0))

    spacing, largest, met = sonar.vehicles(now, before, alive, hull)
    clearance, reached, touched = sonar.obstacles(now, before, alive, hull, discs)
    np.testing.assert_array_equal(facts.spacing[0], spacing)
    assert (facts.min_spacing[0], facts.max_spacing[0]) == (min(spacing), largest)
    np.testing.assert_array_equal(facts.clearance[0], clearance)
    np.testing.assert_array_equal(facts.obstacle_clearance[0, : len(discs)], reached)
    np.testing.assert_array_equal(facts.vehicle_collisions[0], met + touched)
    assert facts.collisions[0] == sum(met) // 2 + sum(touched)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("suite", SUITES)
def test_neighbours_distances_and_collisions_are_those_of_the_oracle(suite, layout):
    for n in SIZES if suite == "as set" else (1, 2, 3, 54, 300) if suite == "hiding" else (3, 54, 300):
        for seed in range({300: 2, 600: 1}.get(n, 4)):
            swarm = world(suite, n)
            fill(swarm, layout, seed)
            check(swarm)


def test_a_bearing_on_an_edge_along_the_border_of_a_cell_is_detected():
    """Far from the listener, where rounding puts the sub-sector's edge into the next row or column of cells."""
    n, cell = 300, 16.25
    for mounting in np.arange(-166.0, -158.0) + 0.3:
        swarm = started(BASE, {"sonar.arrays": [array("a", mounting, 60, 1, 500)]}, n=n)
        (lower,), (upper,), *_ = sonar.sectors(swarm.scenario.sonar.arrays)
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
        arrays = {"sonar.arrays": [array("a", lower - 10, 20, 2, 500), array("b", lower + 10, 20, 2, 500)]}
        swarm = started(BASE, arrays, n=2)
        edge = sonar.sectors(swarm.scenario.sonar.arrays)[1][1] * 64.0
        for nudge in np.ndindex(5, 5):
            swarm.state.eta[0] = 0.0
            swarm.state.eta[0, 1, :2] = edge + (np.array(nudge) - 2) * np.spacing(edge)
            swarm.observe()
            check(swarm)


def test_a_vehicle_at_rest_at_a_hull_s_radius_from_an_obstacle_never_collides():
    """Where two ways of computing a distance differ by an ulp, an old gap must not count as a new collision."""
    offset = np.random.default_rng(0).uniform(20, 40, (10000, 2))
    x, y = next((x, y) for x, y in offset if math.sqrt(x * x + y * y) < math.hypot(x, y))
    disc = {"centre_m": [9e3, 9e3], "radius_m": 1.0}
    one = started(BASE, {"obstacles": [disc]}, n=1)
    one.state.eta[0], one.state.nu[0], one.world_map.obstacles[0, 0] = 0.0, 0.0, (x, y, math.hypot(x, y) - 1.0)
    one.state.obstacles_before[...] = one.world_map.obstacles
    for _ in range(3):
        one.step(np.zeros((1, 1, 2), np.float32))
        assert one.facts.collisions[0] == 0


SHAPES = {
    "circle": lambda n: 200.0 * np.array([[math.cos(6.3 * k / n), math.sin(6.3 * k / n)] for k in range(n)]),
    "triangle": lambda n: np.array([[0.0, 0.0], [100.0, 0.0], [50.0, 50.0 * math.sqrt(3)]])[np.arange(n) % 3],
    "heavy end": lambda n: np.vstack([np.zeros((n - 2, 2)), [[300.0, 0.0], [280.0, 120.0]]]),
    "lens": lambda n: np.vstack([np.outer(np.linspace(-1, 1, n - 2), [99.0, 0.0]), [[0.0, 100.0], [0.0, -100.0]]]),
}  # fmt: skip


@pytest.mark.parametrize("n", [54, 300])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_largest_distance_is_found_whatever_the_shape(shape, n):
    for shift in (0.0, 1e6):
        points = SHAPES[shape](n) + shift
        swarm = world("as set", n)
        swarm.state.eta[0, :, :2] = swarm.state.before[0] = points
        swarm.state.alive[0] = True
        swarm.observe()
        check(swarm)


EPISODES = {
    "surfaces, all channels": (
        STARTER, {"overrides": {"sonar.channels": ["compass", "link"], "sonar.echo_reports": "surface"}}
    ),
    "link alone": ("multi_obstacle", {"n": 9, "overrides": {"sonar.channels": ["link"]}}),
    "obstacles hide": ("multi_obstacle", {"n": 12, "overrides": {"sonar.obstacles_hide_vehicles": True}}),
    "overlapping arrays": ("single_obstacle", {"n": 7, "overrides": {"sonar.arrays": OVERLAPPING}}),
    "losses": ("random_field", {"n": 6, "overrides": {"losses.times_s": [0.3, 1.25, 1.25]}}),
}  # fmt: skip


def crowd(swarm, rng):
    """Vehicles about to hit an obstacle or each other, on one spot, inside an obstacle; headings beyond pi."""
    state, n = swarm.state, swarm.num_vehicles
    x, y, radius = swarm.world_map.obstacles[0, 0] if swarm.world_map.num_obstacles[0] else (50.0, 20.0, 10.0)
    angle = rng.uniform(-math.pi, math.pi, n)
    away = radius + rng.uniform(1.05, 1.6, n)
    state.eta[0] = np.stack([x + away * np.cos(angle), y + away * np.sin(angle), angle + math.pi], 1)
    state.before[0] = state.eta[0, :, :2] + rng.normal(0.0, 3.0, (n, 2))
    state.nu[0] = [6.0, 0.5, 0.1] * rng.uniform(0.9, 1.1, (n, 1))
    state.eta[0, 1] = state.eta[0, 0] + [2.1 * math.cos(angle[0]), 2.1 * math.sin(angle[0]), 0.0]
    state.eta[0, 3, :2] = state.eta[0, 2, :2]
    state.eta[0, 4, :2] = x, y


def check_percept(swarm):
    """Compare every field of the percepts with the oracle's; 0 for lost vehicles."""
    percept, heading, nu = swarm.percept, swarm.heading[0], swarm.state.nu[0]
    now, alive, discs = swarm.state.eta[0, :, :2], swarm.state.alive[0], swarm.world_map.obstacles[0]
    discs, l_t = discs[: swarm.world_map.num_obstacles[0]], swarm.facts.reference[0, 0]
    over_ground = np.stack([motion.rotation(psi) @ v[:2] for psi, v in zip(swarm.state.eta[0, :, 2], nu, strict=True)])
    j = swarm.detected_index[0]
    seen = {
        "velocity": nu[:, :2], "yaw_rate": nu[:, 2:], "compass": heading, "detected": j >= 0, "link_identity": j + 1,
        "reference": sonar.to_body(l_t[:2] - now, heading), "reference_velocity": sonar.to_body(l_t[2:], heading),
        "link_velocity": np.where(j[:, :, None] >= 0, sonar.to_body(over_ground[j], heading[:, None]), 0.0),
        **dict(zip(
            ("echo", "echo_range", "echo_position"),
            map(np.stack, zip(*(sonar.echoes(now[i], heading[i], discs, swarm.scenario.sonar) for i in range(len(j))),
                              strict=True)),
            strict=True,
        )),
    }  # fmt: skip
    for name in set(percept.names) - {"neighbour"}:  # which ``check`` compares
        expected = np.where(alive.reshape(-1, *[1] * (seen[name].ndim - 1)), seen[name], 0.0)
        np.testing.assert_allclose(percept[name][0], expected, rtol=1e-6, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("name", EPISODES)
def test_an_episode_s_facts_and_percepts_are_those_of_the_oracle(name):
    scenario, change = EPISODES[name]
    swarm, rng = started(scenario, seed=1, **change), np.random.default_rng(0)
    actor = make_policy("bio_inspired", swarm.scenario)
    happened = set()
    for k in range(40):
        if k == 15:
            crowd(swarm, rng)
            swarm.observe()
        wild = rng.uniform(-1.2, 1.2, (1, swarm.num_vehicles, 2))
        swarm.step(actor.act(swarm.percept) if k % 10 < 5 else wild)
        check(swarm)
        check_percept(swarm)
        happened |= {name for name in ("detected", "echo") if swarm.percept[name].any()}
        happened |= {name for name in ("vehicle_collisions", "lost") if getattr(swarm.facts, name).any()}
    assert happened == {"detected", "echo", "vehicle_collisions", *(["lost"] if name == "losses" else [])}
