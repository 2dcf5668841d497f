"""Ways in which vehicles fail: by hand, together all that fail, and those of the shipped pages."""

from types import SimpleNamespace

import numpy as np
import pytest

from research.episodes import read_rows, select
from research.tasks import failures
from research.tasks.failures import Episode, count, run_one, ways
from research.tasks.studies import STUDIES
from tests.processes import ROOT
from uuv_marl import evaluate


def episode(position, away, hit="", failed=True):
    """A vehicle's episode of ``hard_water`` from its positions on a line and its distances."""
    place = np.stack([np.array(position, float), np.zeros(len(position))], axis=1)[:, None]
    swarm = SimpleNamespace(scenario=SimpleNamespace(task=SimpleNamespace(name="hard_water")))
    return Episode(place, np.array(away, float)[:, None], [hit], np.array([failed]), 1, np.zeros((0, 0, 2)), swarm)


def test_ways_by_hand():
    moving, near = np.arange(0, 900, 10), np.arange(900, 0, -10)
    assert [*ways(episode(moving, near))] == [("runs out of time on the way", 0)]
    assert [*ways(episode(moving, near[::-1]))] == [("runs out of time elsewhere", 0)]
    assert [*ways(episode(np.minimum(moving, 500), near))] == [("remains within 40 m of a place", 0)]
    assert [*ways(episode(moving, near, "collides with a vehicle"))] == [("collides with a vehicle", 0)]
    assert [*ways(episode(moving, near, failed=False))] == []


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
    assert f"({task}_failures.png)".replace("(", "(figures/") in (ROOT / "docs" / f"{task}.md").read_text()
