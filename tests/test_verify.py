"""``research.verify``: shipped rows come out again, a changed digit is found, and what can't be run is named."""

import json
import math
import platform
from pathlib import Path

import pytest
from typer.testing import CliRunner

from research.episodes import read_rows, select, write_rows
from research.learners import cells
from research.learners.protocol import TASKS
from research.verify import check
from research.verify.__main__ import app
from tests.processes import ROOT
from uuv_marl import load_scenario
from uuv_marl.benchmark.results import Results
from uuv_marl.benchmark.runner import run_missing

DOCS = ROOT / "docs"
SAME_BITS = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64"), reason="files come from an x86-64 processor"
)
N10 = {"set": "random_field_n10", "policy": "mappo", "seed": "5000"}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """Short paths, so that the table has room."""
    monkeypatch.chdir(tmp_path)


def verify(status, *words):
    """The output as one line, of its table the last column alone; the exit status must be this one."""
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == status, done.output
    lines = (line.split("│")[-2] if "│" in line else line for line in done.output.splitlines())
    return " ".join(" ".join(lines).split())


def copied(folder, name, wanted, **changes):
    """A file with the one shipped row that has these cells, some of them changed."""
    (row,) = select(read_rows(DOCS / name), **wanted)
    path = folder / Path(name).stem
    write_rows(path, [row | changes])
    return path.name


@SAME_BITS
@pytest.mark.parametrize(("name", "wanted", "numbers"), [
    ("heldout.csv.gz", N10, 4),
    ("heldout.csv.gz", N10 | {"policy": "mappo_2"}, 4),
    ("robustness.csv.gz", {"axis": "A1", "level": "3", "policy": "mappo", "seed": "3"}, 1),
    ("paper.csv.gz", {"policy": "sdc", "seed": "4"}, 4),
], ids=["heldout", "second training", "robustness", "paper"])  # fmt: skip
def test_shipped_rows_come_out_again(tmp_path, name, wanted, numbers):
    output = verify(0, copied(tmp_path, name, wanted))
    assert f"agrees ({numbers} numbers)" in output
    assert "1 of 1 rows that were run agree in every digit, 0 differ." in output


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("benchmark")
    overrides = {"time_limit.factor": 0.1, "time_limit.extra_s": 1.0}
    kept = Results(folder, [load_scenario("starter", overrides=overrides)], traces=False)
    run_missing(kept, [load_scenario("starter", overrides=overrides)], ["mappo"], [0, 1], lambda *_: None)
    return folder / "results.json"


def test_the_runs_of_a_benchmark_are_compared_in_full(results, tmp_path):
    assert "2 of 2 rows" in verify(0, results.parent)
    content = json.loads(results.read_text())
    true = content["runs"][1]["metrics"]["effort"]
    content["runs"][1]["metrics"]["effort"] = wrong = math.nextafter(true, 1.0)
    (tmp_path / "results.json").write_text(json.dumps(content))
    output = verify(1, "results.json")
    assert f"effort: {wrong} in the file, now {true}" in output
    assert "1 of 2 rows" in output
    content["policies"]["mappo"]["source"] = "0" * 16
    (tmp_path / "results.json").write_text(json.dumps(content))
    output = verify(1, "results.json")
    assert "the file of 'mappo' has changed since the run" in output
    assert "2 more can't be reproduced here" in output


def test_a_task_of_a_file_is_not_executed(results, tmp_path):
    (tmp_path / "evil.py").write_text("open('ran', 'w')")
    content = json.loads(results.read_text())
    content["scenarios"]["starter"]["task"]["name"] = "evil:Task"
    (tmp_path / "results.json").write_text(json.dumps(content))
    assert "not reproducible here: task 'evil:Task' is not part of the package" in verify(1, "results.json")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(("changes", "reason"), [
    ({"policy": "mapo"}, "policy 'mapo' is unknown; did you mean 'mappo'?"),
    ({"set": "nowhere"}, "there is no set 'nowhere' in this version"),
    ({"policy": "evil:Law"}, "policy 'evil:Law' is not part of the package"),
    ({"policy": "runs/best"}, "policy 'runs/best' is not part of the package"),
    ({"policy": "evil:Law,own_clock=true"}, "policy 'evil:Law,own_clock=true' is not part of the package"),
])  # fmt: skip
def test_what_cannot_be_run_here_is_named_and_counts_for_nothing(tmp_path, changes, reason):
    (tmp_path / "evil.py").write_text("open('ran', 'w')")
    output = verify(1, copied(tmp_path, "heldout.csv.gz", N10, **changes))
    assert f"not reproducible here: {reason}" in output
    assert "0 of 0 rows that were run agree in every digit, 0 differ. 1 more can't be reproduced here" in output
    assert not (tmp_path / "ran").exists()


def test_every_kind_of_shipped_row_knows_what_it_is_made_of():
    """One row of each file for every policy, set, axis, vehicle and parameter set that is named there."""
    rows, others = check.find([DOCS])
    assert not others
    assert len({row.file for row in rows}) == 9
    some = {(row.file, key, row.cells[key]): row for row in rows for key in row.kind.keys if key != "seed"}
    for row in {row.where: row for row in some.values()}.values():
        if row.cells.get("training", "") in ("", "0"):
            assert row.kind.source(row.cells).policy, row.where


@pytest.mark.parametrize(("changes", "reason"), [
    ({}, ""),
    ({"learner": "evil:Law"}, "policy 'evil:Law' is not part of the package"),
    ({"learner": "research.blind:Blind,inner=evil:Law"}, "is not part of the package"),
    ({"learner": "other", "training": "0"}, "there is no training '0' of a learner 'other' in this version"),
    ({"learner": "IPPO", "training": "7"}, "no policy of this training is kept"),
    ({"set": "nowhere"}, "there is no set 'nowhere' of task 'hard_water' in this version"),
])  # fmt: skip
def test_rows_of_learners_come_out_again_and_run_nothing_from_elsewhere(tmp_path, changes, reason):
    (row,) = cells.episodes("scout", TASKS["hard_water"].sets[0], range(7000, 7001))
    place = {"task": "hard_water", "learner": "scout", "training": ""}
    write_rows(tmp_path / "learners.csv", [{**place, **row, **changes}])
    assert reason in verify(bool(reason), "learners.csv")


def test_rows_are_drawn_from_each_file_until_so_many_could_be_run(tmp_path):
    (row,) = select(read_rows(DOCS / "paper.csv.gz"), policy="sdc", seed="4")
    write_rows(tmp_path / "one.csv", [row])
    write_rows(tmp_path / "two.csv", [*[row | {"policy": "nobody"}] * 9, row])
    output = verify(0, tmp_path, "--sample", "1", "--seed", "0")
    assert output.count("1 of 1 rows that were run agree in every digit") == 2
    assert "no number of the paper is of 'nobody' in " in output
