"""Results on disk: what is refused, what is run again, how they are read, and what the command line says."""

import csv
import errno
import io
import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner

from uuv_marl import atomic, load_scenario
from uuv_marl.atomic import locked
from uuv_marl.benchmark import load, load_trace, runner
from uuv_marl.benchmark.evaluate import Routes
from uuv_marl.benchmark.metrics import Metrics, Sample, Shares
from uuv_marl.benchmark.results import Content, Knowledge, ResultRow, Results, trace_path
from uuv_marl.benchmark.tables import TableRow, markdown_table, rich_table, table_rows
from uuv_marl.cli import app
from uuv_marl.errors import MissingExtraError, ResultsError

QUICK = {"time_limit.factor": 0.01, "time_limit.extra_s": 2.0, "swarm.num_vehicles": 5}
PAGE = Path(__file__).resolve().parent.parent / "docs" / "results-format.md"


def quick(name="single_obstacle"):
    return load_scenario(name, overrides=QUICK)


def made(folder, policies=("idle",), seeds=(0, 1)):
    results = Results(folder, [quick()])
    runner.run_missing(results, [quick()], policies, seeds, lambda *a: None)
    return results


def edit(folder, change):
    path = folder / "results.json"
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def command(*arguments, output=None):
    sets = [f"--set={field}={value}" for field, value in QUICK.items()]
    where = [] if output is None else [f"--output={output}"]
    done = CliRunner().invoke(app, ["benchmark", *arguments, *where, *sets])
    return done, " ".join(done.output.split())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.update(schema=2), "schema"),
        (lambda data: data.pop("schema"), "schema"),
        (lambda data: data.pop("policies"), "policies"),
        (lambda data: data.pop("versions"), "versions"),
        (lambda data: data.update(scenarios=None), "scenarios"),
        (lambda data: data.update(policies={}), "'idle', which is not described"),
        (lambda data: data.update(policies={"idle": {}}), "policies.idle"),
        (lambda data: data["runs"][0]["metrics"].pop("effort"), "runs.0.metrics.effort"),
        (lambda data: data["runs"][0]["metrics"].update(collisions=None), "runs.0.metrics.collisions"),
        (lambda data: data["runs"][0].update(seed="0"), "runs.0.seed"),
        (lambda data: data["runs"][0].update(metrics=None), "runs.0.metrics"),
    ],
)
def test_a_file_that_lacks_something_is_refused_by_the_name_of_the_field(tmp_path, change, message):
    made(tmp_path)
    edit(tmp_path, change)
    with pytest.raises(ResultsError, match=rf"results.json can't be read \(.*{message}.*--output"):
        Results(tmp_path, [quick()])


def test_a_folder_in_the_place_of_the_file_is_refused(tmp_path):
    (tmp_path / "results.json").mkdir()
    with pytest.raises(ResultsError, match=r"can't be read \(Is a directory\)"):
        Results(tmp_path, [quick()])


@pytest.mark.parametrize("library", ["numpy", "numba", "scipy", "uuv_marl"])
def test_results_of_other_versions_are_refused(tmp_path, library):
    made(tmp_path)
    edit(tmp_path, lambda data: data["versions"].update({library: "0.0.1"}))
    with pytest.raises(ResultsError, match=rf"comes from {library} 0\.0\.1, and here is"):
        Results(tmp_path, [quick()])


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
    done, text = command("--policy=idle", "--seeds=1", output=folder)
    assert done.exit_code == 0, text
    assert "notes:X" in text
    assert not (tmp_path / "ran").exists()
    assert "notes" not in sys.modules


def test_the_current_folder_comes_last_and_only_for_modules(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = list(sys.path)
    assert command("--policy=idle", "--seeds=1")[0].exit_code == 0
    assert sys.path == before
    command("--policy=nowhere:Thing")
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


def test_runs_are_sorted_whatever_the_order_in_which_they_came(tmp_path):
    made(tmp_path, ["random"], [1])
    made(tmp_path, ["idle"], [1, 0])
    made(tmp_path, ["random"], [0])
    runs = json.loads((tmp_path / "results.json").read_text())["runs"]
    assert [(run["policy"], run["seed"]) for run in runs] == [("idle", 0), ("idle", 1), ("random", 0), ("random", 1)]
    made(tmp_path / "straight", ["idle", "random"], [0, 1])
    straight = json.loads((tmp_path / "straight" / "results.json").read_text())
    assert straight["runs"] == runs


def test_a_policy_that_has_changed_is_run_again_if_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    own = "from uuv_marl.baselines.random_idle import Idle\n\nclass Own(Idle):\n    pass\n"
    (tmp_path / "own_policy.py").write_text(own)
    wanted = "--policy=idle", "--policy=own_policy:Own", "--seeds=2"
    assert command(*wanted, output=tmp_path)[0].exit_code == 0
    (tmp_path / "own_policy.py").write_text(own + "# changed\n")
    done, text = command(*wanted, output=tmp_path)
    assert done.exit_code == 2
    assert "give --anew to drop those runs" in text
    done, text = command(*wanted, "--anew", output=tmp_path)
    assert done.exit_code == 0, text
    assert command(*wanted, output=tmp_path)[0].exit_code == 0
    assert Results(tmp_path, [quick()]).has("single_obstacle", "idle", 1), "the others' runs are kept"


def test_the_report_shows_all_that_the_results_hold(tmp_path):
    assert command("--policy=random", "--seeds=2", output=tmp_path)[0].exit_code == 0
    done, text = command("--policy=idle", "--seeds=2", output=tmp_path)
    assert done.exit_code == 0
    table = (tmp_path / "table.md").read_text()
    for policy in ("idle", "random"):
        assert f"| {policy} |" in table
        assert policy in text
    assert "Next:" in text
    assert "2 seeds" in text
    before = table
    assert command("--policy=random", "--seeds=2", output=tmp_path)[0].exit_code == 0
    assert (tmp_path / "table.md").read_text() == before
    assert command("--policy=random", "--seeds=1", output=tmp_path)[0].exit_code == 0
    assert ", 1 seed, " in (tmp_path / "table.md").read_text()


DEFAULT = [*runner.DEFAULT_POLICIES, "my_policies:Ahead"]


def cells(policy):
    return TableRow(
        policy, "compass, link, yaw damping 600 N m s", "20/20", "204.3 [203.9, 204.8]", "206.1",
        "13.81 [13.40, 14.02]", "11.20", "9.93 [9.81, 10.02]", "8.90", "11.21 [11.10, 11.31]",
        "s_l 100%, s_o 100%, s_u 100%", "18 in 11 seeds", "205 s, 10.48-12.63 m",
    )  # fmt: skip


@pytest.mark.parametrize("width", [80, 100, 112, 130, 200])
def test_the_table_can_be_read_at_any_width(width):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(rich_table("x", [cells(policy) for policy in DEFAULT], width))
    text = console.export_text()
    for policy in DEFAULT:
        assert re.search(rf"│ *{policy} *│", text), policy
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    for number in ("20/20", "204.3", "206.1", "13.81", "11.20", "9.93", "8.90"):
        assert text.count(number) >= len(DEFAULT), number
    assert ("[203.9," in text) == (width >= 110)


def test_few_seeds_have_no_interval(tmp_path):
    results = made(tmp_path, seeds=range(5))
    few, enough = (table_rows(results, "single_obstacle", ["idle"], range(count))[0] for count in (4, 5))
    assert "[" not in few.distance + few.spacing + few.mean
    assert "[" in enough.distance
    assert few.arrived == "0/4"


def test_a_bar_in_a_cell_stays_in_its_cell():
    assert markdown_table(["a", "b"], [["x|y", "z"]]) == "| a | b |\n| --- | --- |\n| x\\|y | z |\n"


def every_command(group=None, path=()):
    group = group or typer.main.get_command(app)
    for name, one in getattr(group, "commands", {}).items():
        yield from every_command(one, (*path, name))
    yield pytest.param(path, group, id=" ".join(path) or "uuv-marl")


@pytest.mark.parametrize(("path", "one"), list(every_command()))
def test_help_prints_every_word_of_its_texts(path, one):
    wide = {"COLUMNS": "10000", "TERMINAL_WIDTH": "10000"}
    shown = CliRunner().invoke(app, [*path, "-h"], env=wide)
    assert shown.exit_code == 0
    assert shown.output == CliRunner().invoke(app, [*path, "--help"], env=wide).output
    texts = [one.help or "", *(getattr(parameter, "help", "") or "" for parameter in one.params)]
    for word in " ".join(texts).replace("`", "").split():
        assert word in shown.output, word


USERS = """
import numpy as np
from uuv_marl.baselines import Policy

class Misspelt(Policy):
    def decide(self, percept):
        return self.towards(percept)

    def towards(self, percept):
        return percept["refrence"]

class Shaped(Policy):
    def decide(self, percept):
        return np.zeros((1, 2), np.float32)

class Nan(Policy):
    def decide(self, percept):
        return np.full((*percept["velocity"].shape[:2], 2), np.nan, np.float32)

class Unmakeable(Policy):
    def __init__(self, scenario, num_worlds=1):
        super().__init__(scenario, num_worlds)
        raise OverflowError("too much")

    def decide(self, percept):
        pass
"""


@pytest.mark.parametrize(
    ("name", "messages"),
    [
        ("Misspelt", ["KeyError", "refrence", "users_own.py:7, in decide", "users_own.py:10, in towards"]),
        ("Shaped", ["policy 'users_own:Shaped'", "action", "shape"]),
        ("Nan", ["policy 'users_own:Nan'", "action", "finite"]),
        ("Unmakeable", ["OverflowError: too much", "users_own.py:23, in __init__"]),
    ],
)
def test_an_error_in_a_users_policy_shows_the_users_lines_alone(tmp_path, monkeypatch, name, messages):
    (tmp_path / "users_own.py").write_text(USERS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    done, text = command(f"--policy=users_own:{name}", "--seeds=1")
    sys.modules.pop("users_own", None)
    assert done.exit_code == 2
    assert "Traceback" not in text
    assert "evaluate.py" not in text
    assert len(done.output.splitlines()) < 20
    for message in messages:
        assert message in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["benchmark", "--policy=:"], "policy ':' can't be imported"),
        (["tune", "--output=/dev/null"], "/dev/null can't be written"),
        (["robustness", "--output=/dev/null/below"], "/dev/null/below can't be written"),
    ],
)
def test_mistakes_are_explained(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, arguments)
    assert message in " ".join(done.output.split())
    assert done.exit_code == 2


def test_a_second_command_in_a_folder_is_refused(tmp_path):
    with locked(tmp_path):
        done, text = command("--policy=idle", "--seeds=1", output=tmp_path)
    assert done.exit_code == 2
    assert f"is in use by process {os.getpid()} on" in text
    assert not (tmp_path / "results.json").exists()
    assert command("--policy=idle", "--seeds=1", output=tmp_path)[0].exit_code == 0


@pytest.mark.parametrize("writes", [2, 3, 4, 5, 6])
def test_a_full_disk_loses_nothing(tmp_path, monkeypatch, writes):
    """Each write of the command is the first that fails: of the lock's owner, a trace, results.json, table.md."""
    count = iter(range(1000))

    def fsync(file):
        if next(count) >= writes - 1:
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(atomic.os, "fsync", fsync)
        done, text = command("--policy=idle", "--seeds=2", output=tmp_path)
    assert done.exit_code == 2
    assert "can't be written (No space left on device)" in text
    assert "What was finished before is safe" in text
    assert "Traceback" not in text
    assert not list(tmp_path.rglob("*.partial*"))
    done, text = command("--policy=idle", "--seeds=2", output=tmp_path)
    assert done.exit_code == 0, text
    made(tmp_path / "whole")
    whole, here = (
        json.loads((folder / "results.json").read_text())["runs"] for folder in (tmp_path / "whole", tmp_path)
    )
    assert here == whole


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
    assert load_trace(frame["trace"][2])["min_spacing_m"].min() == np.float32(frame["min_spacing_m"][2])
    assert load(tmp_path / "results.json").equals(frame)
    frame.to_csv(tmp_path / "runs.csv", index=False)
    with (tmp_path / "runs.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 4


def test_without_pandas_the_extra_is_named(tmp_path, monkeypatch):
    made(tmp_path)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"pandas.*pip install 'uuv_marl\[analysis\]'"):
        load(tmp_path)


def keys(title):
    """First cells of the tables below a heading of the page."""
    section = PAGE.read_text().partition(f"# {title}\n")[2]
    section = re.split(r"^#", section, maxsplit=1, flags=re.M)[0]
    return set(re.findall(r"^\| `([^`]+)` \|", section, flags=re.M))


def test_the_page_of_the_format_has_every_key_and_array(tmp_path):
    results = made(tmp_path)
    assert keys("`results.json`") == set(Content.__annotations__) - {"__pydantic_config__"}
    assert keys("A policy") == set(Knowledge.__annotations__)
    assert keys("A run") == set(ResultRow._fields)
    assert keys("Metrics") == set(Metrics.__annotations__) == set(results.rows[0].metrics)
    assert set(Shares.__annotations__) == set(results.rows[0].metrics["constraint_share"])
    for share in Shares.__annotations__:
        assert f"`{share}`" in PAGE.read_text()
    routes = {f"route_{name}" for name in Routes._fields}
    series = {*Sample._fields, "obstacle_distance_m", "obstacles", "waypoints"}
    assert keys("`traces/*.npz`") == series | routes
    assert set(results.trace("single_obstacle", "idle", 0)) == series | routes
    assert set(results.trace("single_obstacle", "idle", 1)) == series
    assert set(json.loads((tmp_path / "results.json").read_text())) == keys("`results.json`")


def test_the_pages_example_runs(tmp_path, monkeypatch, capsys):
    pytest.importorskip("pandas")
    made(tmp_path / "results" / "benchmark")
    monkeypatch.chdir(tmp_path)
    (example,) = re.findall(r"```py\n(.*?)```", PAGE.read_text(), flags=re.S)
    exec(example, {})
    assert "idle" in capsys.readouterr().out
