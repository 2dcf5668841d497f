"""Of hundreds of obstacles only near ones are examined: facts and echoes are as with all of them."""

import numpy as np
import pytest

from tests.oracle import sonar
from tests.swarms import started

PILES = {"task.kinds": ["piles"], "timing.fixed": False}
HULL = 1.0
AROUND = [{"name": "all", "kind": "active", "mounting_deg": 20.0, "aperture_deg": 360.0, "range_m": 60.0,
           "sub_sectors": 5}]  # fmt: skip
BEHIND = [{"name": name, "kind": "active", "mounting_deg": mounting, "aperture_deg": 50.0, "range_m": 90.0,
           "sub_sectors": 2} for name, mounting in (("left", -150.0), ("right", 130.0))]  # fmt: skip


def among_piles(period_s, seed, **changes):
    """Coasting vehicles among hundreds of discs, a third of which move; some leave all that they remembered."""
    changes |= {"timing.decision_period_s": period_s}
    swarm = started("hard_water", PILES | changes, seed=10_000 + seed, n=30)
    rng, num = np.random.default_rng(seed), swarm.world_map.num_obstacles[0]
    assert num > 200
    first = swarm.world_map.obstacles[0, rng.integers(num, size=30)]
    swarm.state.eta[0, :, :2] = first[:, :2] + rng.normal(scale=2.0, size=(30, 2)) * first[:, 2:]
    swarm.state.nu[0, :, 0] = rng.choice([0.0, 3.0, 15.0, 40.0], 30)
    swarm.world_map.obstacle_velocity[0, :num:3] = rng.uniform(
        -0.3, 0.3, swarm.world_map.obstacle_velocity[0, :num:3].shape
    )
    swarm.observe()
    return swarm


def check_echoes(swarm):
    percept, discs = swarm.percept, swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0]]
    for i in range(swarm.num_vehicles):
        found = sonar.echoes(swarm.state.eta[0, i, :2], swarm.heading[0, i], discs, swarm.scenario.sonar)
        for name, part in zip(("echo", "echo_range", "echo_position"), found, strict=True):
            np.testing.assert_array_equal(percept[name][0, i].ravel(), part.astype(np.float32).ravel(), err_msg=name)
    assert percept["echo"].sum() > 30


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("stops", [True, False])
def test_facts_are_those_of_all_pairs(seed, stops):
    """Each control step against the oracle, and decisions of twenty against the facts of these control steps."""
    calm = {"collision.stops": stops, "actuators.yaw_damping_nms": 0.0}
    by_hold, by_many = (among_piles(period_s, seed, **calm) for period_s in (0.1, 2.0))
    alive, ahead = np.ones(30, bool), np.zeros((1, 30, 2), np.float32)
    ahead[..., 0] = not stops  # straight on, so that a force that is held stays ahead
    for _ in range(2):
        clearance, reached, contacts = np.full(30, np.inf), np.inf, np.zeros(30, int)
        for _ in range(20):
            num, before = by_hold.world_map.num_obstacles[0], by_hold.state.eta[0, :, :2].copy()
            discs_before = by_hold.world_map.obstacles[0, :num].copy()
            by_hold.step(ahead)
            now, discs = by_hold.state.eta[0, :, :2], by_hold.world_map.obstacles[0, :num]
            nearest, nearest_vehicle, _ = sonar.obstacles(now, before, alive, HULL, discs)
            gap, was = (np.sqrt(sonar.between(places, those)[1]) - those[:, 2]
                        for places, those in ((now, discs), (before, discs_before)))  # fmt: skip
            met = ((gap < HULL) & (was >= HULL)).sum(axis=1)
            facts = by_hold.facts
            np.testing.assert_array_equal(facts.clearance[0], nearest)
            np.testing.assert_array_equal(facts.obstacle_clearance[0, :num], nearest_vehicle)
            assert (facts.vehicle_collisions[0] >= met).all()
            clearance, reached = np.minimum(clearance, nearest), np.minimum(reached, nearest_vehicle)
            contacts += facts.vehicle_collisions[0]
        by_many.step(ahead)
        np.testing.assert_array_equal(by_many.state.eta, by_hold.state.eta)
        np.testing.assert_array_equal(by_many.facts.clearance[0], clearance)
        np.testing.assert_array_equal(by_many.facts.obstacle_clearance[0, :num], reached)
        np.testing.assert_array_equal(by_many.facts.vehicle_collisions[0], contacts)
    assert by_many.state.collided.any()


@pytest.mark.parametrize("arrays", [None, AROUND, BEHIND], ids=["bow", "around", "behind"])
@pytest.mark.parametrize("report", ["centre", "surface"])
def test_echoes_are_those_of_all_discs(arrays, report):
    changes = {"sonar.echo_reports": report} | ({} if arrays is None else {"sonar.arrays": arrays})
    swarm = among_piles(0.5, 5, **changes)
    for _ in range(3):
        check_echoes(swarm)
        swarm.step(np.zeros((1, 30, 2), np.float32))
    check_echoes(swarm)


def test_a_hull_stops_where_it_stops_among_few_discs():
    """Against a world that has only the discs around, so few that all are examined."""
    many = among_piles(0.5, 7)
    many.world_map.obstacle_velocity[:] = 0.0
    many.state.eta[0, 1:, :2] += 3000.0 + 50.0 * np.arange(58).reshape(29, 2)  # one vehicle among the discs
    many.state.nu[0, 0] = (6.0, 0.5, 0.2)
    few = among_piles(0.5, 7)
    few.restore(many.snapshot())
    discs = many.world_map.obstacles[0, : many.world_map.num_obstacles[0]]
    order = np.argsort(np.hypot(*(discs[:, :2] - many.state.eta[0, 0, :2]).T) - discs[:, 2], kind="stable")
    few.world_map.obstacles[0, :16], few.world_map.num_obstacles[0] = discs[np.sort(order[:16])], 16
    for swarm in (many, few):
        swarm.observe()
    for t in range(20):
        action = np.zeros((1, 30, 2), np.float32)
        action[0, 0] = (np.cos(t), np.sin(t))
        for swarm in (many, few):
            swarm.step(action)
        np.testing.assert_array_equal(many.state.eta, few.state.eta)
