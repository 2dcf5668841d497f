"""The channel ``way`` of hard water, the policy that needs it, and the reward that knows the map."""

import numpy as np
import pytest

from tests.swarms import batched, fly, piloted, started
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import PolicyError, make_policy, with_policy_requirements
from uuv_marl.errors import ScenarioError
from uuv_marl.tasks.maps.kinds import KINDS

FIRST = 10_000


def told(kinds=tuple(KINDS), vehicles=10, **changes):
    base = load_scenario("hard_water", num_vehicles=vehicles, overrides={"task.kinds": list(kinds), **changes})
    return with_policy_requirements("oracle", base)


@pytest.mark.parametrize(("scenario", "vehicles", "kind"), [
    *(("hard_water", 10, kind) for kind in KINDS),
    *(("hard_water", 54, kind) for kind in ("gate", "forest", "harbour")),
    *((name, None, None) for name in ("two_swarms_easy", "two_swarms", "two_swarms_hard", "silent_targets_easy")),
])  # fmt: skip
def test_the_oracle_succeeds_on_every_kind_of_map_without_a_collision(scenario, vehicles, kind):
    kinds = {"task.kinds": [kind]} if kind else {}
    runs = evaluate("oracle", scenario, range(FIRST, FIRST + 4), num_vehicles=vehicles, overrides=kinds)
    share = "held_share" if scenario.startswith("silent_targets") else "success_share"
    assert np.mean([run["task"][share] for run in runs]) >= 0.95
    assert not kind or max(run["task"]["time_ratio"] for run in runs) < 2.0


@pytest.mark.parametrize("decisions", [0, 40])
def test_what_the_channel_tells_is_true(decisions):
    """By a second hand: the point ahead lies on free water, nearer along the way; walls by brute force."""
    swarm, policy = piloted("oracle", told(), worlds=8, seed=FIRST)
    percept = fly(swarm, policy, decisions)
    task, state, world_map, hull = swarm.task, swarm.state, swarm.world_map, swarm.scenario.collision.hull_radius_m
    np.testing.assert_allclose(percept["path_length"][:, :, 0], task.path_length_m(), rtol=1e-6)
    for w in range(8):
        discs, goal = world_map.obstacles[w, : world_map.num_obstacles[w]], world_map.waypoints[w, 0, 1]
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
    plain, swarm = (started(told(), {"sonar.channels": have}, 3, FIRST) for have in ([], ["path"]))
    assert plain.task.memory.path_cost.size == 0
    assert plain.task_fields == ()
    assert swarm.layout.table[: len(plain.layout.table)] == plain.layout.table
    assert [field.name for field in swarm.task_fields] == ["path", "path_length", "path_walls"]
    for each in (plain, swarm):
        each.step(np.full((3, 10, 2), 0.5))
    np.testing.assert_array_equal(swarm.percept.flat[:, :, : plain.layout.size], plain.percept.flat)
    with pytest.raises(KeyError, match="percept has no field 'path'"):
        plain.percept["path"]


def test_a_channel_that_the_task_lacks_is_refused_with_the_remedy():
    message = "can't hold 'path' with task 'follow', whose channels are compass, .*, episode; task 'hard_water' has it"
    with pytest.raises(ScenarioError, match=f"sonar.channels {message}"):
        load_scenario("starter", overrides={"sonar.channels": ["path"]})
    with pytest.raises(ScenarioError, match=message):
        with_policy_requirements("oracle", load_scenario("starter"))
    with pytest.raises(ScenarioError, match="can't hold 'wya' with task 'hard_water', whose channels are .*, path$"):
        load_scenario("hard_water", overrides={"sonar.channels": ["wya"]})
    for name in ("starter", "hard_water"):
        with pytest.raises(PolicyError, match="oracle needs the channels path and link"):
            make_policy("oracle", load_scenario(name))


def test_geodesic_progress_is_what_the_way_has_shortened_by():
    knowing, dense = (batched("hard_water", worlds=4, seed=FIRST, reward=reward) for reward in ("geodesic", "dense"))
    before, total = knowing.task.path_length_m(), 0.0
    for _ in range(20):
        result, usual = (env.step(np.full((4, 10, 2), 0.6)) for env in (knowing, dense))
        total += result.terms["progress"]
        for term in ("obstacle", "spacing", "effort", "collision", "stay"):
            np.testing.assert_array_equal(result.terms[term], usual.terms[term])
    shorter = (before - knowing.task.path_length_m()) / knowing.swarm.scenario.reward.progress_m
    np.testing.assert_allclose(total, shorter, atol=1e-9)
    with pytest.raises(ValueError, match="choose one of task 'follow'"):
        batched("starter", reward="geodesic")
