"""The channel ``way`` of hard water, the policy that needs it, and the reward that knows the map."""

import numpy as np
import pytest

from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, make_policy, with_policy_requirements
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.errors import ScenarioError
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.maps.kinds import KINDS

FIRST = 10_000


def told(kinds=tuple(KINDS), vehicles=10, **changes):
    base = load_scenario("hard_water", num_vehicles=vehicles, overrides={"task.kinds": list(kinds), **changes})
    return with_policy_requirements("oracle", base)


def flown(scenario, worlds, decisions):
    """A swarm that the oracle has led for a while."""
    swarm, policy = Swarm(scenario, worlds), make_policy("oracle", scenario, worlds)
    percept = swarm.reset(FIRST)
    for _ in range(decisions):
        percept = swarm.step(policy.act(percept))
    return swarm, percept


@pytest.mark.parametrize(
    ("kind", "vehicles"), [*((kind, 10) for kind in KINDS), ("gate", 54), ("forest", 54), ("harbour", 54)]
)
def test_the_oracle_passes_every_kind_of_map_and_touches_nothing(kind, vehicles):
    runs = [*episodes(told([kind], vehicles), "oracle", range(FIRST, FIRST + 4))]
    assert np.mean([run.metrics["task"]["success_share"] for run in runs]) >= 0.95
    assert max(run.metrics["task"]["time_ratio"] for run in runs) < 2.0


@pytest.mark.parametrize("decisions", [0, 40])
def test_what_the_channel_tells_is_true(decisions):
    """By a second hand: the point ahead lies on free water, nearer along the way; walls by brute force."""
    swarm, percept = flown(told(), 8, decisions)
    task, state, hull = swarm.task, swarm.state, swarm.scenario.collision.hull_radius_m
    np.testing.assert_allclose(percept["path_length"][:, :, 0], task.path_lengths(), rtol=1e-6)
    for w in range(8):
        discs, goal = (
            swarm.world_map.obstacles[w, : swarm.world_map.num_obstacles[w]],
            swarm.world_map.waypoints[w, 0, 1],
        )
        for i in range(10):
            (c, s), at = swarm.heading[w, i], state.eta[w, i, :2]
            out = np.array([[c, s], [-s, c]])  # from the body frame
            point = at + percept["path"][w, i] @ out
            world = np.array([w])
            here, there = (task._path_lengths(world, place[None], goal[None])[0] for place in (at, point))
            assert (np.hypot(*(discs[:, :2] - point).T) - discs[:, 2]).min() >= hull - 1e-3
            assert 1.0 < np.hypot(*(point - at)) < 20.0
            assert there < here - 1.0
            off = discs[:, :2] - at
            gap = np.hypot(*off.T) - discs[:, 2]
            nearest = np.argsort(gap)[:8]
            surfaces = at + off[nearest] * (gap / (gap + discs[:, 2]))[nearest, None]
            np.testing.assert_allclose(at + percept["path_walls"][w, i] @ out, surfaces, atol=1e-3)


def test_without_the_channel_nothing_is_added_and_nothing_changes():
    plain, swarm = (Swarm(load_scenario(told(), overrides={"sonar.channels": have}), 3) for have in ([], ["path"]))
    assert plain.task.memory.path_cost.size == 0
    assert plain.task_fields == ()
    assert swarm.layout.table[: len(plain.layout.table)] == plain.layout.table
    assert [field.name for field in swarm.task_fields] == ["path", "path_length", "path_walls"]
    action = np.full((3, 10, 2), 0.5)
    for each in (plain, swarm):
        each.reset(FIRST)
        each.step(action)
    np.testing.assert_array_equal(swarm.percept.flat[:, :, : plain.layout.size], plain.percept.flat)
    with pytest.raises(KeyError, match="percept has no field 'path'"):
        plain.percept["path"]


def test_a_channel_that_the_task_lacks_is_refused_with_the_remedy():
    message = (
        "sonar.channels can't hold 'path' with task 'follow', whose channels are compass, .*, modem; "
        "task 'hard_water' has it"
    )
    with pytest.raises(ScenarioError, match=message):
        load_scenario("starter", overrides={"sonar.channels": ["path"]})
    with pytest.raises(ScenarioError, match=message):
        with_policy_requirements("oracle", load_scenario("starter"))
    with pytest.raises(ScenarioError, match="can't hold 'wya' with task 'hard_water', whose channels are .*, path$"):
        load_scenario("hard_water", overrides={"sonar.channels": ["wya"]})
    for name in ("starter", "hard_water"):
        with pytest.raises(PolicyError, match="Oracle needs the channels path and link"):
            make_policy("oracle", load_scenario(name))


def test_geodesic_progress_is_what_the_way_has_shortened_by():
    plain = load_scenario("hard_water")
    knowing, dense = (BatchedEnv(plain, 4, reward) for reward in ("geodesic", "dense"))
    for env in (knowing, dense):
        env.reset(FIRST)
    before, total = knowing.task.path_lengths(), 0.0
    for _ in range(20):
        result, usual = (env.step(np.full((4, 10, 2), 0.6)) for env in (knowing, dense))
        total += result.terms["progress"]
        for term in ("obstacle", "spacing", "effort", "collision", "arrival"):
            np.testing.assert_array_equal(result.terms[term], usual.terms[term])
    np.testing.assert_allclose(total, (before - knowing.task.path_lengths()) / plain.reward.progress_m, atol=1e-9)
    with pytest.raises(ValueError, match="choose one of task 'follow'"):
        BatchedEnv(load_scenario("starter"), 1, "geodesic")
