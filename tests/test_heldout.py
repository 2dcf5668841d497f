"""The held-out evaluation: its sets, its page by hand, the command, and the shipped page from the shipped rows."""

import pytest

from research.episodes import read_rows, succeeded, write_rows
from research.heldout import page
from research.heldout.sets import FIRST, GROUPS, SETS
from research.second import SECOND
from tests.processes import ROOT
from uuv_marl.baselines import POLICIES

DOCS = ROOT / "docs"


def episode(policy="mappo", seed=5000, **changes):
    good = {"task_time_s": "125.000", "collisions": "0", "min_obstacle_distance_m": "15.000", "min_spacing_m": "7.000"}
    return {"set": "random_field", "policy": policy, "seed": str(seed), **good, **changes}


def test_seeds_are_held_out_and_sets_are_told_apart():
    assert len({held.name for held in SETS}) == len(SETS)
    for held in SETS:
        cases = held.cases(None).values()
        assert {case.load().name for case in cases} == {held.scenario}
        most = max(map(len, held.seeds.values()))
        first = 20_000 if held.name == "random_field" else 5000
        assert {seed for case in cases for seed in case.seeds} == set(range(first, first + most))
        assert max(len(case.seeds) for case in held.cases(30).values()) <= 30
    named = {name.partition(",")[0] for group in GROUPS.values() for name in group}
    assert named <= {*POLICIES, *SECOND}


@pytest.mark.parametrize("name", ["rows.csv", "rows.csv.gz"])
def test_episodes_come_back_from_their_file_which_is_the_same_again(tmp_path, name):
    rows, path = [episode(), episode(policy="scout,push_range=20", task_time_s="")], tmp_path / name
    write_rows(path, rows)
    before = path.read_bytes()
    write_rows(path, read_rows(path))
    assert (read_rows(path), path.read_bytes()) == (rows, before)


def test_the_tables_by_hand():
    hit, late = episode(collisions="2", min_obstacle_distance_m="-1.000"), episode(task_time_s="")
    rows = [episode(), hit, late, episode(policy="sdc", task_time_s="")]
    assert [*map(succeeded, rows)] == [True, False, False, False]
    text = page.report(rows)
    assert "| mappo | 1/3 |" in text
    assert "| mappo | 2/3 | 1 | 125.0 | -1.00 | 7.00 |" in text
    assert "| sdc | 0/1 | 0 | – | 15.00 | 7.00 |" in text


@pytest.mark.docs
def test_the_shipped_page_has_the_shipped_episodes():
    rows, text = read_rows(DOCS / "heldout.csv.gz"), (DOCS / "results.md").read_text()
    assert f" {len(rows):,} episodes" in text
    assert f"seeds, {FIRST:,} and higher" in text
