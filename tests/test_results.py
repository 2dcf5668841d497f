"""Results on disk: what is refused, what is run again, how they are read, and what the command line says."""

import csv
import errno
import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.processes import ROOT, SETS, quick, refused, succeeds
from tests.swarms import run_of
from uuv_marl import atomic, load_scenario
from uuv_marl.atomic import locked
from uuv_marl.benchmark import load, load_trace, runner
from uuv_marl.benchmark.evaluate import Routes
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.results import Content, PolicyInfo, ResultRow, Results, trace_path
from uuv_marl.benchmark.tables import markdown_table, scenario_table
from uuv_marl.errors import ResultsError
from uuv_marl.tasks.measures import Shares

PAGE = ROOT / "docs" / "benchmark.md"


def made(folder, policies=("idle",), seeds=(0, 1)):
    results = Results(folder, [quick()])
    runner.run_missing(results, [quick()], policies, seeds, lambda *a: None)
    return results


def edit(folder, change):
    path = folder / "results.json"
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def command(policy, output="results/benchmark", seeds=1):
    return "benchmark", f"--seeds={seeds}", f"--policy={policy}", f"--output={output}", *SETS


@pytest.mark.parametrize(("change", "message"), [
    (lambda data: data.update(schema=1), "schema"),
    (lambda data: data.pop("policies"), "policies"),
    (lambda data: data.update(policies={}), "'idle', which is not described"),
    (lambda data: data.update(policies={"idle": {}}), "policies.idle"),
    (lambda data: data["runs"][0]["metrics"].pop("effort"), "runs.0.metrics.effort"),
    (lambda data: data["runs"][0].update(seed="0"), "runs.0.seed"),
    (lambda data: data["versions"].update(numpy="0.0.1"), r"comes from numpy 0\.0\.1, and here is"),
    (lambda data: data["versions"].update(uuv_marl="0.0.1"), r"comes from uuv_marl 0\.0\.1, and here is"),
    (lambda data: data.update(fingerprint="0"), "code 0, and here is"),
])  # fmt: skip
def test_a_file_that_lacks_something_or_comes_from_elsewhere_is_refused_by_its_name(tmp_path, change, message):
    made(tmp_path)
    edit(tmp_path, change)
    with pytest.raises(ResultsError, match=rf"results.json .*{message}.*--output"):
        Results(tmp_path, [quick()])


def test_what_is_no_file_of_results_is_refused(tmp_path):
    path = tmp_path / "results.json"
    path.write_text("{")
    with pytest.raises(ResultsError, match="can't be read"):
        Results(tmp_path, [quick()])
    with pytest.raises(ResultsError, match="can't be written"):
        Results(path / "below", [quick()])
    path.unlink()
    path.mkdir()
    with pytest.raises(ResultsError, match=r"can't be read \(Is a directory\)"):
        Results(tmp_path, [quick()])


def test_results_of_another_task_of_the_user_s_are_refused(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "my_task.py"
    file.write_text("from uuv_marl.tasks import Follow\n\n\nclass Mine(Follow):\n    pass\n")
    scenario = load_scenario("starter", overrides={"task": "my_task:Mine"})
    Results(tmp_path / "out", [scenario]).add("starter", "idle", run_of("idle", quick()))
    assert Results(tmp_path / "out", [scenario]).has("starter", "idle", 0)
    assert Results(tmp_path / "out", [quick()]).has("starter", "idle", 0)
    file.write_text(file.read_text() + "# other\n")
    with pytest.raises(ResultsError, match=r"comes from my_task:Mine \w+, and here is \w+; move it away"):
        Results(tmp_path / "out", [scenario])


def test_a_policy_that_nobody_asked_for_is_not_imported(tmp_path, monkeypatch):
    folder = tmp_path / "out"
    made(folder)
    (tmp_path / "notes.py").write_text("open('ran', 'w').write('it ran')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")

    def foreign(data):
        described = data["policies"]["idle"] | {"source": "0123456789abcdef"}
        data["policies"] |= {"notes:X": described, "runs/gone/best": described}
        data["runs"] += [data["runs"][0] | {"policy": "notes:X"}]
        trace = trace_path(folder, "single_obstacle", "notes:X", 0)
        trace.symlink_to(trace_path(folder, "single_obstacle", "idle", 0).resolve())

    edit(folder, foreign)
    assert "notes:X" in succeeds(*command("idle", folder))
    assert not (tmp_path / "ran").exists()
    assert "notes" not in sys.modules


def test_the_current_folder_comes_last_and_only_for_modules(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = list(sys.path)
    succeeds(*command("idle"))
    assert sys.path == before
    refused("can't be imported", *command("nowhere:Thing"))
    assert sys.path == [*before, ""]


def test_a_broken_trace_is_explained_and_run_again(tmp_path):
    results = made(tmp_path)
    path = results.trace_path("single_obstacle", "idle", 1)
    whole = path.read_bytes()
    for broken in (b"", whole[: len(whole) // 2], b"no zip"):
        path.write_bytes(broken)
        with pytest.raises(ResultsError, match=rf"{re.escape(str(path))} can't be read .*; delete it"):
            load_trace(path)
        again = Results(tmp_path, [quick()])
        assert again.has("single_obstacle", "idle", 0)
        assert not again.has("single_obstacle", "idle", 1)
        assert [row.seed for row in again.select("single_obstacle", "idle", (0, 1))] == [0, 1]  # no other run drops it
    made(tmp_path)
    np.testing.assert_array_equal(load_trace(path)["time_s"], results.trace("single_obstacle", "idle", 1)["time_s"])
    path.write_bytes(whole[:400] + bytes(200) + whole[600:])  # whole to look at, and broken inside
    with pytest.raises(ResultsError, match="can't be read"):
        load_trace(path)
    path.unlink()
    with pytest.raises(ResultsError, match="can't be read"):
        load_trace(path)


def test_a_trace_has_a_name_that_file_systems_take():
    long = "/home/" + "somebody/" * 40 + "best"
    names = {trace_path(Path("x"), "tracking", policy, seed).name for policy in (long, long + "2") for seed in (1, 2)}
    assert len(names) == 4
    assert max(len(name.encode()) for name in names) < 240
    assert trace_path(Path("x"), "tracking", "sff", 3).name == "tracking.sff.3.npz"
    assert trace_path(Path("x"), "tracking", "a:b", 3) != trace_path(Path("x"), "tracking", "a-b", 3)


def test_a_bar_in_a_cell_stays_in_its_cell():
    assert markdown_table(["a", "b"], [["x|y", "z"]]) == "| a | b |\n| --- | --- |\n| x\\|y | z |\n"


USERS = """
import numpy as np
from uuv_marl.baselines import Policy

class Misspelt(Policy):
    def decide(self, percept):
        return self.towards(percept)

    def towards(self, percept):
        return percept["refrence"]

class Nan(Policy):
    def decide(self, percept):
        return np.full((*percept["velocity"].shape[:2], 2), np.nan, np.float32)
"""


@pytest.mark.parametrize(("name", "messages"), [
    ("Misspelt", ["KeyError", "refrence", "users_own.py:7, in decide", "users_own.py:10, in towards"]),
    ("Nan", ["policy 'users_own:Nan'", "action", "finite"]),
])  # fmt: skip
def test_an_error_in_a_users_policy_shows_the_users_lines_alone(tmp_path, monkeypatch, name, messages):
    (tmp_path / "users_own.py").write_text(USERS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    text = refused(messages[0], *command(f"users_own:{name}"))
    sys.modules.pop("users_own", None)
    assert "Traceback" not in text
    assert "evaluate.py" not in text
    assert len(text) < 1500
    for message in messages:
        assert message in text


def test_a_second_command_in_a_folder_is_refused(tmp_path):
    with locked(tmp_path):
        refused(f"is in use by process {os.getpid()} on", *command("idle", tmp_path))
    assert not (tmp_path / "results.json").exists()
    succeeds(*command("idle", tmp_path))


@pytest.mark.parametrize("writes", [2, 3, 4, 5, 6])
def test_a_full_disk_loses_nothing(tmp_path, monkeypatch, writes):
    """Each write of the command is the first that fails: of the lock's owner, a trace, results.json, table.md."""
    count = iter(range(1000))

    def fsync(file):
        if next(count) >= writes - 1:
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(atomic.os, "fsync", fsync)
        text = refused("can't be written (No space left on device)", *command("idle", tmp_path, 2))
    assert "What was finished before is safe" in text
    assert "Traceback" not in text
    assert not list(tmp_path.rglob("*.partial*"))
    succeeds(*command("idle", tmp_path, 2))
    made(tmp_path / "uninterrupted")
    folders = tmp_path / "uninterrupted", tmp_path
    expected, here = (json.loads((folder / "results.json").read_text())["runs"] for folder in folders)
    assert here == expected


def test_results_are_read_as_a_data_frame(tmp_path):
    pytest.importorskip("pandas")
    made(tmp_path, ["random", "idle"])
    frame = load(tmp_path)
    assert list(frame["policy"]) == ["idle", "idle", "random", "random"]
    assert list(frame["seed"]) == [0, 1, 0, 1]
    assert list(frame.columns[:3]) == ["scenario", "policy", "seed"]
    assert not frame.columns.str.contains("^constraint_share$").any()
    runs = json.loads((tmp_path / "results.json").read_text())["runs"]
    assert frame["constraint_share_s_u"][0] == runs[0]["metrics"]["constraint_share"]["s_u"]
    assert frame["effort"][3] == runs[3]["metrics"]["effort"]
    assert frame["task_time_s"].isna().all()
    assert frame["task_time_s"].dtype == float
    assert load_trace(frame["trace"][2])["min_spacing_m"].min() == np.float32(frame["min_spacing_m"][2])
    assert load(tmp_path / "results.json").equals(frame)
    content = json.loads((tmp_path / "results.json").read_text())
    for run in content["runs"]:
        run["metrics"]["task"] = {"effort": 2.0, "found": None}
    (tmp_path / "results.json").write_text(json.dumps(content))
    own = load(tmp_path)
    assert own["effort"].equals(frame["effort"])
    assert list(own["task_effort"]) == [2.0] * 4
    assert own["found"].isna().all()
    frame.to_csv(tmp_path / "runs.csv", index=False)
    with (tmp_path / "runs.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 4


def test_a_row_names_the_index_that_a_policy_acts_by(tmp_path):
    scenario, policies = quick("silent_targets"), ["nearest_target", "nearest_target,lanes=true"]
    results = Results(tmp_path, [scenario], traces=False)
    runner.run_missing(results, [scenario], policies, [0], lambda *a: None)
    rows = scenario_table(results, scenario, policies, [0]).rows
    assert [row["class, and extra observations"] for row in rows] == ["–", "identity"]


def keys(title):
    """First cells of the tables below a heading of the page."""
    section = PAGE.read_text().partition(f"# {title}\n")[2]
    section = re.split(r"^#", section, maxsplit=1, flags=re.M)[0]
    return set(re.findall(r"^\| `([^`]+)` \|", section, flags=re.M))


def test_the_page_of_the_format_has_every_key_and_array(tmp_path):
    results = made(tmp_path)
    assert keys("`results.json`") == set(Content.__annotations__) - {"__pydantic_config__"}
    assert keys("A policy") == set(PolicyInfo.__annotations__)
    assert keys("A run") == set(ResultRow._fields)
    assert keys("Metrics") == set(Metrics.__annotations__) == {*results.rows[0].metrics, "task"}  # follow has none
    assert set(Shares.__annotations__) == set(results.rows[0].metrics["constraint_share"])
    for share in Shares.__annotations__:
        assert f"`{share}`" in PAGE.read_text()
    routes = {f"route_{name}" for name in Routes._fields}
    series = set(results.trace("single_obstacle", "idle", 1))
    assert keys("`traces/*.npz`") == series | routes
    assert set(results.trace("single_obstacle", "idle", 0)) == series | routes
    assert set(json.loads((tmp_path / "results.json").read_text())) == keys("`results.json`")
