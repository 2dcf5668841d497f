"""Currents, lags, mismatch and faults; test_disturbances_sonar.py has the sonar and navigation."""

import math
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.golden import STARTER
from tests.swarms import started
from tests.test_tasks import TWO
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy
from uuv_marl.sim.disturbances.actuation import victims
from uuv_marl.sim.disturbances.current import advance_gust, eddy_flow
from uuv_marl.sim.disturbances.disturbances import DISTURBANCE_CHANNELS, disturbance_tables
from uuv_marl.sim.exponential import decay_mean, exp
from uuv_marl.sim.random import normals
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.vehicle import Plant, plant

OPEN = {"obstacles": []}
CURRENT = {"current.speed_mps": 0.7, "current.direction_deg": 60.0}
GUSTS = {"current.variation_mps": 0.3, "current.variation_time_s": 2.0}
EDDIES = {"current.eddies": 8, "current.eddy_speed_mps": 1.2}
LAGS = {"actuators.thrust_lag_s": 0.6, "actuators.yaw_lag_s": 0.25}
MISMATCH = {"mismatch.mass": 0.2, "mismatch.added_mass": 0.3, "mismatch.drag": 0.3, "mismatch.thrust": 0.2}
FAULTS = {
    "faults": [
        {"kind": "thruster", "share": 0.4, "efficiency": 0.5, "onset_s": 1.0},
        {"kind": "yaw", "share": 0.3, "onset_s": 0.5, "duration_s": 1.0},
        {"kind": "member", "share": 0.2, "onset_s": 2.0},
    ]
}
TRAFFIC = {"traffic.speed_mps": 1.0}
EVERYTHING = CURRENT | GUSTS | EDDIES | LAGS | MISMATCH | FAULTS
HEARD = EVERYTHING | {
    "latency.processing_s": 0.5, "latency.travel_time": True, "latency.compensated": True,
    "latency.active_period_s": 0.25, "latency.passive_period_s": 0.7, "noise.bearing_deg": 5.0,
    "noise.passive_range_log_sd": 0.3, "noise.silence_probability": 0.1, "noise.silence_readings": 5,
    "noise.false_echo_probability": 0.1, "navigation.drift_share": 0.1, "navigation.compass_bias_deg": 10.0,
    "modem.period_s": 0.5, "sonar.channels": ["modem", "link", "age"],
} | TRAFFIC  # fmt: skip
"""The same with all delays and errors of readings."""


def swim(overrides, decisions=40, worlds=1, seed=3, scenario=STARTER, **change):
    """A swarm after decisions that don't depend on its disturbances."""
    swarm, rng = started(scenario, overrides, worlds, seed, **change), np.random.default_rng(7)
    for _ in range(decisions):
        action = rng.uniform(-1.0, 1.0, (worlds, swarm.num_vehicles, 2))
        swarm.step(np.pad(action, ((0, 0), (0, 0), (0, swarm.scenario.modem.message_entries))))
    return swarm


@pytest.mark.parametrize("channel", DISTURBANCE_CHANNELS)
def test_the_code_of_disturbances_with_all_of_them_off_changes_no_bit(channel):
    heard = {"modem.message_entries": 3} if channel == "messages" else {}
    for worlds in (1, 3):
        calm, still = (swim(own, worlds=worlds) for own in ({}, {"sonar.channels": [channel], **heard}))
        theirs = still.snapshot()
        theirs["percept"] = theirs["percept"][..., : calm.layout.size]
        for name, array in calm.snapshot().items():
            np.testing.assert_array_equal(array, theirs[name], name)


@pytest.mark.parametrize("part", [CURRENT, GUSTS, EDDIES, LAGS, MISMATCH, FAULTS, TRAFFIC])
def test_one_disturbance_changes_no_random_number_of_another(part):
    """Starts, maps and all else that the seed decides are the same with it alone and with everything on."""
    alone, among = (swim(change, 0, scenario="random_field") for change in (part, EVERYTHING))
    for name in ("eta", "nu", "waypoints", "obstacles", "losses"):
        np.testing.assert_array_equal(alone.snapshot()[name], among.snapshot()[name], name)
    drawn = {"current.speed_mps": "flow.mean", "current.variation_mps": "flow.gust", "current.eddies": "flow.eddies",
             "mismatch.mass": "hull.plants", "faults": "hull.broken"}  # fmt: skip
    for table in (drawn[field] for field in drawn.keys() & part):
        np.testing.assert_array_equal(*map(attrgetter(f"_disturbances.{table}"), (alone, among)), table)


@pytest.mark.parametrize(("scenario", "overrides", "index", "limits"), [
        (STARTER, HEARD, "target_index", "-3 and 4"),
        ("silent_targets", {}, "last", "1 and"),
        ("multi_obstacle", TWO, "group", "0 and 1"),
])  # fmt: skip
def test_a_snapshot_resumes_bit_for_bit_and_has_its_indices_checked(scenario, overrides, index, limits):
    swarm = swim(overrides, scenario=scenario)
    kept, other = swarm.snapshot(), started(swarm.scenario, seed=99)
    other.restore(kept)
    for each in (swarm, other):
        for _ in range(20):
            each.step(np.full((1, swarm.num_vehicles, 2), 0.4))
    for name, array in swarm.snapshot().items():
        np.testing.assert_array_equal(array, other.snapshot()[name], name)
    kept[index][...] = 99
    with pytest.raises(ValueError, match=f"{index} must lie within {limits}"):
        swarm.restore(kept)


def test_a_reset_leaves_nothing_of_the_previous_episode():
    """Delayed readings, messages, lags, drift, faults: a reset world equals a new one."""
    used, new = swim(HEARD, 30, 2), swim(HEARD, 0, 2, seed=[8, 9])
    used.reset([9], worlds=[1])
    for name, array in used.snapshot().items():
        if name != "streams":
            np.testing.assert_array_equal(array[1], new.snapshot()[name][1], name)


def test_a_uniform_current_carries_the_same_motion_along():
    """Galilean invariance: headings and velocities relative to the water keep their bits, positions move by V t."""
    calm, carried = swim(OPEN, 200), swim(OPEN | CURRENT, 200)
    np.testing.assert_array_equal(calm.state.nu, carried.state.nu)
    np.testing.assert_array_equal(calm.state.eta[:, :, 2], carried.state.eta[:, :, 2])
    t = float(calm.facts.time_s[0])
    shift = 0.7 * t * np.array([math.cos(math.radians(60)), math.sin(math.radians(60))])
    np.testing.assert_allclose(carried.state.eta[..., :2] - calm.state.eta[..., :2], shift + np.zeros((1, 5, 2)),
                               rtol=0, atol=1e-9 * (1 + t))  # fmt: skip


def test_a_policy_that_follows_a_drifting_point_swims_as_in_still_water():
    """Closed loop: l(t) drifts with the water, and vehicles measure velocities relative to it."""
    straight_leg = {"trajectory.waypoints_m": [[0.0, 0.0], [160.0, 0.0]], "random_field": None} | OPEN
    drifting = {
        "trajectory.waypoints_m": [[0.0, 0.0], [160.0, 20.0]],
        "trajectory.speed_mps": math.hypot(4.0, 0.5),
        "current.speed_mps": 0.5, "current.direction_deg": 90.0, "current.velocity": "water",
    }  # fmt: skip
    swarms = [
        Swarm(load_scenario("single_obstacle", num_vehicles=8, overrides=straight_leg | more))
        for more in ({}, drifting)
    ]
    start = None
    for swarm in swarms:
        swarm.reset(1)
        start = swarm.snapshot() if start is None else start
        swarm.state.eta[:], swarm.state.nu[:] = start["eta"], start["nu"]
        swarm.observe()
        policy = make_policy("bio_inspired", swarm.scenario, 1)
        policy.reset(0)
        for _ in range(100):
            swarm.step(policy.act(swarm.percept))
    shift = swarms[1].state.eta - swarms[0].state.eta
    np.testing.assert_allclose(shift[0], np.tile([0.0, 5.0, 0.0], (8, 1)), atol=1e-4)  # percepts are float32


def test_a_lost_vehicle_that_is_still_detected_is_at_rest():
    """It stays where it was lost, though a delayed reading still shows it."""
    overrides = CURRENT | {"latency.processing_s": 1.0, "sonar.channels": ["link"]}
    faults = {"faults": [{"kind": "member", "share": 0.2, "onset_s": 2.0}]}
    swarm = swim(overrides | faults, 25)
    gone = int(np.flatnonzero(~swarm.state.alive[0])[0])
    i, k = np.nonzero(swarm.percept["link_identity"][0] == gone + 1)
    assert len(i) > 0
    assert not swarm.percept["link_velocity"][0, i, k].any()
    assert not swarm.velocity[0, gone].any()


@pytest.mark.parametrize("control_step_s", [0.1, 0.5, 2.0])
def test_the_process_has_its_mean_variance_and_memory_whatever_the_step(control_step_s):
    """20,000 draws: a mean within 5 / sqrt(n) deviations, a variance within 5 sqrt(2 / n)."""
    tau = 3.0
    overrides = {"current.variation_mps": 0.4, "current.variation_time_s": tau, "timing.control_step_s": control_step_s,
                 "timing.decision_period_s": control_step_s}  # fmt: skip
    swarm = started(STARTER, overrides)
    disturbances = swarm._disturbances
    steps = round(6.0 / control_step_s)
    first, last = [], []
    for key in np.random.default_rng(0).integers(0, 2**63, 2000).astype(np.uint64):
        for tick in range(0, 5000, 1000):
            disturbances.flow.gust[0] = 0.4 * np.array(normals(key, 999, tick, 0, 0))
            first.append(disturbances.flow.gust[0].copy())
            for k in range(1, steps + 1):
                advance_gust(0, key, tick + k, disturbances.water, disturbances.flow)
            last.append(disturbances.flow.gust[0].copy())
    start, end = np.concatenate(first) / 0.4, np.concatenate(last) / 0.4
    m = len(end)
    assert abs(end.mean()) < 5 / math.sqrt(m)
    assert abs(end.var() - 1) < 5 * math.sqrt(2 / m)
    assert abs((start * end).mean() - math.exp(-6.0 / tau)) < 5 / math.sqrt(m)


@given(st.floats(-200, 200), st.floats(-200, 200), st.floats(1, 50))
def test_an_eddy_has_no_divergence_no_jumps_and_no_flow_at_its_centre(x, y, core):
    h = 1e-4 * core
    flow = {
        (i, j): np.array(eddy_flow(x + i * h, y + j * h, 30.0, core)) for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1))
    }
    steepest = 30.0 / (2 * math.pi * core * core)
    divergence = (flow[1, 0][0] - flow[-1, 0][0] + flow[0, 1][1] - flow[0, -1][1]) / (2 * h)
    assert abs(divergence) < 1e-6 * steepest + 1e-9
    assert np.abs(flow[1, 0] - flow[-1, 0]).max() <= 2 * h * steepest * 1.01
    assert eddy_flow(0.0, 0.0, 30.0, core) == (0.0, 0.0)


def test_the_fastest_water_of_an_eddy_has_the_given_speed():
    swarm = swim(EDDIES, 0)
    water, core = swarm._disturbances.water, swarm._disturbances.water.core
    speeds = [math.hypot(*eddy_flow(r, 0.0, water.circulation, core)) for r in np.linspace(0.5 * core, 2 * core, 2001)]
    assert max(speeds) == pytest.approx(1.2, rel=1e-6)


def test_eddies_alternate_so_that_their_circulation_sums_to_zero():
    for name in (STARTER, "random_field", "tracking"):
        swarm = swim(EDDIES, 0, worlds=2, scenario=name)
        eddies = swarm._disturbances.flow.eddies
        assert eddies.shape[1] == swarm.scenario.max_eddies
        for w in range(2):
            there = eddies[w][eddies[w, :, 2] != 0.0]
            assert len(there) > 0
            assert there[:, 2].sum() == 0.0
            points = swarm.world_map.waypoints[w, 0]
            assert (there[:, :2] >= points.min(0) - 250).all()
            assert (there[:, :2] <= points.max(0) + 250).all()


def test_the_water_at_a_vehicle_is_the_field_there():
    swarm = swim(CURRENT | GUSTS | EDDIES, 25)
    flow, core = swarm._disturbances.flow, swarm._disturbances.water.core
    for i in range(5):
        x, y, _ = swarm.state.eta[0, i]
        parts = [eddy_flow(x - e_x, y - e_y, circulation, core) for e_x, e_y, circulation in flow.eddies[0]]
        np.testing.assert_allclose(swarm.flow[0, i], flow.mean[0] + flow.gust[0] + np.sum(parts, axis=0), rtol=1e-12)
    np.testing.assert_array_equal(swarm.flow_field().at(swarm.state.eta[0, :, :2]), swarm.flow[0])
    assert not Swarm(load_scenario(STARTER)).flow_field().at([[[1.0, 2.0]]]).any()
    with pytest.raises(ValueError, match=r"north and east \[m\], shape \(..., 2\), got shape \(3,\)"):
        swarm.flow_field().at([1.0, 2.0, 3.0])


@given(st.floats(-300, 0.01), st.floats(0, 50))
def test_the_exponential_is_the_library_s(x, y):
    assert exp(x) == pytest.approx(math.exp(x), rel=3e-16, abs=1e-300)
    assert decay_mean(y) == pytest.approx(-math.expm1(-y) / y if y else 1.0, rel=1e-12)


def test_a_vehicle_with_mismatch_moves_as_in_a_scenario_with_its_numbers():
    swarm = swim(MISMATCH, 0)
    nominal = plant(swarm.scenario)
    for i in range(5):
        own = Plant(*swarm._disturbances.hull.plants[0, i])
        mass, drag, added = own.m / nominal.m, own.X_u / nominal.X_u, own.X_udot / nominal.X_udot
        assert abs(mass - 1) <= 0.2
        assert abs(drag - 1) <= 0.3
        assert abs(added - 1) <= 0.3
        theirs = plant(swarm.scenario.model_copy(update={"vehicle": swarm.scenario.vehicle.times(mass, added, drag)}))
        np.testing.assert_allclose(own, theirs, rtol=1e-12)
    assert len({tuple(row) for row in swarm._disturbances.hull.plants[0]}) == 5


@given(st.floats(0, 1), st.floats(0, 1), st.integers(0, 2**32))
def test_a_larger_share_has_the_smaller_one_s_victims(a, b, key):
    few, many = (
        set(victims(np.uint64(key), 0, load_scenario(STARTER, num_vehicles=10, overrides={
            "faults": [{"kind": "yaw", "share": share}]})))
        for share in sorted((a, b))
    )  # fmt: skip
    assert few <= many
    assert len(few) == math.ceil(10 * min(a, b) - 1e-9)


def test_faults_act_from_their_onset_for_their_duration():
    swarm = started(STARTER, FAULTS)
    victim = [set(np.flatnonzero(swarm._disturbances.hull.broken[0, :, f, 0] < 10**6).tolist()) for f in range(3)]
    assert [len(each) for each in victim] == [2, 2, 1]
    for hold in range(25):
        action = np.full((1, 5, 2), 0.5)
        swarm.step(action)
        thrust, torque = np.moveaxis(swarm._disturbances.hull.tau[0], -1, 0)
        for i in np.flatnonzero(swarm.state.alive[0]):
            assert thrust[i] == (750.0 if i in victim[0] and hold >= 10 else 1500.0)
            assert (torque[i] == 0.0) == (i in victim[1] and 5 <= hold < 15)
        assert set(np.flatnonzero(~swarm.state.alive[0])) == (victim[2] if hold >= 19 else set())


def test_no_array_of_a_swarm_hides_another_of_its_name():
    """In snapshots, else one of the two would be lost."""
    swarm = swim(HEARD, 0)
    names = [name for table in (*swarm._world, *disturbance_tables(swarm._disturbances)) for name in table._fields]
    assert len(set(names)) == len(names)
