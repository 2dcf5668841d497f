"""The robustness suite: axes as data, one start at every level, scores by hand, resuming, the command."""

import json

import numpy as np
import pytest

from tests.processes import ROOT, succeeds
from uuv_marl import load_scenario
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.robustness import job, page, scores
from uuv_marl.benchmark.robustness.axes import AXES, CALM, GROUPS, overrides
from uuv_marl.benchmark.success import GRACE_S
from uuv_marl.scenario import disturbances

DOCS = ROOT / "docs"
PLACES = [(axis.name, level) for axis in AXES.values() for level in axis.levels]
TINY = job.Plan(("A1", "C1"), (1, 5), ("starter",), ("bio_inspired",), 1)
UNLIKE = ("S2", "S3", "S4", "S5", "S7", "S8", "F1", "X", "C1")
pytestmark = pytest.mark.needs("pandas")


def silent(what, share):
    pass


def test_every_axis_is_whole():
    assert {axis.group for axis in AXES.values()} == set(GROUPS)
    for axis in AXES.values():
        assert len(axis.labels) == len(axis.severity) == 1 + len(axis.levels) == 1 + len(axis.changes), axis.name
        assert len(set(axis.labels)) == len(axis.labels), axis.name
        assert axis.name.startswith(axis.group)
        assert axis.source
        assert all(changes.keys() == axis.changes[0].keys() for changes in axis.changes)
        steps = np.diff(axis.severity)
        assert np.isnan(steps).all() or (steps >= 0).all() or (steps <= 0).all(), axis.name


@pytest.mark.parametrize("scenario", ["single_obstacle", "random_field", "tracking"])
def test_every_level_is_a_scenario_of_its_own(scenario):
    seen = [load_scenario(scenario, overrides=overrides(CALM, 0, scenario))]
    assert disturbances(seen[0]) == []
    limit = seen[0].time_limit
    assert (limit.factor, limit.extra_s, seen[0].arrival.ends_episode) == (1.0, GRACE_S, False)
    for axis, level in PLACES:
        loaded = load_scenario(scenario, overrides=overrides(axis, level, scenario))
        assert loaded not in seen, (axis, level)
        assert disturbances(loaded) or AXES[axis].channels, (axis, level)
        seen.append(loaded)


def table(policy="p", **cells):
    """Success by seed of a policy: ``W1_3=[...]`` is axis W1 at level 3, ``calm=[...]`` level 0."""
    import pandas

    rows = [
        {"scenario": "s", "policy": policy, "seed": seed, "success_share": value, "axis": axis, "level": level}
        for name, values in cells.items()
        for axis, level in [(CALM, 0) if name == "calm" else (name[:2].rstrip("_"), int(name[-1]))]
        for seed, value in enumerate(values)
    ]
    return scores.by_seed(pandas.DataFrame(rows))


def test_an_axis_is_the_mean_over_its_levels():
    found = scores.axis_score(table(calm=[1.0, 0.8] * 3, W1_1=[1.0, 0.7] * 3, W1_3=[0.5, 0.0] * 3), "W1")
    assert found.value == pytest.approx(0.55)
    assert found.low < 0.55 < found.high
    assert scores.axis_score(table(calm=[1.0] * 6), "W1") is None


def test_the_whole_counts_no_group_that_some_policies_lack():
    cells = {"calm": [1.0] * 6, "W1_1": [1.0] * 6, "A1_1": [0.5] * 6}
    without = scores.group_score(table(**cells), scores.EVERY)
    assert without.value == 0.75
    assert scores.group_score(table(**cells, C1_1=[0.0] * 6, X_1=[0.0] * 6), scores.EVERY) == without


def test_a_group_of_which_every_seed_misses_a_cell_has_no_score():
    half = table(calm=[1.0] * 6, W1_1=[1.0, np.nan] * 3, W1_3=[np.nan, 1.0] * 3)
    assert scores.group_score(half, AXES["W1"].group) is None
    assert scores.group_score(half, scores.EVERY) is None


def test_a_cell_that_is_done_is_not_run_again(tmp_path, monkeypatch):
    asked = []

    def counted(scenario, policy, seeds, *hooks, **parameters):
        asked.extend(seeds)
        yield from episodes(scenario, policy, seeds, *hooks, **parameters)

    monkeypatch.setattr("uuv_marl.benchmark.runner.episodes", counted)
    first = job.run(tmp_path, TINY, silent).read_bytes()
    assert asked == [0, 0, 0]
    assert job.run(tmp_path, TINY, silent).read_bytes() == first
    assert asked == [0, 0, 0]
    job.run(tmp_path, TINY._replace(seeds=2), silent)
    assert asked == [0, 0, 0, 1, 1, 1]
    assert not list(tmp_path.rglob("*.npz"))


def test_the_command_writes_results_page_and_picture(tmp_path):
    words = "--scenario starter --axis A1 --axis C1 --level 1 --level 5 --policy bio_inspired --seeds 1 --output"
    succeeds("robustness", *words.split(), tmp_path)
    text = (tmp_path / "robustness.md").read_text()
    assert "The axes are A1 (actuator lag)." in text
    assert "| – | A1 0." in text, "its worst axis, after the score of X, which was not run"
    assert "C1" not in text, "it uses neither link nor modem"
    assert "still water, no noise, no delay" in text
    rows = job.read_episodes(tmp_path / "episodes.csv")
    assert rows[["axis", "level"]].to_numpy().tolist() == [["0", 0], ["A1", 1], ["A1", 5]]
    assert rows["success_share"][0] == 1.0
    assert rows["success_share"][2] < 1.0, "a lag of 2 s costs something"
    kept = json.loads((tmp_path / "cells" / "starter.A1.5" / "results.json").read_text())
    assert kept["runs"][0]["metrics"]["success_share"] == pytest.approx(rows["success_share"][2])
    before = [path.read_bytes() for path in page.write_robustness_report(tmp_path)]
    assert before == [path.read_bytes() for path in page.write_robustness_report(tmp_path)]


def test_other_tasks_are_scored_by_their_main_metric_within_their_own_time(tmp_path):
    plan = job.Plan(("W4", "F4"), (3,), ("silent_targets_easy", "starter"), ("idle",), 1)
    rows = job.read_episodes(job.run(tmp_path, plan, silent)).set_index(["scenario", "axis"])
    assert [*rows.loc["silent_targets_easy"].index] == [CALM, "F4"], "its obstacles can't be made to move"
    assert [*rows.loc["starter"].index] == [CALM, "W4", "F4"]
    assert "Levels 3; without W4." in page.report(rows.reset_index())
    success = scores.by_seed(rows.reset_index())
    for scenario, name in (("silent_targets_easy", "held_share"), ("starter", "success_share")):
        assert success.loc[(scenario, "idle", 0), (CALM, 0)] == rows.loc[(scenario, CALM), name]
    alone = load_scenario("silent_targets_easy")
    assert load_scenario("silent_targets_easy", overrides=overrides(CALM, 0, "silent_targets_easy")) == alone


@pytest.mark.docs
def test_the_shipped_page_is_made_of_the_shipped_episodes():
    assert (DOCS / "robustness.md").read_text() == page.report(job.read_episodes(DOCS / "robustness.csv.gz"))


@pytest.mark.parametrize("name", [name for name in AXES if name not in UNLIKE])
def test_numbers_in_tables_are_those_that_are_set(name):
    """In percent, or as they are."""
    axis = AXES[name]
    field = next(f for f in axis.changes[0] if len({str(changes[f]) for changes in axis.changes}) > 1)
    values = [c[field][0]["share"] if field == "faults" else c[field] for c in axis.changes]
    factor = 100.0 if axis.unit.startswith("%") else 1.0
    np.testing.assert_allclose(axis.severity[1:], factor * np.array(values))
