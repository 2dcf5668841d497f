"""The held-out evaluation: its sets, its page by hand, the command, and the shipped page from the shipped rows."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from research.episodes import read_rows, succeeded, write_rows
from research.heldout import figures, job, page, sets
from research.heldout.__main__ import app
from research.heldout.sets import FIRST, GROUPS, SETS, HeldOut
from uuv_marl.baselines import POLICIES

DOCS = Path(__file__).resolve().parent.parent / "docs"
QUICK = {"swarm.num_vehicles": 3, "time_limit.factor": 0.02, "time_limit.extra_s": 1.0}


def episode(policy="mappo", seed=5000, **changes):
    good = {"task_time_s": "125.000", "collisions": "0", "min_obstacle_distance_m": "15.000", "min_spacing_m": "7.000"}
    return {"set": "random_field", "policy": policy, "seed": str(seed), **good, **changes}


def test_seeds_are_held_out_and_sets_are_told_apart():
    assert len({held.name for held in SETS}) == len(SETS)
    for held in SETS:
        cases = held.cases(None)
        assert {case.load().name for case in cases} == {held.scenario}
        assert {seed for case in cases for seed in case.seeds} == set(range(5000, 5000 + held.seeds["leading"]))
        assert max(len(case.seeds) for case in held.cases(30)) <= 30
        assert held.seeds["leading"] == max(held.seeds.values())
    named = {name.removeprefix("guarded:").partition(",")[0] for group in GROUPS.values() for name in group}
    assert named <= {*POLICIES}


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


def test_the_command_runs_what_is_missing_and_tells_of_it(tmp_path, monkeypatch):
    monkeypatch.setattr(sets, "GROUPS", {"leading": ["bio_inspired_plus", "mappo"], "others": ["bio_inspired"]})
    quick = HeldOut("quick", "random_field", {"leading": 2, "others": 1}, QUICK)
    for module in (job, page):
        monkeypatch.setattr(module, "SETS", (quick,))
    command = [f"--output={tmp_path}"]
    for words, count in ((["--seeds=1"], 3), ([], 5), (["--seeds=1"], 3)):  # shows what is asked for, not what is there
        done = CliRunner().invoke(app, [*command, *words])
        assert done.exit_code == 0, done.output
        rows = read_rows(tmp_path / "heldout.csv.gz")
        assert len(rows) == count
    assert {(row["policy"], row["seed"]) for row in rows} == {
        (name, "5000") for name in ("bio_inspired", "bio_inspired_plus", "mappo")
    }
    text = (tmp_path / "heldout.md").read_text()
    assert "| policy | quick |" in text
    assert "$" not in text


def test_the_picture_of_fields_hides_no_collision(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, path: drawn.append(figure) or path)
    ends = [("125.000", "0"), ("125.000", "1"), ("", "1"), ("", "0")]
    some = lambda policy, *counts: [  # noqa: E731
        episode(policy, task_time_s=time, collisions=hits)
        for (time, hits), n in zip(ends, counts, strict=True)
        for _ in range(n)
    ]
    figures.draw_fields([*some("sdc", 3, 3, 1, 1), *some("mappo", 3, 1, 0, 0)], tmp_path / "picture.png")
    ax = drawn[0].axes[0]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["mappo (n = 4)", "sdc (n = 8)"]
    shares = [bar.get_width() for bar in ax.patches]
    assert shares == pytest.approx([3 / 4, 1 / 4, 0, 0, 3 / 8, 3 / 8, 1 / 8, 1 / 8])


def test_what_is_not_there_is_explained(tmp_path):
    done = CliRunner().invoke(app, ["--only=single", f"--output={tmp_path}"])
    assert done.exit_code == 2
    assert "there is no set 'single'; there are tracking, single_obstacle" in " ".join(done.output.split())


@pytest.mark.docs
def test_the_shipped_page_has_the_shipped_episodes():
    rows, text = read_rows(DOCS / "heldout.csv.gz"), (DOCS / "results.md").read_text()
    assert f" {len(rows):,} episodes" in text
    assert f"count from {FIRST:,}" in text
