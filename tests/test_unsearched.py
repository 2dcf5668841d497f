"""The channel ``unsearched`` of silent targets: each vehicle's own map of what it and its neighbours have searched."""

import math

import numpy as np
import pytest

from tests.swarms import piloted, started
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy
from uuv_marl.errors import PolicyError
from uuv_marl.tasks.unsearched import FORGET_S, NEIGHBOUR_M, PLOT_M, RINGS_M, octant_of

HALF_M = 600.0


def alone(n=1):
    """A vehicle at rest in a corner, or several, with empty maps."""
    swarm = started("silent_targets", {"sonar.channels": ["unsearched"]}, seed=10_100, n=n)
    swarm.state.eta[:] = (HALF_M - 50.0, HALF_M - 50.0, 0.0)
    swarm.state.nu[:] = 0.0
    swarm.task.memory.searched_s[:] = -math.inf
    return swarm


def plots():
    """Positions of plots in the box [m], shape (plot, 2)."""
    each = (np.arange(24) + 0.5) * PLOT_M - HALF_M
    return np.stack(np.meshgrid(each, each, indexing="ij"), axis=-1).reshape(-1, 2)


def marked(swarm, vehicle=0):
    """Positions of the plots in the vehicle's map."""
    return plots()[np.isfinite(swarm.task.memory.searched_s[0, vehicle])]


def shares_by_hand(eta, age):
    """Shares for a pose, from the age of each plot as a share of ``FORGET_S``."""
    to = plots() - eta[:2]
    away, bearing = np.hypot(*to.T), (np.arctan2(to[:, 1], to[:, 0]) - eta[2]) % (2.0 * math.pi)
    shares, inner = np.zeros((2, 8)), 0.0
    for ring, outer in enumerate(RINGS_M):
        for octant in range(8):
            own = (away > inner) & (away <= outer) & (bearing // (math.pi / 4.0) == octant)
            shares[ring, octant] = age[own].sum() * PLOT_M**2 / (math.pi * (outer**2 - inner**2) / 8.0)
        inner = outer
    return np.minimum(shares, 1.0)


def test_octants_go_clockwise_from_the_bow():
    bearings = np.radians(np.arange(0.5, 360.0))
    assert [octant_of(math.cos(b), math.sin(b)) for b in bearings] == [int(b // (math.pi / 4.0)) for b in bearings]


def test_a_vehicle_notes_what_its_bow_covers():
    swarm = alone()
    swarm.state.eta[0, 0] = (100.0, -200.0, 2.0)
    swarm.observe()
    to = marked(swarm) - swarm.state.eta[0, 0, :2]
    assert len(to) * PLOT_M**2 == pytest.approx(math.pi / 3.0 * 100.0**2, rel=0.3)
    assert np.hypot(*to.T).max() <= 100.0
    assert (np.abs((np.arctan2(to[:, 1], to[:, 0]) - 2.0 + math.pi) % (2.0 * math.pi) - math.pi) <= math.pi / 3.0).all()


@pytest.mark.parametrize("pose", [(13.0, 21.0, 0.3), (-420.0, 333.0, -2.2), (580.0, 590.0, 1.1), (900.0, 0.0, 3.0)])
def test_shares_are_those_of_the_map_around_the_vehicle(pose):
    swarm, rng = alone(), np.random.default_rng(0)
    swarm.state.eta[0, 0] = pose
    swarm.task.memory.searched_s[0, 0] = rng.uniform(-250.0, 0.0, 576)
    told = swarm.observe()["unsearched"][0, 0]
    age = np.minimum(-swarm.task.memory.searched_s[0, 0], FORGET_S) / FORGET_S
    np.testing.assert_allclose(told, shares_by_hand(swarm.state.eta[0, 0], age), atol=1e-5)


def test_a_turn_by_a_right_angle_turns_the_shares_by_two_octants():
    swarm, told = alone(), []
    swarm.task.memory.searched_s[0, 0, :288] = 0.0  # the southern half
    for heading in (0.2, 0.2 + math.pi / 2.0):
        swarm.state.eta[0, 0] = (0.0, 0.0, heading)
        told.append(swarm.observe()["unsearched"][0, 0, 1].copy())
    np.testing.assert_allclose(np.roll(told[0], -2), told[1], atol=0.02)
    assert told[0].max() > 0.9
    assert told[0].min() < 0.1


def test_plots_near_a_detected_neighbour_count_as_searched():
    swarm = alone(3)
    swarm.state.eta[0] = [(0.0, 0.0, 0.0), (80.0, 20.0, 0.0), (590.0, 590.0, 0.0)]  # the last is out of range
    assert swarm.observe()["detected"][0, 0].sum() == 1
    has_mark = np.isfinite(swarm.task.memory.searched_s[0, 0])
    near = [np.hypot(*(plots() - pose[:2]).T) <= NEIGHBOUR_M for pose in swarm.state.eta[0]]
    assert has_mark[near[1]].all()
    assert not has_mark[near[2]].any()


def test_a_map_is_the_same_in_any_batch():
    changes = {"sonar.channels": ["unsearched"]}
    single, among = started("silent_targets", changes, 1, 10_101), started("silent_targets", changes, 3, 10_100)
    for k in range(40):
        force = np.array([1.0, 0.3 * math.sin(k)])
        single.step(np.tile(force, (1, 8, 1)))
        among.step(np.tile(force, (3, 8, 1)))
    np.testing.assert_array_equal(single.percept["unsearched"][0], among.percept["unsearched"][1])
    assert 0.1 < single.percept["unsearched"].mean() < 0.9


def test_without_the_channel_there_is_no_map():
    assert started("silent_targets").task.memory.searched_s.size == 0


def test_the_controller_searches_where_its_map_is_unsearched():
    for side in (-1.0, 1.0):
        swarm, policy = piloted("nearest_target,unsearched=true", "silent_targets", n=2, seed=10_100)
        swarm.world_map.obstacles[:, :, :2] = 1e4
        swarm.state.eta[0] = [(0.0, 0.0, 0.0), (-500.0, -500.0, 0.0)]
        swarm.task.memory.searched_s[0, 0] = np.where(plots()[:, 1] * side > 0.0, -math.inf, 0.0)
        for _ in range(20):
            swarm.step(policy.act(swarm.percept))
        assert side * swarm.state.eta[0, 0, 1] > 10.0


def test_the_controller_searches_in_lanes_or_by_its_map():
    scenario = load_scenario("silent_targets", overrides={"sonar.channels": ["identity", "unsearched"]})
    with pytest.raises(PolicyError, match="lanes and unsearched are both true; leave one out"):
        make_policy("nearest_target,lanes=true,unsearched=true", scenario)
