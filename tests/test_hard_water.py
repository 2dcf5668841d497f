"""Hard water: maps are drawn by the seed alone, can be passed, and are what their numbers say."""

import numpy as np
import pytest
from scipy.ndimage import label

from tests.swarms import started
from uuv_marl.errors import ScenarioError
from uuv_marl.tasks.maps.grid_paths import CELL_M, MapGrid, distances, free_cells, reached
from uuv_marl.tasks.maps.kinds import KINDS

SEEDS = range(8)


def water(kind, **changes):
    return started("hard_water", {"task.kinds": [kind], **changes})


@pytest.mark.parametrize("kind", KINDS)
def test_every_map_can_be_passed_from_each_start_with_its_clearance(kind):
    """By a second hand: clearances by brute force, connectivity by SciPy's labels."""
    swarm = water(kind)
    task, numbers = swarm.task, swarm.task.numbers
    grid = numbers.grid()
    x, y = (
        grid.x + CELL_M * np.arange(grid.rows)[:, None, None], grid.y + CELL_M * np.arange(grid.columns)[None, :, None]
    )  # fmt: skip
    for seed in SEEDS:
        made = task.sample_map(np.random.default_rng(seed))
        away = np.hypot(x - made.discs[:, 0], y - made.discs[:, 1]) - made.discs[:, 2]
        free = away.min(axis=2) >= numbers.clearance_m
        parts, _ = label(free)
        goal = grid.cell(made.length, 0.0)
        swarm.reset(seed)
        c, s = task.memory.turn[0]
        north, east = swarm.state.eta[0, :, 0], swarm.state.eta[0, :, 1]
        starts = parts[grid.cell(c * north + s * east, c * east - s * north)]
        assert parts[goal] > 0
        assert kind == made.kind
        assert (starts > 0).all()
        assert swarm.facts.clearance.min() >= numbers.start_clear_m
        assert len(made.discs) < swarm.world_map.obstacles.shape[1]
        assert (task.path_length_m() >= swarm.facts.away).all()
        assert (task.path_length_m() < 3.0 * swarm.facts.away).all()


def test_free_cells_and_ways_are_those_of_brute_force():
    grid, rng = MapGrid(-20.0, -15.0, 30, 25), np.random.default_rng(0)
    discs = np.concatenate([rng.uniform(-20, 50, (6, 2)), rng.uniform(2, 6, (6, 1))], axis=1)
    x, y = grid.x + CELL_M * np.arange(30)[:, None, None], grid.y + CELL_M * np.arange(25)[None, :, None]
    expected = ((x - discs[:, 0]) ** 2 + (y - discs[:, 1]) ** 2 >= (discs[:, 2] + 1.5) ** 2).all(axis=2)
    free = free_cells(discs, grid, 1.5)
    np.testing.assert_array_equal(free, expected)
    parts, _ = label(free)
    row, column = map(int, np.argwhere(free)[0])
    np.testing.assert_array_equal(reached(free, row, column), parts == parts[row, column])
    way = distances(free, row, column)
    assert (np.isfinite(way) >= (parts == parts[row, column])).all()
    empty = distances(np.ones_like(free), 15, 12)
    straight = CELL_M * np.hypot(np.arange(30)[:, None] - 15, np.arange(25)[None, :] - 12)
    assert (empty >= straight - 1e-9).all()
    assert (empty <= straight / np.cos(np.radians(13.3)) + 1e-9).all()  # the widest gap between two steps


def test_there_is_along_the_free_way():
    """Behind a wall a vehicle may be near the goal, and is not there."""
    swarm = water("gate", **{"task.near_m": 60.0})
    task, goal = swarm.task, swarm.world_map.waypoints[0, 0, 1]
    swarm.state.eta[0, :, :2] = goal + 4.0 * np.arange(10)[:, None]
    swarm.observe()
    assert task.at_goal().all()
    task.memory.path_length[0] += 100.0  # as if all ways were longer
    assert not task.at_goal().any()


def test_knobs_that_leave_no_way_are_refused_with_the_remedy():
    message = "of gate, none of them with a path at task.clearance_m = 3; widen the gaps"
    with pytest.raises(ScenarioError, match=message):
        water("gate", **{"task.gate.gap_m": [1.0, 2.0]})
