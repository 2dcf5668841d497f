"""Swarm: seeds, batches, endings, losses, collisions, and random fields."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from tests.processes import python
from tests.swarms import fly, piloted, started
from uuv_marl import load_scenario
from uuv_marl.sim import engine as engine_module
from uuv_marl.sim.episode_setup import sample_field
from uuv_marl.sim.threads import on_threads


def play(scenario, seeds, steps, policy="bio_inspired"):
    """Final states and percepts, world by world, of a few steps in one batch."""
    swarm, actor = piloted(policy, scenario, worlds=len(seeds), seed=list(seeds))
    actor.reset(list(seeds))
    percept = fly(swarm, actor, steps)
    return swarm.state.eta.copy(), swarm.state.nu.copy(), percept.flat.copy()


@pytest.mark.parametrize("policy", ["bio_inspired", "sff", "sdc", "random"])
@pytest.mark.parametrize("name", ["lossy", "random_field"])
def test_a_world_is_the_same_alone_and_in_a_batch(name, policy):
    scenario = load_scenario(name, overrides={"losses.times_s": [5.0, 9.0]})
    batch = play(scenario, (3, 1, 7, 5, 2), 150, policy)
    for w, seed in enumerate((3, 1, 7, 5, 2)):
        alone = play(scenario, (seed,), 150, policy)
        for one, many in zip(alone, batch, strict=True):
            assert one[0].tobytes() == many[w].tobytes()


def test_threads_do_not_change_a_run(monkeypatch):
    scenario = load_scenario("single_obstacle")
    many = [play(scenario, range(16), 80)]
    for threads in (1, 3):
        monkeypatch.setattr(engine_module, "num_threads", lambda threads=threads: threads)
        many.append(play(scenario, range(16), 80))
    for other in many[1:]:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(many[0], other, strict=True))


@pytest.mark.parametrize("layer", ["omp", "workqueue"])
def test_several_threads_step_batches_at_once(layer):
    """Numba's own threads would abort the process here, with its threading layer without OpenMP."""
    assert python("-c", AT_ONCE, NUMBA_THREADING_LAYER=layer, NUMBA_NUM_THREADS="2") == "True\n"


AT_ONCE = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import uuv_marl

def run(seed):
    envs = uuv_marl.vector_env(16, num_vehicles=30)
    envs.reset(seed=seed)
    action = np.random.default_rng(seed).uniform(-1.0, 1.0, (16, 30, 2)).astype(np.float32)
    return [envs.step(action)[0].tobytes() for _ in range(30)]

with ThreadPoolExecutor(2) as threads:
    print(list(threads.map(run, [3, 4])) == [run(3), run(4)])
"""


def test_an_error_of_any_thread_is_raised_once_all_have_ended():
    ended = []

    def work(thread, begin, end):
        if thread == 1:
            raise IndexError(f"from {begin} to {end}")
        ended.append(thread)
        return False

    with pytest.raises(IndexError, match="from 4 to 7"):
        on_threads(work, 10, 3)
    assert sorted(ended) == [0, 2]
    assert not on_threads(lambda thread, begin, end: begin > 9, 10, 7)


FORKED = """
import os, numpy as np
import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.sim.swarm import Swarm
scenario = load_scenario("single_obstacle")
action = np.zeros((8, 54, 2), np.float32)
batch = Swarm(scenario, 8); batch.reset(0); batch.step(action); before = batch.snapshot()
batch.step(action); expected = batch.state.eta.tobytes(); batch.restore(before)
pid = os.fork()
if pid == 0:
    one = Swarm(scenario, 1); one.reset(0); one.step(action[:1])
    uuv_marl.parallel_env(scenario).reset(seed=0); uuv_marl.vector_env(2, scenario).reset(seed=0)
    batch.step(action)
    os._exit(7 if batch.state.eta.tobytes() == expected else 8)
print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""


def test_after_a_fork_a_batch_runs_with_threads_of_its_own():
    assert python("-c", FORKED) == "7\n"


def test_inactive_worlds_stay_unchanged():
    swarm = started("tracking", worlds=2, n=4)
    before = swarm.state.eta.copy()
    swarm.step(np.ones((2, 4, 2), np.float32), np.array([True, False]))
    assert not np.array_equal(swarm.state.eta[0], before[0])
    assert np.array_equal(swarm.state.eta[1], before[1])
    assert swarm.facts.time_s.tolist() == [0.1, 0.0]


@pytest.mark.parametrize(("n", "spacing"), [(1, 13.0), (2, 13.0), (5, 13.0), (54, 17.0), (55, 13.0), (200, 13.0)])
def test_the_start_is_two_groups_behind_the_first_point_at_the_spacing(n, spacing):
    """At 17 m random placement finds no room, and the lattice is used."""
    swarm = started("single_obstacle", {"start.spacing_m": spacing}, worlds=3, n=n)
    length, width = swarm.scenario.start.sides(n)
    for eta, nu in zip(swarm.state.eta, swarm.state.nu, strict=True):
        offset = eta[:, :2] - 150.0
        along, across = (offset[:, 0] + offset[:, 1]) / math.sqrt(2), (offset[:, 1] - offset[:, 0]) / math.sqrt(2)
        assert (along <= 1e-6).all()
        assert (along >= -length - 1e-6).all()
        assert (np.abs(across) >= 10 - 1e-6).all()
        assert (np.abs(across) <= 10 + width + 1e-6).all()
        assert (across < 0).sum() == (n + 1) // 2
        assert (nu[:, 0] >= 0).all()
        assert (nu[:, 0] <= 4).all()
        assert not nu[:, 1:].any()
    if n > 1:
        assert swarm.facts.min_spacing.min() >= spacing


NEAR = [[5.0, 0.0], [-1.1, 0.0]]  # the centre 1.95 m off
FAR = [[9.0, 0.0], [-1.1, 0.0]]


def test_arrival_needs_rest_nearness_spread_and_dwell():
    swarm, late = started("single_obstacle", n=2), 1700
    for offsets, seconds, tick, arrives in (
        ([[1.0, 0.0], [-1.0, 0.0]], 20.0, 1000, False),  # l(t) still on its way
        ([[90.0, 0.0], [-90.0, 0.0]], 6.0, late, False),  # too wide
        ([[5.0, 0.0], [-0.9, 0.0]], 6.0, late, False),  # the centre 2.05 m off
        (NEAR, 4.0, late, False),
        (FAR, 0.1, late + 40, False),  # interrupted
        (NEAR, 4.0, late + 41, False),
        (FAR, 0.1, late, False),
        (NEAR, 5.0, late, False),  # not long enough
        (NEAR, 0.1, late + 50, True),
    ):
        swarm.state.tick[0] = tick
        for _ in range(round(seconds * 10)):
            swarm.state.eta[0, :, :2] = 600.0 + np.array(offsets)
            swarm.state.nu[0] = 0.0
            swarm.step(np.zeros((1, 2, 2), np.float32))
        assert swarm.arrived[0] == arrives
    assert swarm.facts.arrival_s[0, 0] == pytest.approx((late + 1) / 10)
    assert math.isnan(swarm.facts.arrival_s[0, 1])  # never within 1 m
    assert swarm.facts.arrival_s[0, 2] <= swarm.facts.arrival_s[0, 0]  # within 5 m


PASSING = {"arrival.criterion": "passage", "trajectory.waypoints_m": [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0]],
           "arrival.spread_m": 10.0}  # fmt: skip
SPREAD = np.array([[-3.0, -3.0], [3.0, -3.0], [-3.0, 3.0], [3.0, 3.0]])


@pytest.mark.parametrize(("centre", "scattered", "time_s", "arrives"), [
        ((100.0, 59.9), 1.0, 50.0, False),
        ((100.0, 60.1), 1.0, 50.0, True),
        ((104.0, 60.1), 1.0, 50.0, True),
        ((108.0, 60.1), 1.0, 50.0, False),
        ((100.0, 90.0), 1.0, 50.0, True),
        ((100.0, 60.1), 3.0, 50.0, False),
        ((100.0, 60.1), 1.0, 39.8, False),
])  # fmt: skip
def test_a_swarm_arrives_as_its_centre_crosses_the_line_through_the_end_together(centre, scattered, time_s, arrives):
    """And l(t) has: its path of 160 m takes 40 s."""
    swarm = started("tracking", PASSING, n=4)
    swarm.state.eta[0, :, :2], swarm.state.tick[:] = np.array(centre) + scattered * SPREAD, round(10.0 * time_s)
    swarm.observe()
    assert swarm.arrived[0] == arrives
    assert not arrives or swarm.facts.arrival_s[0, 0] == swarm.facts.time_s[0], "at that moment"


def test_vehicles_are_lost_on_time_stay_there_and_leave_the_centre():
    """That they are not detected is in test_oracle.py."""
    swarm = started("lossy", {"losses.times_s": [0.0, 0.25, 1.0]}, seed=5)
    action = np.zeros((1, 54, 2), np.float32)
    lost_at = {}
    for step in range(1, 13):
        swarm.step(action)
        for i in np.flatnonzero(swarm.facts.lost[0]):
            lost_at[int(i)] = step
    assert sorted(lost_at.values()) == [1, 3, 10]
    assert list(lost_at) == swarm.world_map.losses[0].tolist()
    gone, living = list(lost_at), swarm.state.alive[0]
    np.testing.assert_allclose(swarm.facts.centre[0], swarm.state.eta[0, living, :2].mean(axis=0))
    still = swarm.state.eta[0, gone].copy()
    swarm.step(np.ones((1, 54, 2), np.float32))
    np.testing.assert_array_equal(swarm.state.eta[0, gone], still)


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.sampled_from([1, 54, 200]))
def test_random_fields_are_feasible(seed, n):
    """Independent of the construction: on a grid, water with s_o + s_u to spare joins the start with the end."""
    scenario = load_scenario("random_field", num_vehicles=n)
    waypoints, obstacles = sample_field(scenario, np.random.default_rng(seed))
    again = sample_field(scenario, np.random.default_rng(seed))
    np.testing.assert_array_equal(waypoints, again[0])
    np.testing.assert_array_equal(obstacles, again[1])
    assert len(obstacles) <= scenario.random_field.obstacles[1]
    gap = 2 * (scenario.constraints.s_o_m + scenario.constraints.s_u_m)
    for k, (x, y, radius) in enumerate(obstacles):
        assert scenario.start.distance(n, tuple(waypoints[0]), tuple(waypoints[1]), (x, y)) >= radius + gap
        assert math.hypot(x - waypoints[-1, 0], y - waypoints[-1, 1]) >= radius + gap
        for a, b, other in obstacles[:k]:
            assert math.hypot(x - a, y - b) >= radius + other + gap
    low, high = waypoints.min(axis=0) - 150, waypoints.max(axis=0) + 150
    # A cell counts as free where its centre is; the grid is much finer than the channels left between grown discs.
    x, y = np.meshgrid(*(np.arange(a, b, 2.5) for a, b in zip(low, high, strict=True)), indexing="ij")
    free = np.ones(x.shape, bool)
    for a, b, radius in obstacles:
        free &= np.hypot(x - a, y - b) >= radius + gap / 2 - 2.5
    regions, _ = label(free)
    cells = [tuple(((point - low) / 2.5).round().astype(int)) for point in (waypoints[0], waypoints[-1])]
    assert regions[cells[0]] == regions[cells[1]] != 0


def test_an_obstacle_that_moves_onto_a_vehicle_is_a_collision():
    """The motion of both counts; resting or moving within a collision begins no other."""
    swarm, still = started("single_obstacle", n=2), np.zeros((1, 2, 2), np.float32)
    swarm.state.nu[...] = 0.0
    counted = []
    for north in (30.0, 25.5, 25.0, 500.0, 25.5):  # from the vehicle to the centre of a disc of 25 m [m]
        swarm.world_map.obstacles[0, 0, :2] = swarm.state.eta[0, 0, :2] + (north, 0.0)
        swarm.step(still)
        counted.append(swarm.facts.vehicle_collisions[0].tolist())
    assert [one for one, _ in counted] == [0, 1, 0, 0, 1]
    swarm.world_map.num_obstacles[0] = 0
    swarm.step(still)
    swarm.world_map.num_obstacles[0] = 1
    assert swarm.step(still) is not None
    assert swarm.facts.vehicle_collisions[0, 0] == 1, "an obstacle that appears on a vehicle"


def test_a_swarm_that_has_run_can_be_pickled_and_continues_alike():
    swarm, action = started("starter", worlds=2), np.full((2, 5, 2), 0.5, np.float32)
    swarm.step(action)
    copy = pickle.loads(pickle.dumps(swarm))
    assert copy.step(action).flat.tobytes() == swarm.step(action).flat.tobytes()
