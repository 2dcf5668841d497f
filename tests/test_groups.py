"""Pictures show each group in its colour, with its own way or goals, and who is informed; marks move."""

import json

import numpy as np
import pytest

from tests.swarms import started
from tests.test_rendering import SIZE, played
from tests.test_tasks import TWO
from uuv_marl import load_scenario
from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import aim
from uuv_marl.envs.drawing.frame import Panel, draw_frame, pixels
from uuv_marl.envs.drawing.legend import signs_of
from uuv_marl.envs.drawing.painter import Painter
from uuv_marl.replay.encode import payload
from uuv_marl.replay.record import record
from uuv_marl.tasks.groups import groups_of

SHORT = {"time_limit.factor": 0.02, "time_limit.extra_s": 6.0}


@pytest.fixture(scope="module")
def swap():
    return played("two_swarms", "carrot", 8.0)[0]


@pytest.fixture(scope="module")
def few():
    return played("few_informed_easy", "leader_follower", 8.0)[0]


def painted(scene, kind="map"):
    camera = aim(kind, [scene], SIZE)
    return pixels(Painter(SIZE, grid=False).paint(scene, camera)).astype(int), camera


def near(picture, at, colour, reach=2):
    """Whether a colour is within some pixels of a place."""
    x, y = np.round(at).astype(int)
    part = picture[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]
    return bool((np.abs(part - colour).max(axis=2) < 60).any())


def words(scene):
    return [word for word, _ in signs_of(scene)]


def test_groups_that_swap_sides_have_colours_of_their_own_and_so_have_their_goals(swap):
    picture, camera = painted(swap)
    team = swap.groups.team
    assert np.bincount(team).tolist() == [20, 20]
    assert not swap.followed_paths
    assert len({*ink.TEAMS.values()}) == len(ink.TEAMS) == 4
    for own in (0, 1):
        at = camera.pixels(swap.position[team == own])
        assert np.mean([near(picture, place, ink.TEAMS[own]) for place in at]) > 0.9
        goals = camera.pixels(np.array([way[-1] for number, way in swap.groups.paths.values() if number == own]))
        assert len(goals) == 20
        assert np.mean([near(picture, place, ink.TEAMS[own], 1) for place in goals]) > 0.9
    assert words(swap)[:3] == ["group 1", "group 2", "goal"]


def test_a_goal_at_rest_is_a_goal_in_the_legend_and_nothing_to_follow():
    scene, *_ = played("hard_water", "idle", 1.0)
    assert words(scene)[:2] == ["vehicle", "goal"]


def test_each_group_has_its_trajectory_and_its_leading_point():
    scene, *_ = played("multi_obstacle", "idle", 30.0, num_vehicles=8, overrides=TWO)
    picture, camera = painted(scene)
    assert [number for number, *_ in scene.followed_paths] == [0, 1]
    for number, way, at in scene.followed_paths:
        assert near(picture, camera.pixels(0.6 * way[1] + 0.4 * way[2]), ink.TEAMS[number])
        assert near(picture, camera.pixels(at) + np.array([12.0, 0.0]), ink.TEAMS[number])
        assert near(picture, camera.pixels(way[-1]), ink.TEAMS[number])
    np.testing.assert_allclose(scene.references[0] * [1, -1], scene.references[1])
    follow = aim("follow", [scene], SIZE).pixels(scene.references)
    assert ((follow >= 0) & (follow <= SIZE)).all()


def test_the_uninformed_are_hollow_and_the_legend_says_so(few):
    picture, camera = painted(few, "follow")
    informed = few.groups.informed
    assert informed.sum() == 4
    middle = [picture[*np.round(at).astype(int)[::-1]] for at in camera.pixels(few.position)]
    full = np.abs(np.array(middle) - ink.BLUE).max(axis=1) < 60
    hidden = np.hypot(*(few.position - few.references[0]).T) * camera.scale < 20
    assert (full | hidden)[informed].all()
    assert not full[~informed].any()
    assert words(few)[:3] == ["perceives l(t)", "does not perceive l(t)", "l(t), to follow"]


def test_one_group_of_informed_vehicles_is_drawn_as_ever(few):
    scene, *_ = played("single_obstacle", seconds=10.0)
    assert words(scene)[:2] == ["vehicle", "l(t), to follow"]
    assert len(scene.groups.paths) == 1
    assert scene.groups.informed.all()
    np.testing.assert_array_equal(scene.followed_paths[0][1], scene.waypoints)
    known = few._replace(groups=few.groups._replace(informed=np.ones(20, np.bool_)))
    frames = [pixels(draw_frame([Panel("few", one)], (800, 800), "map")) for one in (few, known)]
    assert not np.array_equal(*frames)
    green = few._replace(groups=few.groups._replace(team=np.ones(20, np.int64)))
    assert not np.array_equal(painted(known)[0], painted(green)[0])


@pytest.mark.parametrize("name", ["two_swarms", "few_informed_easy"])
def test_recordings_and_pages_know_the_groups(name):
    whole = record(load_scenario(name, overrides=SHORT), "idle", 0)
    swarm = started(whole.scenario)
    for one in (whole.scenes[0], whole.scene_at(3.0)):
        for got, wanted in zip(one.groups[:2], groups_of(swarm)[:2], strict=True):
            np.testing.assert_array_equal(got, wanted)
        wanted = [0] * 20 + [1] * 20 if name == "two_swarms" else [None]
        assert [number for number, _ in one.groups.paths.values()] == wanted
    episode = json.loads(json.dumps(payload([whole])))["episodes"][0]
    assert len(episode["paths"]) * 2 == episode["arrays"]["reference"]["shape"][1]
    assert episode["team"] == whole.scenes[0].groups.team.tolist()
    assert len(episode["uninformed"]) == (16 if name == "few_informed_easy" else 0)


def test_circles_of_a_task_move_in_a_recording():
    task = {"task": "examples.extending.task:Rendezvous", **SHORT}
    recording = record(load_scenario("starter", overrides=task), "random", 0)
    centre = np.nanmean(recording.position, axis=1)
    marks = np.array([scene.marks for scene in recording.scenes])
    np.testing.assert_allclose(marks[:, 0, :2], centre, atol=1e-3)
    assert np.ptp(marks[:, 0, 0]) > 0.0
