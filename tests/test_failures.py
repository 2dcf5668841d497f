"""Ways in which vehicles fail: by hand, together all that fail, and those of the shipped pages."""

import numpy as np
import pytest

from research.episodes import read_rows, select
from research.tasks import failures
from research.tasks.failures import Episode, count, run_one, ways
from research.tasks.studies import STUDIES
from tests.processes import ROOT
from uuv_marl import evaluate, load_scenario
from uuv_marl.sim.swarm import Swarm


def episode(position, away, collided=(), failed=True, task="hard_water", informed_at=None):
    """Of a vehicle that moves on a line, from its positions and distances, and maybe of an informed one at rest."""
    num = 1 + (informed_at is not None)
    place, far = np.zeros((len(position), num, 2)), np.zeros((len(position), num))
    place[:, 0, 0], far[:, 0] = position, away
    place[:, 1:, 0] = informed_at or 0.0
    swarm = Swarm(load_scenario(task, num_vehicles=num))
    swarm.reset(0)
    informed = np.arange(num) > 0
    swarm.world_map.informed[0] = informed
    swarm.task.succeeded = lambda: np.array([[not failed, True][:num]])
    return Episode(place, far, np.zeros((0, 0, 2)), dict(collided), ~informed, swarm)


def test_ways_by_hand():
    moving, near = np.arange(0, 900, 10), np.arange(900, 0, -10)
    assert [*ways(episode(moving, near))] == [("runs out of time", 0)]
    back = np.where(near > 500, near, 520)
    assert [*ways(episode(moving, back))] == [("runs out of time", 0)]
    assert [*ways(episode(moving, back + 15 * (back == 520)))] == [("runs out of time after a detour", 0)]
    assert [*ways(episode(np.minimum(moving, 500), near))] == [("remains within 40 m of a place", 0)]
    assert [*ways(episode(moving, near, {0: "collides with a vehicle"}))] == [("collides with a vehicle", 0)]
    assert [*ways(episode(moving, near, failed=False))] == []
    for place, way in ((865.0, "runs out of time"), (855.0, "ends without an informed vehicle in range")):
        assert [*ways(episode(moving, near, task="few_informed", informed_at=place))] == [(way, 0)]


def test_a_collision_is_with_what_the_replay_says():
    """And a vehicle without a collision has none."""
    found = [run_one("sff", "two_swarms_easy", seed) for seed in (1, 2)]
    assert {what for each in found for what in each.collided.values()} == {*failures._COLLISIONS.values()}
    for each in found:
        assert {*each.collided} == {*np.flatnonzero(each.swarm.state.collided[0]).tolist()}


@pytest.mark.parametrize(
    ("task", "measure"),
    [("two_swarms_easy", "success_share"), ("few_informed", "uninformed_share"), ("silent_targets", "held_share")],
)
def test_the_ways_are_all_that_fails(task, measure):
    rows = count("scout", task, [3])
    (metrics,) = evaluate("scout", task, [3])
    lacking = sum(int(row["count"]) for row in rows) / int(rows[0]["of"])
    assert lacking == pytest.approx(1.0 - metrics["task"][measure], abs=1e-9)
    counts = [int(row["count"]) for row in rows]
    assert counts == sorted(counts, reverse=True)
    for row in rows:
        assert (row["way"], int(row["index"])) in [*ways(run_one("scout", task, int(row["seed"])))]


@pytest.mark.parametrize("task", STUDIES)
def test_the_shipped_rows_are_of_the_study_and_have_a_picture(task):
    mine = select(read_rows(failures.ROWS), task=task)
    assert {row["policy"] for row in mine} == {*STUDIES[task].failures}
    assert (ROOT / "docs" / "figures" / f"{task}_failures.png").exists()
    assert f"(figures/{task}_failures.png)" in (ROOT / "docs" / f"{task}.md").read_text()
