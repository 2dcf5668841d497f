"""Frames and the window: what is drawn is what is there, where it is; options, keys, errors."""

import pickle

import numpy as np
import pygame
import pytest

import uuv_marl
from tests.golden import STARTER
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.envs.core import make_batched_env
from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import Camera, aim
from uuv_marl.envs.drawing.frame import Panel, _numbers, draw_frame, pixels
from uuv_marl.envs.drawing.painter import Painter
from uuv_marl.envs.drawing.scene import TRAIL_S, SceneHistory
from uuv_marl.envs.solo import SoloEnv
from uuv_marl.envs.vector_env import vector_env

SIZE = (600, 500)


def played(scenario=STARTER, policy="bio_inspired", seconds=10.0, sonar_of=None, seed=0, **changes):
    """The scene of an episode after some seconds, its worlds and its memory."""
    batch = make_batched_env(with_policy_requirements(policy, uuv_marl.load_scenario(scenario, **changes)))
    actor = make_policy(policy, batch.swarm.scenario)
    batch.reset(seed)
    actor.reset(seed)
    memory = SceneHistory(batch.swarm)
    memory.note()
    while batch.swarm.facts.time_s[0] < seconds - 1e-6:
        batch.step(actor.act(batch.swarm.percept))
        memory.note()
    return memory.scene(sonar_of), batch, memory


def colour(picture, at):
    return tuple(int(part) for part in picture[round(at[1]), round(at[0])])


@pytest.mark.parametrize("kind", ["follow", "map"])
def test_everything_is_drawn_where_it_is(kind):
    scene, _, _ = played("single_obstacle", seconds=60.0)
    painter = Painter(SIZE)
    camera = aim(kind, [scene], SIZE)
    picture = pixels(painter.paint(scene, camera))
    assert picture.shape == (500, 600, 3)
    seen = camera.pixels(scene.position)
    away = np.hypot(*(scene.position - scene.references[0]).T) * camera.scale > 40
    hulls = np.array([colour(picture, at) for at in seen[away]], float)
    assert (np.abs(hulls - ink.BLUE).max(axis=1) < 110).mean() > 0.9
    assert (np.abs(hulls - ink.WATER).max(axis=1) > 60).all()
    beside = camera.pixels(scene.obstacles[0, :2] + [15.0, -15.0])
    if kind == "map":
        assert colour(picture, beside) == ink.DISC
        assert np.abs(np.subtract(colour(picture, camera.pixels(scene.waypoints[-1])), ink.AMBER)).max() < 20
    ring = camera.pixels(scene.references[0]) + np.array([12.0, 0.0])
    assert min(np.abs(np.subtract(colour(picture, (ring[0] + d, ring[1])), ink.GREEN)).max() for d in (-2, -1, 0)) < 60


def test_the_bow_points_where_the_vehicle_heads():
    scene, _, _ = played(seconds=0.0)
    heading = np.array([0.0, np.pi / 2, np.pi, -np.pi / 2, 0.7])
    place = np.array([[0.0, -60.0], [0.0, -30.0], [0.0, 0.0], [0.0, 30.0], [0.0, 60.0]])
    scene = scene._replace(position=place, heading=heading, trail=[], references=place[:1] + 90.0)
    camera = Camera(np.zeros(2), 4.0, SIZE)
    blue = np.abs(pixels(Painter(SIZE, grid=False).paint(scene, camera)).astype(int) - ink.BLUE).max(axis=2) < 40
    for at, psi in zip(camera.pixels(place), heading, strict=True):
        x, y = np.round(at).astype(int)
        down, right = np.nonzero(blue[y - 14 : y + 15, x - 14 : x + 15])
        along = (14.0 - down) * np.cos(psi) + (right - 14.0) * np.sin(psi)
        assert along.max() > 8.5, "the tip, 0.6 of s_u ahead at 4 px/m"
        assert along.max() > 1.0 - along.min()


@pytest.mark.parametrize("scenario", ["tracking", "single_obstacle", "multi_obstacle", "random_field", "starter"])
def test_cameras_show_what_they_promise(scenario):
    scene, _, _ = played(scenario, seconds=5.0, seed=3)
    inside = lambda camera, points: ((camera.pixels(points) >= 0) & (camera.pixels(points) <= SIZE)).all()  # noqa: E731
    follow, whole = aim("follow", [scene], SIZE), aim("map", [scene], SIZE)
    assert inside(follow, scene.position)
    assert inside(follow, scene.references[0])
    assert inside(whole, scene.waypoints)
    assert inside(whole, scene.obstacles[:, :2])
    assert inside(whole, scene.position)
    assert follow.scale > whole.scale
    away = scene.position.copy()
    away[0] += 1e5  # one that has run away does not shrink the others to a dot
    assert aim("follow", [scene._replace(position=away)], SIZE).scale > whole.scale


def test_a_long_title_stays_in_its_own_panel():
    scene, _, _ = played(seconds=0.0)
    pictures = [
        pixels(draw_frame([Panel(name, scene), Panel("scout", scene)], (800, 400), "follow", columns=2))
        for name in ("scout", "a/very/long/path/to/a/checkpoint/of/a/policy.safetensors at 101 s")
    ]
    right = np.s_[:, 400:]
    np.testing.assert_array_equal(pictures[0][right], pictures[1][right])
    assert (pictures[0] != pictures[1]).any()


def test_a_scene_remembers_trails_and_collisions_until_its_world_is_reset():
    batch = make_batched_env(STARTER, 2)
    memory = SceneHistory(batch.swarm)
    batch.reset(0)
    memory.note()
    start = batch.swarm.state.eta[:, :, :2].copy()
    state = batch.swarm.state
    for k in range(300):
        if k == 100:  # head-on, 4 m apart
            state.eta[0, :2] = [[-50.0, 0.0, 0.0], [-46.0, 0.0, np.pi]]
            state.nu[0, :2] = [4.0, 0.0, 0.0]
        batch.step(np.zeros((2, 5, 2), np.float32))
        memory.note()
    scene = memory.scene()
    assert scene.collisions == int(batch.collisions[0]) > 0
    assert len(scene.trail) == TRAIL_S
    assert 10.0 < scene.hits[0, 2] < 11.0
    np.testing.assert_allclose(scene.hits[0, :2], [-48.0, 0.0], atol=2.0)
    assert not memory.scene(world=1).hits.size
    memory.note()
    assert len(memory.scene().trail) == TRAIL_S
    batch.reset(worlds=[0])
    memory.note()
    fresh = memory.scene()
    assert not fresh.hits.size
    assert len(fresh.trail) <= 1
    assert len(memory.scene(world=1).trail) == TRAIL_S
    assert not np.allclose(start[1], memory.scene(world=1).position)


def test_the_numbers_are_those_of_the_swarm():
    scene, batch, _ = played("single_obstacle", seconds=70.0)
    facts = batch.swarm.facts
    numbers = {short: value for _, short, value, _ in _numbers(scene)}
    assert numbers["time"] == "70.0 s"
    assert numbers["vehicles"] == "54"
    assert numbers["spacing"] == f"{facts.spacing[0].min():.1f} m"
    assert numbers["clearance"] == f"{facts.clearance[0].min():.1f} m"
    assert numbers["collisions"] == "0"
    away = np.linalg.norm(batch.swarm.state.eta[0, :, :2].mean(axis=0) - facts.reference[0, 0, :2])
    assert numbers["to l(t)"] == (f"{away:.1f} m" if away < 100 else f"{away:.0f} m")


def test_the_sonar_shown_is_what_the_vehicle_hears():
    scene, batch, memory = played("single_obstacle", seconds=70.0, sonar_of=10)
    heard = batch.swarm.detected_index[0, 10]
    eta = batch.swarm.state.eta[0]
    c, s = np.cos(eta[10, 2]), np.sin(eta[10, 2])
    places = eta[10, :2] + scene.sonar.neighbour @ np.array([[c, s], [-s, c]])
    np.testing.assert_allclose(places, eta[heard[heard >= 0], :2], atol=1e-3)
    np.testing.assert_array_equal(scene.sonar.echo_range, batch.swarm.percept["echo_range"][0, 10])
    camera = aim("follow", [scene], SIZE)
    picture = pixels(Painter(SIZE).paint(scene, camera)).astype(int)
    pink = np.abs(picture - ink.PINK).max(axis=2) < 60
    halfway = camera.pixels((places + eta[10, :2]) / 2)
    assert np.mean([pink[round(y) - 1 : round(y) + 2, round(x) - 1 : round(x) + 2].any() for x, y in halfway]) > 0.9
    without = pixels(Painter(SIZE).paint(scene._replace(sonar=None), camera)).astype(int)
    assert not (np.abs(without - ink.PINK).max(axis=2) < 20).any()
    batch.swarm.state.alive[0, 10] = False
    assert memory.scene(10).sonar is None


def test_every_interface_draws_as_its_options_say_and_a_copy_alike():
    drawn = []
    for options in ({}, {"camera": "map"}, {"sonar_of": 2}, {"size": [400, 320]}):  # a list is from a JSON file
        told = {"scenario": "starter", "render_mode": "rgb_array", "render_options": options}
        envs = [uuv_marl.parallel_env(**told), uuv_marl.env(**told), SoloEnv(**told), vector_env(2, **told)]
        for env in envs:
            env.reset(seed=0)
            drawn.append(env.render()[0] if env is envs[-1] else env.render())
            assert drawn[-1].shape == ((320, 400, 3) if "size" in options else (800, 800, 3))
            env.close()
        first = envs[0]
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(first)).render(), first.render())
        pygame.quit()  # by somebody else
        np.testing.assert_array_equal(first.render(), drawn[-4])
        first.step(dict.fromkeys(first.agents, np.ones(2)))  # new numbers, new words
        assert not np.array_equal(first.render(), drawn[-4])
        np.testing.assert_array_equal(drawn[-4], drawn[-3])
    assert len({picture.tobytes() for picture in drawn[::4]}) == 4


@pytest.mark.parametrize(("options", "message"), [
        ("big", "render_options: Input should be a valid dictionary"),
        ({"siez": (3, 3)}, "render_options: siez is unknown; did you mean 'size'"),
        ({"size": (10, 800)}, "size.0 must be greater than or equal to 320, got 10"),
        ({"size": (800.5, 800)}, "size.0 must be a valid integer, got 800.5"),
        ({"camera": np.zeros(2)}, "camera must be 'follow' or 'map', got"),
        ({"camera": "fly"}, "camera must be 'follow' or 'map', got 'fly'"),
        ({"sonar_of": 5}, r"\['sonar_of'\] must be the index of a vehicle, 0 to 4, or None, got 5"),
])  # fmt: skip
def test_options_that_can_not_be_used_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        uuv_marl.parallel_env("starter", render_mode="rgb_array", render_options=options)


def key(name, **fields):
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=getattr(pygame, name), mod=0, **fields))


@pytest.fixture
def window():
    pygame.display.quit()
    env = uuv_marl.parallel_env(STARTER, render_mode="human", render_options={"size": (640, 480)})
    env.reset(seed=0)
    key("K_PLUS")
    yield env
    env.close()


def idle(env):
    return dict.fromkeys(env.agents, np.zeros(2))


def test_a_paused_window_goes_on_by_single_steps(window):
    key("K_SPACE")
    key("K_RIGHT")
    window.step(idle(window))  # would wait for ever but for the second key
    pygame.time.set_timer(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_RIGHT, mod=0), 300, loops=1)
    before = pygame.time.get_ticks()
    window.step(idle(window))
    assert pygame.time.get_ticks() - before >= 250
    key("K_SPACE")
    window.step(idle(window))
    window.step(idle(window))


def test_without_a_display_a_window_is_refused_with_the_remedy(monkeypatch):
    pygame.display.quit()
    env = uuv_marl.parallel_env(num_vehicles=2, render_mode="human")
    for driver in ("offscreen", "dummy"):
        with monkeypatch.context() as patch:
            for name in ("SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
                patch.delenv(name, raising=False)
            patch.setattr(pygame.display, "get_driver", lambda driver=driver: driver)
            with pytest.raises(RuntimeError, match="found no display for its window; use render_mode='rgb_array'"):
                env.reset(seed=0)
            assert not pygame.display.get_init()
    with monkeypatch.context() as patch:
        patch.setenv("SDL_VIDEODRIVER", "nonsense")
        with pytest.raises(RuntimeError, match="found no display for its window; use render_mode"):
            env.reset(seed=0)
    env.reset(seed=0)  # SDL_VIDEODRIVER=dummy, chosen on purpose
    assert env.render() is None
    env.close()


def test_the_last_window_takes_the_display_with_it():
    first, second = (uuv_marl.parallel_env(STARTER, render_mode="human", max_cycles=3) for _ in range(2))
    for env in (first, second):
        env.reset(seed=0)
    first.close()
    second.step(idle(second))
    second.close()
    assert not pygame.display.get_init()


def test_closing_the_window_ends_no_run():
    env = uuv_marl.parallel_env(num_vehicles=2, render_mode="human", max_cycles=3, decision_period=0.1)
    env.reset(seed=0)
    actions = dict.fromkeys(env.agents, np.zeros(2))
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    with pytest.warns(UserWarning, match="the window was closed; the run continues without it"):
        env.step(actions)
    assert not pygame.display.get_init()
    env.step(actions)
    assert env.render() is None
    *_, infos = env.step(actions)
    assert infos["uuv_0"]["ending"] == "time_limit"
    env.close()
