"""Metrics, resumable results, tables, pictures and the command line."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.baselines import granted
from uuv_marl.benchmark import runner
from uuv_marl.benchmark.evaluate import Progress, Run, evaluate
from uuv_marl.benchmark.results import Results, ResultsError
from uuv_marl.benchmark.tables import CAPTION, HEADERS, estimate, markdown_table, table_rows
from uuv_marl.cli import app

QUICK = {"time_limit.factor": 0.02, "time_limit.extra_s": 5.0, "swarm.num_vehicles": 8}
SETS = [f"--set={field}={value}" for field, value in QUICK.items()]


def quick(name="single_obstacle"):
    return load_scenario(name, overrides=QUICK)


def runs_of(scenario, policy, seeds):
    return {run.seed: run for run in evaluate(granted(policy, scenario), policy, seeds) if isinstance(run, Run)}


def test_seeds_may_be_numpys(tmp_path):
    scenario = quick("starter")
    results = Results(tmp_path, [scenario])
    for run in evaluate(scenario, "idle", np.arange(2)):
        if isinstance(run, Run):
            results.add("starter", "idle", run)
    assert [row.seed for row in Results(tmp_path, [scenario]).rows] == [0, 1]


def test_metrics_are_those_of_the_series(monkeypatch):
    monkeypatch.setattr("uuv_marl.benchmark.evaluate.ROUTE_PERIOD_S", 0.1)
    run = runs_of(load_scenario("single_obstacle"), "bio_inspired", [4])[4]
    series, metrics = run.series, run.metrics
    assert metrics["min_spacing_m"] == pytest.approx(series["min_spacing_m"].min())
    assert metrics["mean_min_spacing_m"] == pytest.approx(series["min_spacing_m"].mean(), rel=1e-5)
    assert metrics["max_spacing_m"] == pytest.approx(series["max_spacing_m"].max())
    assert metrics["min_obstacle_distance_m"] == pytest.approx(series["obstacle_distance_m"].min())
    # Independently, from the routes alone.
    position = run.routes.position
    away = np.hypot(*(position - 350.0).transpose(2, 0, 1)) - 25.0
    assert metrics["min_obstacle_distance_m"] == pytest.approx(away.min(), abs=1e-3)
    pairs = np.hypot(*(position[:, :, None] - position[:, None]).transpose(3, 0, 1, 2))
    pairs[:, np.arange(54), np.arange(54)] = np.inf
    np.testing.assert_allclose(series["min_spacing_m"], pairs.min(axis=(1, 2)), atol=1e-3)
    centre = position.mean(axis=1)
    arrived = np.hypot(*(centre[-51:] - 600.0).T)
    assert (arrived <= 2.0 + 1e-3).all()
    assert series["time_s"][-1] == pytest.approx(metrics["task_time_s"] + 5.0, abs=1e-3)
    assert set(metrics["constraint_share"]) == {"all", "s_l", "s_o", "s_u"}
    assert metrics["vehicles_lost"] == 0


def test_a_run_does_not_depend_on_the_seeds_beside_it():
    scenario = quick("random_field")
    alone, together = runs_of(scenario, "bio_inspired", [3]), runs_of(scenario, "bio_inspired", list(range(40)))
    assert alone[3].metrics == together[3].metrics
    assert sorted(together) == list(range(40))


def test_routes_show_the_motion():
    run = runs_of(load_scenario("single_obstacle"), "bio_inspired_plus", [3])[3]
    routes = run.routes
    np.testing.assert_allclose(np.diff(routes.time_s)[:-1], 0.5, atol=1e-4)
    assert routes.time_s[-1] == run.series["time_s"][-1]
    # At the start a vehicle only surges, at 0 to 4 m/s.
    bow = np.stack([np.cos(routes.heading[0]), np.sin(routes.heading[0])], axis=1)
    surge = (routes.velocity[0] * bow).sum(axis=1)
    assert surge.min() >= 0.0
    assert surge.max() <= 4.0
    np.testing.assert_allclose(routes.velocity[0], surge[:, None] * bow, atol=1e-5)
    # Velocity is the rate of the position.
    middle = (routes.velocity[1:] + routes.velocity[:-1])[:-1] / 2
    off = np.abs(np.diff(routes.position, axis=0)[:-1] / 0.5 - middle)
    assert off.mean() < 0.1


def test_long_routes_are_thinned_in_time_and_keep_start_and_end(monkeypatch):
    whole = runs_of(quick(), "idle", [3])[3]
    times = len(whole.routes.time_s)
    monkeypatch.setattr("uuv_marl.benchmark.evaluate.MOST_SAMPLES", times * 8 // 4)
    thin = runs_of(quick(), "idle", [3])[3]
    for name, values in whole.routes._asdict().items():
        few = getattr(thin.routes, name)
        np.testing.assert_array_equal(few[[0, -1]], values[[0, -1]])
        assert len(few) < times / 2
    assert thin.metrics == whole.metrics


def test_never_arriving_and_no_obstacles_are_null():
    metrics = runs_of(quick("tracking"), "idle", [0])[0].metrics
    assert metrics["task_time_s"] is None
    assert metrics["min_obstacle_distance_m"] is None
    json.dumps(metrics, allow_nan=False)


def test_a_swarm_that_is_lost_keeps_no_constraint():
    close = {"contact.ends_vehicle": True, "contact.hull_radius_m": 6.0, "constraints.s_l_m": 5000.0}
    scenario = load_scenario("tracking", overrides={**QUICK, **close, "swarm.num_vehicles": 40})
    for metrics in (run.metrics for run in runs_of(scenario, "random", [0, 1, 2]).values()):
        json.dumps(metrics, allow_nan=False)
        if metrics["vehicles_lost"] == 40:
            assert metrics["constraint_share"]["s_l"] < 1.0


def test_progress_rises_to_the_end():
    shares = [e.share for e in evaluate(quick(), "idle", list(range(40))) if isinstance(e, Progress)]
    assert shares == sorted(shares)
    assert 0 < shares[0] < shares[-1] <= 1


def test_the_estimate_is_the_interquartile_mean_with_its_interval():
    e = estimate([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 1000.0])
    assert e.iqm == 4.5
    assert e.low < e.iqm < e.high
    assert estimate([3.0, 3.0, 3.0]) == (3.0, 3.0, 3.0)
    assert estimate([2.0]) == (2.0, 2.0, 2.0)
    assert estimate([1.0, 2.0, 3.0, 4.0]) == estimate([1.0, 2.0, 3.0, 4.0])


def test_results_go_on_where_they_stopped(tmp_path):
    scenario = quick()
    results = Results(tmp_path, [scenario])
    seen = []

    def stop_after_three(name, policy, share):
        seen.append(len(results.rows))
        if len(results.rows) >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runner.run_missing(results, [scenario], ["idle", "bio_inspired"], [0, 1], stop_after_three)
    data = json.loads((tmp_path / "results.json").read_text())
    assert len(data["runs"]) == 3
    again = Results(tmp_path, [scenario])
    ran = []
    runner.run_missing(again, [scenario], ["idle", "bio_inspired"], [0, 1], lambda *a: ran.append(a))
    assert len(again.rows) == 4
    whole = Results(tmp_path / "whole", [scenario])
    runner.run_missing(whole, [scenario], ["idle", "bio_inspired"], [0, 1], lambda *a: None)
    assert sorted(map(str, whole.rows)) == sorted(map(str, again.rows))
    assert set(data) == {"schema", "fingerprint", "versions", "machine", "scenarios", "policies", "runs"}
    assert set(data["runs"][0]) == {"scenario", "policy", "seed", "metrics"}


def test_results_of_something_else_are_refused(tmp_path):
    results = Results(tmp_path, [quick()])
    runner.run_missing(results, [quick()], ["idle"], [0], lambda *a: None)
    other = load_scenario(quick(), overrides={"constraints.s_o_m": 6.0})
    with pytest.raises(ResultsError, match=r"another 'single_obstacle'.*--output"):
        Results(tmp_path, [other])
    between = Results(tmp_path, [quick("tracking")])  # another scenario in the same folder forgets nothing
    runner.run_missing(between, [quick("tracking")], ["idle"], [0], lambda *a: None)
    with pytest.raises(ResultsError, match="another 'single_obstacle'"):
        Results(tmp_path, [other])
    with pytest.raises(ResultsError, match="can't be written"):
        Results(tmp_path / "results.json" / "below", [quick()])
    path = tmp_path / "results.json"
    path.write_text(path.read_text().replace('"fingerprint": "', '"fingerprint": "0'))
    with pytest.raises(ResultsError, match="other code"):
        Results(tmp_path, [quick()])
    path.write_text("{")
    with pytest.raises(ResultsError, match="can't be read"):
        Results(tmp_path, [quick()])


OWN_POLICY = """
import numpy as np
from uuv_marl.baselines import Policy

class Ahead(Policy):
    def decide(self, percept):
        reference = percept["reference"]
        return (reference / np.maximum(np.hypot(*np.moveaxis(reference, -1, 0)), 1e-6)[..., None]).astype(np.float32)
"""


def test_your_own_policy_stands_in_the_table(tmp_path, monkeypatch):
    (tmp_path / "my_policies.py").write_text(OWN_POLICY)
    monkeypatch.chdir(tmp_path)
    arguments = ["benchmark", "--policy=my_policies:Ahead", "--seeds=2", "--output=out", *SETS]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "my_policies:Ahead" in (tmp_path / "out" / "table.md").read_text()
    assert CliRunner().invoke(app, arguments).exit_code == 0
    for trace in (tmp_path / "out" / "traces").glob("*.1.npz"):
        trace.unlink()
    assert CliRunner().invoke(app, arguments).exit_code == 0  # a run without its trace is run again
    (tmp_path / "my_policies.py").write_text(OWN_POLICY + "\n# changed\n")
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert "before its file changed" in " ".join(done.output.split())


def test_the_table_says_what_was_changed_and_then_leaves_the_paper_out():
    assert "CHANGED" not in runner.title(load_scenario("single_obstacle"), [0])
    changed = load_scenario("single_obstacle", overrides={"obstacles": [], "vehicle.m_kg": 190.0})
    text = runner.title(changed, [0])
    assert "vehicle.m_kg=190.0" in text
    assert "obstacles=[]" in text


def test_the_table_shows_the_paper_and_what_each_policy_knows(tmp_path, monkeypatch):
    scenario = load_scenario("single_obstacle", overrides={"time_limit.factor": 0.02, "time_limit.extra_s": 5.0})
    monkeypatch.setattr("uuv_marl.benchmark.tables.differences", lambda scenario: [])
    results = Results(tmp_path, [scenario])
    policies = ["bio_inspired", "sdc", "idle"]
    runner.run_missing(results, [scenario], policies, [0, 1], lambda *a: None)
    rows = table_rows(results, scenario.name, policies, [0, 1])
    text = markdown_table(HEADERS, rows)
    assert [len(row) for row in rows] == [len(HEADERS)] * 3
    assert "205 s, 10.48-12.63 m" in text
    assert "206 s, 4.2 m" in text
    assert "compass, link, yaw damping 600 N m s" in text
    assert "0/2" in text
    assert "reconstructions" in CAPTION


def test_the_command_line_from_end_to_end(tmp_path):
    arguments = ["benchmark", "--scenario=lossy", "--scenario=tracking", "--policy=bio_inspired", "--policy=random"]
    arguments += ["--seeds=3", f"--output={tmp_path}", *SETS, "--set=disturbance.loss_times_s=[1.0, 2.0]"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "bio_inspired" in done.output
    assert "task time [s]" in done.output  # brackets are not markup
    data = json.loads((tmp_path / "results.json").read_text())
    assert {(r["scenario"], r["policy"], r["seed"]) for r in data["runs"]} == {
        (s, p, k) for s in ("lossy", "tracking") for p in ("bio_inspired", "random") for k in range(3)
    }
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    assert names == {
        "lossy_routes.png", "lossy_obstacle_distance.png", "lossy_spacing.png", "tracking_routes.png",
        "tracking_spacing.png",
    }  # fmt: skip
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in (tmp_path / "figures").iterdir())
    assert "| policy |" in (tmp_path / "table.md").read_text()
    before = (tmp_path / "results.json").read_bytes()
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert (tmp_path / "results.json").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["benchmark", "--scenario=singel_obstacle"], "did you mean"),
        (["benchmark", "--policy=bio"], "did you mean"),
        (["benchmark", "--set=vehicle.m_kg=-1"], "vehicle.m_kg must lie within 0.001 to 1,000,000"),
        (["benchmark", "--set=vehicle"], "must look like field=value"),
        (["list", "--show=trackin"], "did you mean"),
        (["list", "policies", "--show=sff"], "a policy has no file"),
        (["benchmark", "--set=actuators.yaw_damping_nms=600"], "every policy has its own"),
        (["benchmark", "--scenario=tracking", "--scenario=tracking"], "different names"),
        (["benchmark", "--policy=nowhere:Thing"], "can't be imported"),
        (["benchmark", "--policy=math:pi"], "must be a subclass"),
        (["benchmark", "--set=name=../up"], "name must hold letters"),
        (["tune", "--policy=idle"], "no free gains"),
    ],
)
def test_mistakes_are_explained_without_a_traceback(arguments, message, tmp_path):
    done = CliRunner().invoke(app, [*arguments, *([f"--output={tmp_path}"] if arguments[0] == "benchmark" else [])])
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())
    assert "Traceback" not in done.output


def test_lists_and_help():
    for arguments in (
        ["--help"],
        ["benchmark", "--help"],
        ["list"],
        ["list", "policies"],
        ["--version"],
        ["tune", "--help"],
    ):
        assert CliRunner().invoke(app, arguments).exit_code == 0
    shown = CliRunner().invoke(app, ["list", "--show", "random_field"]).output
    assert "Repoulias" in shown
    assert "[random_field]" in shown


@pytest.mark.needs("optuna")
def test_a_search_is_resumed_and_repeats_itself(tmp_path, monkeypatch):
    from uuv_marl.benchmark import tuning

    monkeypatch.setattr(tuning, "SEEDS", (10_000,))
    monkeypatch.setattr("uuv_marl.scenario.load_scenario", lambda *a, **k: quick())
    optuna = pytest.importorskip("optuna")
    before = optuna.logging.get_verbosity()
    for folder, stops in (("whole", [5]), ("parts", [2, 5])):
        for trials in stops:
            tuning.tune("bio_inspired_plus", tmp_path / folder, trials, lambda *a: None)
    assert optuna.logging.get_verbosity() == before
    for name in ("bio_inspired_plus.json", "bio_inspired_plus.csv"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()
    assert len((tmp_path / "whole" / "bio_inspired_plus.csv").read_text().splitlines()) == 6
