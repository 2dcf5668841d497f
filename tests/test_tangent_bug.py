"""``tangent_bug``: it comes round walls, remembers where they are, and forgets them."""

import numpy as np
import pytest

from tests.swarms import piloted
from uuv_marl import load_scenario
from uuv_marl.baselines.bug.gains import BUG_BARRIER, BugGains
from uuv_marl.baselines.bug.walls import SAME_M

GOAL_M = 200.0
BAR = [(110.0, float(y)) for y in range(-70, 41, 10)]
POCKET = [(110.0, float(y)) for y in range(-40, 31, 10)] + [(float(x), y) for x in (100, 90, 80) for y in (-40.0, 30.0)]


def water(walls, surface=False, side=1.0):
    """One vehicle at (5, 4), its bow to the goal, which is at rest behind walls of discs of 7 m."""
    changes = {
        "task": {"name": "reach", "near_m": 10.0}, "trajectory.waypoints_m": [[0.0, 0.0], [GOAL_M, 0.0]],
        "obstacles": [{"centre_m": [x, side * y], "radius_m": 7.0} for x, y in walls], "collision.stops": True,
        "sonar.echo_reports": "surface" if surface else "centre",
    }  # fmt: skip
    return load_scenario("starter", num_vehicles=1, overrides=changes)


def goes(name, scenario, side=1.0, steps=300, **parameters):
    """The swarm, the policy, and places [m], shape (decision, 2), until the vehicle is there."""
    (swarm, policy), places = piloted(name, scenario, seed=10_000, **parameters), []
    swarm.state.eta[0, 0], swarm.state.nu[0, 0] = (5.0, 4.0 * side, 0.0), 0.0
    swarm.observe()
    for _ in range(steps):
        swarm.step(policy.act(swarm.percept))
        places.append(swarm.state.eta[0, 0, :2].copy())
        if swarm.ended[0]:
            break
    return swarm, policy, np.array(places)


@pytest.mark.parametrize("walls", [BAR, POCKET], ids=["bar", "pocket"])
@pytest.mark.parametrize("surface", [False, True], ids=["centres", "surfaces"])
def test_it_comes_round_a_wall_that_stops_a_pull(walls, surface):
    swarm, _, places = goes("tangent_bug", water(walls, surface))
    assert np.hypot(GOAL_M - places[-1, 0], places[-1, 1]) <= 10.0
    assert not swarm.state.collided.any()
    _, _, pulled = goes("proportional_tracking,safety_filter=true", water(walls, surface))
    assert pulled[-1, 0] < 110.0


def test_in_mirrored_water_it_goes_the_mirrored_way():
    _, _, places = goes("tangent_bug", water(BAR))
    _, _, mirrored = goes("tangent_bug", water(BAR, side=-1.0), side=-1.0)
    assert np.abs(places[:, 1]).max() > 45.0
    np.testing.assert_allclose(places[:, 1], -mirrored[:, 1], atol=0.01)


@pytest.mark.parametrize("surface", [False, True], ids=["centres", "surfaces"])
def test_dead_reckoning_remembers_walls_where_they_are(surface):
    """After a way round them; the map's origin is the goal, and its first axis the bow at the start."""
    swarm, policy, places = goes("tangent_bug", water(POCKET, surface), gains=BugGains(), barrier=BUG_BARRIER)
    walls = policy.memory.echoes[0, 0, : int(policy.memory.num[0, 0])] + (GOAL_M, 0.0, 0.0)
    away = np.hypot(*(walls[:, None, :2] - swarm.world_map.obstacles[0, None, :, :2]).transpose(2, 0, 1))
    if surface:
        assert np.abs(away - 7.0).min(axis=1).max() < 1.0
        assert not walls[:, 2].any()
    else:
        assert away.min(axis=1).max() < 1.0
        np.testing.assert_allclose(walls[:, 2], 7.0, atol=1.0)
    assert np.hypot(*np.diff(places, axis=0).T).sum() > 1.2 * GOAL_M
    apart = np.abs(walls[:, None, :2] - walls[None, :, :2]).max(axis=2) + 9.0 * np.eye(len(walls))
    assert surface or apart.min() >= SAME_M


def test_more_walls_than_it_has_room_for_take_the_place_of_the_oldest():
    swarm, policy, _ = goes("tangent_bug", water(BAR, True), steps=20)
    echoes, num, following = policy.memory.echoes, policy.memory.num, policy.memory.next
    room = echoes.shape[2]
    num[...], following[...], echoes[...] = room, room - 1, -5000.0
    policy.act(swarm.percept)
    heard = (echoes[0, 0, :, 0] > -4000.0).nonzero()[0]
    assert num[0, 0] == room
    assert set(heard) == {room - 1, *range(len(heard) - 1)}
    assert following[0, 0] == len(heard) - 1 > 1
