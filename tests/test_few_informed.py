"""Few know the way: the uninformed learn nothing of it but by sonar, reckon where they are, and can follow."""

import numpy as np
import pytest

from tests.swarms import batched, fly, piloted, started
from uuv_marl.baselines import make_policy
from uuv_marl.benchmark.evaluate import evaluate
from uuv_marl.envs.state import global_state, state_layout

TIERS = ("few_informed_easy", "few_informed", "few_informed_hard")
N, K = 20, 3
KNOWN = {"swarm.num_vehicles": N, "task.informed": K}


def water(worlds=1, seed=0, **changes):
    return started("few_informed", KNOWN | changes, worlds, seed)


@pytest.mark.parametrize("k", [1, 7, 40])
def test_so_many_are_informed_and_each_episode_draws_who(k):
    swarm = water(6, **{"task.informed": k})
    informed = swarm.world_map.informed.copy()
    assert (informed.sum(axis=1) == min(k, N)).all()
    np.testing.assert_array_equal(swarm.percept["informed"][..., 0], informed)
    layout = state_layout(swarm.scenario)
    start = layout.starts["informed"]
    np.testing.assert_array_equal(global_state(swarm, layout)[:, start : start + N], informed)
    assert k > N or len({row.tobytes() for row in informed}) == 6
    swarm.reset(0)
    np.testing.assert_array_equal(swarm.world_map.informed, informed)


@pytest.mark.parametrize("sea", [{}, {"navigation.drift_share": 0.1, "navigation.compass_bias_deg": 5.0}])
def test_two_courses_with_equal_sonar_give_the_uninformed_equal_percepts(sea):
    swarm = water(1, 1, **sea)
    swarm.world_map.num_obstacles[0] = 0
    informed, (c, s) = swarm.world_map.informed[0], (np.cos(2.0), np.sin(2.0))
    snapshot, seen = swarm.snapshot(), []
    for turn in (np.eye(2), np.array([[c, s], [-s, c]])):
        swarm.restore(snapshot)
        swarm.world_map.waypoints[0, 0] = swarm.world_map.waypoints[0, 0] @ turn
        rows = [swarm.observe().flat[0].copy()]
        rows += [swarm.step(np.full((1, N, 2), 0.3)).flat[0].copy() for _ in range(5)]
        seen.append(np.array(rows))
    first, second = seen
    assert first[:, ~informed].tobytes() == second[:, ~informed].tobytes()
    assert (first[:, informed] != second[:, informed]).any(axis=2).all()
    assert (first[:, ~informed] != 0.0).any(axis=2).all()


@pytest.mark.parametrize("name", TIERS)
def test_the_start_is_turned_at_random_against_the_first_leg_and_clear_of_obstacles(name):
    swarm = started(name, worlds=64, seed=10_000)
    first, second = swarm.world_map.waypoints[:, 0, 0], swarm.world_map.waypoints[:, 0, 1]
    behind, leg = first - swarm.state.eta[:, :, :2].mean(axis=1), second - first
    angle = np.arctan2(leg[:, 0] * behind[:, 1] - leg[:, 1] * behind[:, 0], (leg * behind).sum(axis=1))
    share = (np.sort(angle) + np.pi) / (2.0 * np.pi)
    assert np.abs(share - np.arange(64) / 63).max() < 0.25  # Kolmogorov's distance of a uniform draw: 0.2 in 1 of 100
    assert swarm.facts.clearance.min() >= 20.0 - 1e-6


def test_who_does_not_perceive_the_reference_reckons_where_it_is():
    """Its map does not move with it. Random actions, so that it turns and comes to no rest."""
    swarm, rng = water(seed=10_001), np.random.default_rng(3)
    policy = make_policy("leader_follower", swarm.scenario)
    origin = turn = None
    began = swarm.state.eta[0, :, :2].copy()
    moved = np.zeros(N)
    for _ in range(120):
        eta, percept = swarm.state.eta[0].copy(), swarm.percept
        policy.update_memory(percept)
        pose = policy.memory.pose[0]
        heading = np.arctan2(pose[:, 3], pose[:, 2])
        turn = eta[:, 2] - heading if turn is None else turn
        c, s = np.cos(turn), np.sin(turn)
        place = np.stack([c * pose[:, 0] - s * pose[:, 1], s * pose[:, 0] + c * pose[:, 1]], axis=1)
        origin = eta[:, :2] - place if origin is None else origin
        error = np.hypot(*(origin + place - eta[:, :2]).T)
        moved = np.maximum(moved, np.hypot(*(eta[:, :2] - began).T))
        swarm.step(policy.drive(percept, rng.uniform(-1.0, 1.0, (1, N, 2)).astype(np.float32)))
    off = np.abs((heading + turn - eta[:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
    informed = swarm.world_map.informed[0]
    assert moved.min() > 5.0
    assert error[informed].max() < 0.01
    assert error[~informed].max() < 0.5
    assert off.max() < 0.02


def test_newcomers_begin_at_the_references_velocity_for_the_informed_alone():
    swarm = water(seed=10_002)
    policy = make_policy("leader_follower", swarm.scenario)
    policy.update_memory(swarm.percept)
    known = policy.memory.known[0] > 0.0
    speed = np.hypot(*np.moveaxis(policy.memory.velocity[0], -1, 0))
    informed = swarm.world_map.informed[0]
    assert known.any(axis=1).all()
    assert (speed[~informed] == 0.0).all()
    np.testing.assert_allclose(speed[informed][known[informed]], swarm.scenario.trajectory.speed_mps, rtol=1e-6)


def test_there_is_at_the_end_once_the_reference_rests_and_who_touched_something_has_failed():
    batch = batched("few_informed", KNOWN | {"time_limit.factor": 1.0})
    swarm, task = batch.swarm, batch.task
    informed = np.flatnonzero(swarm.world_map.informed[0])
    uninformed = np.flatnonzero(~swarm.world_map.informed[0])

    def gather_at(place):
        swarm.state.eta[0, :, :2] = place + 7.0 * np.stack([np.arange(N) % 5, np.arange(N) // 5], axis=1)
        swarm.state.nu[0] = 0.0
        swarm.observe()

    gather_at(swarm.world_map.waypoints[0, 0, 0])
    assert (swarm.facts.away < 80.0).all()
    assert not task.at_goal().any()  # near l(t), which has not come to its end
    swarm.world_map.times[0] *= 1e-3
    swarm.duration_s[0] *= 1e-3
    gather_at(swarm.world_map.waypoints[0, 0, -1])
    swarm.state.collided[0, [informed[0], uninformed[0], uninformed[1]]] = True
    swarm.state.eta[0, uninformed[2], :2] += 200.0
    result = batch.step(np.zeros((1, N, 2)))
    assert (result.terms["stay"][0] > 0.0).tolist() == [k != uninformed[2] for k in range(N)]
    assert not result.over.any()
    expected = {"success_share": 1 - 4 / N, "swarm_success": 0.0, "uninformed_share": 1 - 3 / (N - K)}
    assert batch.task.metrics(0) == pytest.approx(expected)
    while not batch.over.all():
        result = batch.step(np.zeros((1, N, 2)))
    assert result.world_truncated.all()


def test_where_all_are_informed_there_is_no_headline():
    assert water(**{"task.informed": N}).task.metrics(0)["uninformed_share"] is None


def test_a_swarm_that_amplifies_what_it_hears_goes_at_the_cruise_of_its_followers():
    """Without pulls and pushes, after 50 s."""
    speeds = []
    for cruise in (1.0, 2.0):
        name = f"leader_follower,follow=2,cruise={cruise},gather=0,push=0"
        swarm, policy = piloted(name, "few_informed", worlds=4, seed=10_000)
        fly(swarm, policy, 100)
        speed = np.hypot(swarm.state.nu[..., 0], swarm.state.nu[..., 1])[~swarm.world_map.informed]
        assert speed.max() < cruise + 0.4
        speeds.append(np.median(speed) / cruise)
    assert min(speeds) > 0.8


def test_who_leads_is_paid_for_who_follows():
    usual, led = (batched("few_informed_easy", worlds=2, seed=7, reward=reward) for reward in ("dense", "leader"))
    informed, rng = usual.swarm.world_map.informed, np.random.default_rng(0)
    for _ in range(20):
        action = rng.uniform(-1.0, 1.0, (2, 20, 2))
        own, paid = usual.step(action).reward, led.step(action).reward
        np.testing.assert_array_equal(paid[~informed], own[~informed])
        np.testing.assert_allclose(paid[informed], np.repeat(own.mean(axis=1), 4), atol=1e-12)


def test_who_has_no_gamma_agent_keeps_its_velocity():
    """The uninformed of Su, Wang and Lin neither brake nor go anywhere by themselves."""
    swarm, policy = piloted("olfati_saber", "few_informed", {"task.informed": 1}, n=2)
    alone = int(np.flatnonzero(~swarm.world_map.informed[0])[0])
    swarm.state.eta[0, alone, :2] += 5000.0
    swarm.state.nu[0, alone] = (1.5, 0.0, 0.0)
    swarm.observe()
    fly(swarm, policy, 40)
    np.testing.assert_allclose(swarm.state.nu[0, alone], (1.5, 0.0, 0.0), atol=0.05)


def test_one_broadcast_a_round_brings_all_even_over_hops_and_with_losses():
    """By a slow, short and lossy modem; without messages the same gains lead fewer."""
    poor = {"modem.range_m": 60.0, "modem.guard_m": 60.0, "modem.loss_probability": 0.3}
    cases = ("leader_broadcast", {}, 0.9), ("leader_broadcast", poor, 0.9), ("velocity_broadcast", {}, 0.85)
    for name, overrides, least in cases:
        rows = evaluate(name, "few_informed", range(70_000, 70_008), overrides=overrides)
        assert np.mean([row["task"]["uninformed_share"] for row in rows]) > least


def test_all_repeat_the_velocity_that_the_informed_perceive():
    """Within two rounds, each rounding it to 8 bits again."""
    swarm, policy = piloted("velocity_broadcast", "few_informed", worlds=4, seed=70_000)
    first = policy.act(swarm.percept)
    assert ((first[..., 4] > 0.0) == swarm.world_map.informed).all()
    fly(swarm, policy, 50)
    action, (c, s) = policy.act(swarm.percept), np.moveaxis(swarm.heading, -1, 0)
    x, y = 5.0 * action[..., 2], 5.0 * action[..., 3]
    assert (action[..., 4] == 1.0).all()
    told = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    np.testing.assert_allclose(told, np.repeat(swarm.mean_reference[:, None, 2:], 20, axis=1), atol=0.2)
