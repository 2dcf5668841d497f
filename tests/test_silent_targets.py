"""Silent targets: they stay in their box, are detected by the bow array alone, and can be held."""

import dataclasses
import math

import numpy as np
import pytest

from tests.swarms import batched, fly, started
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.errors import PolicyError
from uuv_marl.scenario.vehicle_checks import top_speed

TIERS = ("silent_targets_easy", "silent_targets", "silent_targets_hard")
TUNING = 10_100


def water(worlds=1, scenario="silent_targets", **changes):
    return started(scenario, changes, worlds, TUNING)


def alone(swarm, away=400.0):
    """The vehicles apart from all targets, at rest, bows north, outside the box."""
    n, half = swarm.num_vehicles, 0.5 * swarm.task.numbers.side_m
    swarm.state.eta[:, :, 0] = half + away
    swarm.state.eta[:, :, 1] = 20.0 * np.arange(n)
    swarm.state.eta[:, :, 2] = 0.0
    swarm.state.nu[:] = 0.0


@pytest.mark.parametrize("tier", TIERS)
def test_targets_stay_in_the_box_keep_their_speed_and_turn_smoothly(tier):
    swarm = water(2, tier)
    numbers, scenario, memory = swarm.task.numbers, swarm.scenario, swarm.task.memory
    full, period = top_speed(scenario.vehicle, scenario.actuators), scenario.timing.decision_period_s
    low, high = numbers.speed_share
    assert ((memory.speed >= low * full) & (memory.speed <= high * full)).all()
    turned, before = [], None
    for _ in range(300):
        at = swarm.world_map.obstacles[:, :, :2].copy()
        swarm.step(np.zeros((2, swarm.num_vehicles, 2)))
        moved = swarm.world_map.obstacles[:, :, :2] - at
        np.testing.assert_allclose(np.hypot(*np.moveaxis(moved, -1, 0)), memory.speed * period, rtol=1e-9)
        assert np.abs(swarm.world_map.obstacles[:, :, :2]).max() <= 0.5 * numbers.side_m + 1e-9
        way = np.arctan2(moved[..., 1], moved[..., 0])
        if before is not None:
            turned.append(np.abs((way - before + np.pi) % (2.0 * np.pi) - np.pi))
        before = way
    smooth = np.array(turned) <= np.radians(numbers.turn_dps) * period + 1e-6
    assert smooth.mean() > 0.98  # all but those at the box's side
    assert (np.array(turned) > 1e-3).mean() > 0.02


def test_nothing_but_the_bow_hears_a_target():
    swarm = water(**{"task.targets": 1})
    swarm.world_map.obstacles[0, 0, :2] = 0.0
    for bearing, away, heard in ((0, 99, 1), (59, 60, 1), (-59, 60, 1), (75, 60, 0), (180, 20, 0), (0, 102, 0)):
        alone(swarm)
        angle = np.radians(bearing)
        swarm.state.eta[0, 0, :2] = -away * np.cos(angle), -away * np.sin(angle)
        percept = swarm.observe()
        assert percept["echo"][0, 0].any() == heard, bearing
        assert (percept["detected"][0, 0] == water_without(swarm)["detected"][0, 0]).all()
        assert not percept["echo"][0, 1:].any()


def water_without(swarm):
    """What is perceived where the targets are far away."""
    before = swarm.snapshot()
    swarm.world_map.obstacles[:, :, :2] = 1e5
    seen = swarm.observe().flat.copy()
    swarm.restore(before)
    return dataclasses.replace(swarm.percept, flat=seen)


def test_a_vehicle_knows_where_it_is_in_the_box():
    swarm = water(2)
    percept = swarm.percept
    c, s = np.moveaxis(percept["box"].astype(float), -1, 0)
    x, y = np.moveaxis(percept["reference"].astype(float), -1, 0)
    place = -np.stack([c * x - s * y, s * x + c * y], axis=-1)
    np.testing.assert_allclose(place, swarm.state.eta[:, :, :2], atol=1e-3)
    assert np.hypot(*np.moveaxis(swarm.world_map.obstacles[:, :, :2], -1, 0)).min() > swarm.task.numbers.clear_m


def test_the_heading_in_the_box_is_by_compass():
    swarm = water(2, **{"navigation.compass_bias_deg": 30.0, "sonar.channels": ["compass"]})
    for _ in range(2):
        np.testing.assert_allclose(swarm.percept["box"], swarm.percept["compass"], atol=1e-6)
        assert np.abs(swarm.percept["box"] - swarm.heading).max() > 0.1
        swarm.step(np.zeros((2, 8, 2)))


def test_the_held_share_is_that_of_the_last_half():
    """Of four targets one is held all along, one from three quarters on, one in the first half, one never."""
    batch = batched("silent_targets_easy", seed=TUNING)
    swarm, task = batch.swarm, batch.task
    limit = swarm.time_limit_s[0]
    while not batch.over.all():
        time_s = swarm.facts.time_s[0]
        alone(swarm)
        holds = {0: True, 1: time_s > 0.75 * limit - 0.6, 2: time_s < 0.5 * limit - 0.6, 3: False}
        swarm.world_map.obstacles[0, :4, :2] = 150.0 * np.arange(4)[:, None] - 250.0
        for k, held in holds.items():
            if held:
                swarm.state.eta[0, k, :2] = swarm.world_map.obstacles[0, k, :2] + (0.0, 20.0)
        result = batch.step(np.zeros((1, 8, 2)))
        np.testing.assert_allclose(result.terms["held"][0, :4], 20.0 * 0.5 / limit * np.array([*holds.values()]))
        assert not result.terms["held"][0, 4:].any()
    measured = task.metrics(0)
    assert measured["held_share"] == pytest.approx((1.0 + 0.5) / 4.0, abs=0.01)
    assert (measured["found_share"], measured["swarm_success"]) == (0.75, 0.0)
    assert measured["found_s"] == pytest.approx((0.5 + 0.75 * limit + 0.5 + limit) / 4.0, abs=1.0)
    assert not task.success(0)
    assert task.success(0, 5) != bool(swarm.state.collided[0, 5])


def test_progress_and_pay_count_targets_that_no_nearer_vehicle_holds():
    swarm = water(**{"task.targets": 2})
    alone(swarm)
    swarm.world_map.obstacles[0, :2, :2] = (0.0, 0.0), (200.0, 0.0)
    swarm.state.eta[0, 0, :2], swarm.state.eta[0, 1, :2] = (0.0, 10.0), (0.0, 50.0)
    swarm.observe()
    left = swarm.task._remaining_m()[0]
    assert left[0] == pytest.approx(10.0)  # its own
    assert left[1] == pytest.approx(np.hypot(200.0, 50.0))
    swarm.state.eta[0, 2, :2] = (200.0, 5.0)
    assert swarm.task._remaining_m()[0, 1] == 0.0  # none is left
    swarm.state.eta[0, 1, :2] = 0.0, -20.0  # a second one at the first target changes nothing for who is nearer
    swarm.state.eta[0, 2, :2] = 300.0, 500.0
    left, held = swarm.task._remaining_m()[0], swarm.task.reward(np.ones(1, np.bool_))["held"][0]
    assert left[:2] == pytest.approx([10.0, np.hypot(200.0, 20.0)])
    assert held[0] > 0.0
    assert not held[1:].any()


def path_of(policy, decisions=300):
    swarm = water(2, "silent_targets_easy")
    fly(swarm, make_policy(policy, swarm.scenario, 2), decisions)
    return swarm.state.eta.copy()


def test_every_gain_of_the_search_can_be_given_by_name_and_counts():
    gains, usual = make_policy("nearest_target", load_scenario("silent_targets_easy")).gains, path_of("nearest_target")
    for name, value in gains._asdict().items():
        assert not np.array_equal(path_of(f"nearest_target,{name}={0.1 * value}"), usual), name


def test_the_search_refuses_what_has_no_box():
    with pytest.raises(PolicyError, match="searches a box, which task 'follow' does not have; run it on silent"):
        make_policy("nearest_target", with_policy_requirements("nearest_target", load_scenario("starter")))


def outside(**changes):
    """A batch whose vehicles are outside the box."""
    batch = batched("silent_targets", changes, seed=TUNING, reward="search")
    alone(batch.swarm)
    batch.step(np.zeros((1, batch.swarm.num_vehicles, 2)))
    assert (batch.swarm.task.memory.newly_covered == 0.0).all()
    return batch


def test_a_search_is_paid_for_the_area_that_the_bow_covers_and_no_vehicle_has_just_covered():
    batch = outside()
    swarm, memory = batch.swarm, batch.swarm.task.memory
    idle = np.zeros((1, swarm.num_vehicles, 2))
    memory.covered_s[:] = -1e3
    swarm.state.eta[0, :2] = (300.0, 300.0, 0.7)
    paid = batch.step(idle).terms["search"]
    area = math.pi / 3.0 * 100.0**2  # a fan of 120 degrees
    assert memory.newly_covered[0, 0] * 25.0**2 == pytest.approx(area, rel=0.1)
    np.testing.assert_array_equal(memory.newly_covered[0, 1:], 0.0)
    whole = memory.covered_s.shape[1] / swarm.num_vehicles
    assert paid[0, 0] == pytest.approx(0.3 * swarm.scenario.reward.arrival * memory.newly_covered[0, 0] / whole)
    seen = np.flatnonzero(memory.covered_s[0] > 0.0)
    east, north = seen % 48, seen // 48
    ahead = np.arctan2((east + 0.5) * 25.0 - 900.0, (north + 0.5) * 25.0 - 900.0)
    assert np.abs(ahead - 0.7).max() <= math.pi / 3.0
    memory.covered_s[0, seen] -= 25.0
    alone(swarm)
    swarm.state.eta[0, 2] = (300.0, 300.0, 0.7)
    batch.step(idle)
    period = swarm.scenario.timing.decision_period_s
    assert memory.newly_covered[0, 2] == pytest.approx((25.0 + period) / 100.0 * len(seen))


def test_a_search_is_noted_for_its_reward_alone():
    swarm = water()
    before = swarm.task.memory.covered_s.copy()
    swarm.step(np.zeros((1, swarm.num_vehicles, 2)))
    np.testing.assert_array_equal(swarm.task.memory.covered_s, before)
