"""Two swarms, one gap: maps are drawn by the seed alone, the gap is the only way, each vehicle has its own goal."""

import numpy as np
import pytest
from scipy.ndimage import label

from tests.swarms import batched, piloted, started
from uuv_marl.tasks.maps.grid_paths import MapGrid, free_cells

TIERS = ("two_swarms_easy", "two_swarms", "two_swarms_hard")
TUNING = 10_000


def waters(worlds=1, scenario="two_swarms", **changes):
    return started(scenario, changes, worlds, TUNING)


def framed(swarm, w):
    """Places, goals and discs' middles of a world in its map's own frame: x through the gap, y along the wall."""
    c, s = swarm.task.memory.turn[w]
    turn = np.array([[c, -s], [s, c]])
    return (
        swarm.state.eta[w, :, :2] @ turn,
        swarm.world_map.waypoints[w, :, 1] @ turn,
        swarm.world_map.obstacles[w, : swarm.world_map.num_obstacles[w], :2] @ turn,
    )


@pytest.mark.parametrize("tier", TIERS)
def test_groups_swap_sides(tier):
    swarm = waters(4, tier)
    n = swarm.num_vehicles
    for w in range(4):
        place, goal, _ = framed(swarm, w)
        side = swarm.task.memory.side[w]
        assert (side > 0.0).sum() == n // 2
        assert (np.sign(place[:, 0]) == -side).all()
        np.testing.assert_allclose(goal - place, np.stack([300.0 * side, np.zeros(n)], axis=1), atol=1e-9)
        assert np.abs(place[side > 0.0, 1].mean() - place[side < 0.0, 1].mean()) > 0.0
        apart = np.hypot(*np.moveaxis(goal[:, None] - goal[None], -1, 0)) + 1e3 * np.eye(n)
        assert apart.min() > 2.0 * swarm.task.numbers.near_m  # nobody takes another's place
    assert swarm.facts.min_spacing.min() >= swarm.scenario.start.spacing_m - 1e-9


@pytest.mark.parametrize("tier", TIERS)
def test_the_gap_is_the_only_way_and_as_wide_as_its_numbers(tier):
    """By SciPy's labels: the two sides meet through the gap, and no more once the gap is shut."""
    swarm = waters(6, tier)
    grid, hull = MapGrid(-260.0, -160.0, 208, 128), swarm.scenario.collision.hull_radius_m
    for w in range(6):
        place, goal, middles = framed(swarm, w)
        radius = swarm.world_map.obstacles[w, : len(middles), 2]
        discs, at = np.column_stack([middles, radius]), swarm.task.memory.gap[w]
        wall = discs[(np.abs(middles[:, 0]) < 1e-6) & (radius == swarm.task.numbers.radius_m)]
        below, above = wall[wall[:, 1] < at], wall[wall[:, 1] > at]
        gap = (above[:, 1] - above[:, 2]).min() - (below[:, 1] + below[:, 2]).max()
        low, high = swarm.task.numbers.gap_m
        assert low - 1e-6 <= gap <= high + 1e-6
        assert np.abs(at) <= swarm.task.numbers.gap_aside_m
        shut = np.concatenate([discs, [[0.0, at, 0.5 * gap]]])
        for map_, open_ in ((discs, True), (shut, False)):
            parts, _ = label(free_cells(map_, grid, hull))
            here, there = (parts[grid.cell(each[:, 0], each[:, 1])] for each in (place, goal))
            assert (here > 0).all()
            assert (here == there).all() == open_
            assert parts[0, 0] != here[0]  # the banks keep them in


def test_percepts_turn_with_a_map():
    """What is told of the way, too."""
    swarm = waters(**{"sonar.channels": ["path"]})
    rng = np.random.default_rng(0)
    swarm.state.eta[0, :, :2] *= rng.uniform(0.3, 1.0, (40, 1))
    before, angle = swarm.observe().flat.copy(), 0.7
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    places = (swarm.state.eta[0, :, :2], swarm.world_map.obstacles[0, :, :2], swarm.world_map.waypoints[0])
    for each in places:
        each[...] = each @ turn
    swarm.state.eta[0, :, 2] += angle
    swarm.task.memory.turn[0] = swarm.task.memory.turn[0] @ turn
    np.testing.assert_allclose(swarm.observe().flat, before, atol=2e-4)


def test_each_vehicles_reference_is_its_own_goal():
    swarm = waters(2)
    percept = swarm.percept
    goals = swarm.world_map.waypoints[:, :, 1]
    np.testing.assert_array_equal(swarm.own_reference[:, :, :2], goals)
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(percept["reference"], -1, 0)),
        np.hypot(*np.moveaxis(goals - swarm.state.eta[:, :, :2], -1, 0)), rtol=1e-5,
    )  # fmt: skip
    assert (percept["reference_velocity"] == 0.0).all()
    swarm.state.eta[0, 3, :2] = goals[0, 3]
    swarm.state.eta[0, 4, :2] = goals[0, 5]  # another's
    swarm.observe()
    assert np.flatnonzero(swarm.task.at_goal()[0]).tolist() == [3]


def test_success_is_untouched_and_there_and_the_episode_ends_when_all_are_there():
    batch = batched("two_swarms_easy", seed=TUNING)
    swarm, task = batch.swarm, batch.task
    swarm.state.eta[0, :, :2] = swarm.world_map.waypoints[0, :, 1]
    swarm.state.eta[0, 0, :2] += (task.numbers.near_m + 1.0) * np.array([1.0, 0.0])
    swarm.state.nu[0] = 0.0
    swarm.observe()
    swarm.state.collided[0, 2] = True
    result = batch.step(np.zeros((1, 20, 2)))
    assert not result.world_terminated[0]
    assert task.metrics(0)["success_share"] == 18 / 20
    assert task.metrics(0)["swarm_time_ratio"] is None
    swarm.state.eta[0, 0, :2] = swarm.world_map.waypoints[0, 0, 1]
    result = batch.step(np.zeros((1, 20, 2)))
    assert result.world_terminated[0]
    measured = task.metrics(0)
    assert (measured["success_share"], measured["swarm_success"]) == (19 / 20, 0.0)
    assert measured["swarm_time_ratio"] == pytest.approx(1.0 / task.memory.best_s[0].max())  # two decisions of 0.5 s


def test_the_straight_way_is_that_through_the_gaps_middle():
    swarm = waters(3)
    for w in range(3):
        place, goal, _ = framed(swarm, w)
        gap = np.array([0.0, swarm.task.memory.gap[w]])
        length = np.hypot(*(place - gap).T) + np.hypot(*(goal - gap).T)
        np.testing.assert_allclose(swarm.task.memory.best_s[w] * 5.1, length, rtol=0.02)
        assert (length < 1.2 * 300.0).all()


def test_one_group_has_its_turn_once_the_other_is_through():
    swarm = waters(**{"sonar.channels": ["path"]})
    percept = swarm.percept
    first = swarm.task.memory.side[0] > 0.0
    assert (percept["right_of_way"][0, :, 0] == first).all()
    swarm.state.eta[0, first, :2] = swarm.world_map.waypoints[0, first, 1]
    last = int(np.flatnonzero(first)[0])
    swarm.state.eta[0, last, :2] = 0.0
    assert (swarm.observe()["right_of_way"][0, :, 0] == first).all()
    swarm.state.collided[0, last] = True  # it has failed: nobody waits for it
    swarm._write_task_fields(np.ones(1, np.bool_))
    assert (percept["right_of_way"] == 1.0).all()


def test_to_stay_pays_by_the_second_and_all_that_is_left_once_all_are_there():
    """One vehicle is there for ten decisions, then all: in the end who stayed got the share of the time that it was."""
    batch = batched("two_swarms_easy", seed=TUNING)
    swarm, paid = batch.swarm, np.zeros(20)
    limit = swarm.time_limit_s[0]
    for k in range(11):
        swarm.state.nu[:] = 0.0
        there = slice(0, 1) if k < 10 else slice(None)
        swarm.state.eta[0, there, :2] = swarm.world_map.waypoints[0, there, 1]
        result = batch.step(np.zeros((1, 20, 2)))
        paid += result.terms["stay"][0]
    assert result.world_terminated[0]
    np.testing.assert_allclose(paid[0], 20.0)
    np.testing.assert_allclose(paid[1:], 20.0 * (1.0 - 5.0 / limit))


def test_a_carrot_is_ahead_at_its_speed_and_to_starboard_and_ends_at_the_goal():
    swarm, policy = piloted("carrot,right_m=7,ahead_m=6,speed=3", "two_swarms", seed=TUNING)
    swarm.state.eta[0, 0, :2] = swarm.world_map.waypoints[0, 0, 1] + (3.0, 0.0)
    percept = swarm.observe()
    with_carrot, goal = policy.with_carrot(percept), percept["reference"].astype(float)
    np.testing.assert_array_equal(with_carrot["reference"][0, 0], percept["reference"][0, 0])
    assert (with_carrot["reference_velocity"][0, 0] == 0.0).all()
    for i in range(1, 40):
        at, moves, to = with_carrot["reference"][0, i], with_carrot["reference_velocity"][0, i], goal[0, i]
        np.testing.assert_allclose([np.hypot(*at), np.hypot(*moves)], [6.0, 3.0], rtol=1e-5)
        aside = (to[0] * at[1] - to[1] * at[0]) / np.hypot(*to) / 6.0  # sine of the angle to starboard
        np.testing.assert_allclose(aside, 7.0 / np.hypot(7.0, np.hypot(*to)), rtol=1e-4)
