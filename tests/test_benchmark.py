"""Metrics, resumable results, tables, pictures and the command line."""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from tests.processes import SETS, quick, refused, succeeds
from tests.swarms import run_of
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.baselines.safety import Barrier
from uuv_marl.benchmark import runner
from uuv_marl.benchmark.estimates import estimate
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.results import PolicyInfo, Results, ResultsError
from uuv_marl.benchmark.tables import scenario_table, terminal_table
from uuv_marl.errors import PolicyError


def test_metrics_are_those_of_the_series(monkeypatch):
    monkeypatch.setattr("uuv_marl.benchmark.evaluate.ROUTE_PERIOD_S", 0.1)
    run = run_of("bio_inspired", "single_obstacle", seed=4)
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
    alone, together = (evaluate("bio_inspired", quick("random_field"), seeds) for seeds in ([3], range(40)))
    assert alone == [together[3]]
    assert [run["seed"] for run in together] == list(range(40))


def test_the_estimate_is_the_interquartile_mean_with_its_interval():
    e = estimate([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 1000.0])
    assert e.value == 4.5
    assert e.low < e.value < e.high
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
    whole = Results(tmp_path / "swarm_success", [scenario])
    runner.run_missing(whole, [scenario], ["idle", "bio_inspired"], [0, 1], lambda *a: None)
    assert sorted(map(str, whole.rows)) == sorted(map(str, again.rows))


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
    succeeds(*arguments)
    assert "my_policies:Ahead" in (tmp_path / "out" / "table.md").read_text()
    for trace in (tmp_path / "out" / "traces").glob("*.1.npz"):
        trace.unlink()
    succeeds(*arguments)  # a run without its trace is run again
    (tmp_path / "my_policies.py").write_text(OWN_POLICY + "\n# changed\n")
    refused("before its file changed", *arguments)


def test_the_command_line_from_end_to_end(tmp_path):
    arguments = ["benchmark", "--scenario=lossy", "--scenario=tracking", "--policy=bio_inspired", "--policy=random"]
    arguments += ["--seeds=3", f"--output={tmp_path}", *SETS, "--set=losses.times_s=[1.0, 2.0]"]
    text = succeeds(*arguments)
    assert "bio_inspired" in text
    assert "[s]" in text  # brackets are not markup
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
    succeeds(*arguments)
    assert (tmp_path / "results.json").read_bytes() == before


@pytest.mark.parametrize("name", ["bio_inspired", "scout", "mappo", "idle"])
def test_the_parameters_listed_are_those_that_a_policy_s_name_takes(name):
    shown = succeeds("list", "policies", f"--show={name}").partition("Parameters: ")[2]
    listed = set(shown.split(", ")) - {"safety_filter", "own_clock"}
    scenario = with_policy_requirements(name, load_scenario("tracking"))
    with pytest.raises(PolicyError, match="has no parameter") as error:
        make_policy(f"{name},nothing=1", scenario)
    assert listed == set(str(error.value).partition("it has ")[2].split(", ")) - {"gains", "barrier", "none"}


@pytest.mark.parametrize(("arguments", "message"), [
    (["benchmark", "--scenario=singel_obstacle"], "did you mean"),
    (["benchmark", "--set=vehicle.m_kg=-1"], "vehicle.m_kg must be greater than or equal to 0.001"),
    (["list", "--show=trackin"], "did you mean"),
    (["list", "policies", "--show=sf"], "did you mean 'sff'"),
    (["benchmark", "--set=actuators.yaw_damping_nms=600"], "every policy has its own"),
    (["benchmark", "--scenario=tracking", "--scenario=tracking"], "different names"),
    (["benchmark", "--policy=:"], "policy ':' can't be imported"),
    (["benchmark", "--policy=math:pi"], "must be a subclass"),
    (["benchmark", "--set=name=../up"], "name must hold letters"),
    (["benchmark", "--set=seed=1", "--set=seed=2"], "--set seed is given twice, as 1 and as 2; leave one out"),
    (["train", "--steps=3.5"], "steps must be a valid integer, got a number with a fractional part"),
    (["train", "nowhere"], "scenario 'nowhere'"),
    (["train", "nowhere.toml"], "nowhere.toml can't be read"),
    (["train", "starter", "--seed=1", "--set=seed=2"], "--set seed is given twice, as 1 and as 2; leave one out"),
    (["robustness", "--axis=X", "--level=2"], "axis X has the levels 1, "),
    (["tune", "--policy=idle"], "no free gains"),
])  # fmt: skip
def test_mistakes_are_explained_without_a_traceback(arguments, message, tmp_path):
    if arguments[0] == "train":
        pytest.importorskip("torch")
    text = refused(message, *arguments, *([f"--output={tmp_path}"] if arguments[0] != "list" else []))
    assert "Traceback" not in text
    assert {path.name for path in tmp_path.iterdir()} <= {".lock"}


def test_between_walls_tuning_pays_for_who_arrives_untouched_and_for_time():
    from uuv_marl.baselines.scout.gains import ScoutGains
    from uuv_marl.benchmark.tuning import MAPS, SPACES, tuning_cost

    scenario = load_scenario("hard_water", num_vehicles=2)
    idle = next(run for run in episodes(scenario, "idle", MAPS[:1]))
    assert tuning_cost(idle, scenario) == pytest.approx(1000.0 + idle.routes.time_s[-1])
    half = idle._replace(metrics=idle.metrics | {"task": {"success_share": 0.5}})
    assert tuning_cost(half, scenario) == pytest.approx(500.0 + idle.routes.time_s[-1])
    made = SPACES["scout"].parameters({"push_range": 9.0, "obstacle_m": 3.0})
    assert made == {"gains": ScoutGains(push_range=9.0), "barrier": Barrier(obstacle_m=3.0)}


@pytest.mark.needs("optuna")
def test_a_search_is_resumed_and_repeats_itself(tmp_path, monkeypatch):
    from uuv_marl.benchmark import tuning

    monkeypatch.setattr(tuning, "SEEDS", (10_000,))
    monkeypatch.setattr("uuv_marl.scenario.load_scenario", lambda *a, **k: quick())
    optuna = pytest.importorskip("optuna")
    before = optuna.logging.get_verbosity()
    for folder, stops in (("swarm_success", [5]), ("parts", [2, 5])):
        for trials in stops:
            tuning.tune("bio_inspired_plus", tmp_path / folder, trials, lambda *a: None)
    assert optuna.logging.get_verbosity() == before
    for name in ("bio_inspired_plus.json", "bio_inspired_plus.csv"):
        assert (tmp_path / "swarm_success" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()
    assert len((tmp_path / "swarm_success" / "bio_inspired_plus.csv").read_text().splitlines()) == 6


@pytest.mark.parametrize("width", [80, 88, 100, 130])
@pytest.mark.parametrize("scenario", ["single_obstacle", "hard_water"])
def test_a_table_fits_its_width_with_no_letter_cut_and_explains_what_it_shows(tmp_path, scenario, width):
    metrics = next(run for run in episodes(quick(scenario), "idle", [0])).metrics
    results = Results(tmp_path, [load_scenario(scenario)], traces=False)
    for policy in ("mine:Dodge", "runs/easy/best_of_many"):
        results.policies[policy] = PolicyInfo(channels=["compass"], yaw_damping_nms=0.0, source=None)
        results._runs |= {(scenario, policy, seed): metrics for seed in range(5)}
    table = scenario_table(results, results.scenarios[scenario], [*results.policies], range(5))
    out = Console(width=width, file=io.StringIO())
    out.print(terminal_table(table, width))
    text = out.file.getvalue()
    assert max(map(len, text.splitlines())) <= width
    lines = [line for line in text.splitlines() if "│" in line]
    assert all(line.rstrip()[-1] == "│" for line in lines)
    cells = ["".join(parts) for parts in zip(*(line.split("│") for line in lines), strict=True)]
    shown = "".join("".join(cell.split()) for cell in cells)
    for name, cell in table.rows[0].items():
        if name not in ("mean spacing [m]", "within Eq. 7"):
            seen = cell if width >= 110 else cell.partition(" [")[0]
            assert "".join(seen.replace("–", "-").split()) in shown, name
    assert ("interval" in text) == (width >= 110)
    assert ("SFF" in text) == (scenario == "single_obstacle")
    assert "Eq. 7" not in text
    full = table.caption()
    assert "95 % bootstrap interval" in full
    assert ("Eq. 7" in full) == (scenario == "single_obstacle")
