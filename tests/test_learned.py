"""Learned policies from checkpoints: what they see, what they refuse, and that every path gives one run."""

import itertools
import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
from typer.testing import CliRunner

from uuv_marl import load_scenario, parallel_env
from uuv_marl.baselines import PolicyError, granted, make
from uuv_marl.baselines.learned import (
    BARRIER,
    WEIGHTS_FILE,
    Card,
    Eyes,
    Layer,
    forward,
    learned_class,
    load_checkpoint,
    rows_of,
    save_checkpoint,
)
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.results import Results, ResultsError, knowledge
from uuv_marl.cli import app
from uuv_marl.percept import PerceptLayout
from uuv_marl.sim.swarm import Swarm

SHORT = {"trajectory.waypoints_m": [[0.0, 0.0], [40.0, 0.0]], "time_limit.extra_s": 1.0, "time_limit.factor": 1.0}


def actor(scale=0.3, seed=0, hidden=16, features=11 + 4 * 28):
    rng, sizes = np.random.default_rng(seed), (features, hidden, 2)
    return [
        Layer(scale * rng.standard_normal((a, b), np.float32), scale * rng.standard_normal(b, np.float32))
        for a, b in itertools.pairwise(sizes)
    ]


def card(**changes):
    return Card(**{"percept": rows_of(PerceptLayout.of(load_scenario("tracking"))), **changes})


@pytest.fixture
def best(tmp_path):
    save_checkpoint(tmp_path / "best" / WEIGHTS_FILE, card(training={"seed": 3}), actor())
    return str(tmp_path / "best")


def test_a_checkpoint_comes_back_as_it_was_written(best):
    loaded = load_checkpoint(Path(best))
    assert loaded.card == card(training={"seed": 3})
    for mine, theirs in zip(loaded.layers, actor(), strict=True):
        np.testing.assert_array_equal(mine.weight, theirs.weight)
        np.testing.assert_array_equal(mine.bias, theirs.bias)


def test_the_network_is_the_textbooks(best):
    x = np.random.default_rng(1).standard_normal((50, 123), np.float32)
    one, two = actor()
    np.testing.assert_allclose(
        forward((one, two), x), np.tanh(x @ one.weight + one.bias) @ two.weight + two.bias, atol=2e-5
    )


def test_no_wish_leaves_the_barrier_of_the_papers_law(best):
    """With zero weights the action is Eq. 20-21's, which ``bio_inspired`` computes with the barrier's gains."""
    zero = [Layer(0 * layer.weight, 0 * layer.bias) for layer in actor()]
    save_checkpoint(learned_file(best), card(yaw_damping_nms=0.0), zero)
    scenario = granted(best, load_scenario("single_obstacle"))
    swarm = Swarm(scenario, 2)
    percept = swarm.reset(5)
    law = make("bio_inspired", scenario, 2, gains=BARRIER)
    np.testing.assert_allclose(make(best, scenario, 2).act(percept), law.act(percept), atol=1e-6)


def learned_file(folder):
    return Path(folder) / WEIGHTS_FILE


def test_actions_turn_with_the_world(best):
    scenario = granted(best, load_scenario("single_obstacle", num_vehicles=20))
    turn, actions = 0.7, []
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    for moved in (False, True):
        swarm = Swarm(scenario)
        swarm.reset(3)
        swarm.state.eta[0, :, :2] += 150.0
        if moved:
            swarm.state.eta[0, :, :2] = swarm.state.eta[0, :, :2] @ rotation.T + (50.0, -80.0)
            swarm.state.eta[0, :, 2] += turn
            swarm.course.obstacles[0, :, :2] = swarm.course.obstacles[0, :, :2] @ rotation.T + (50.0, -80.0)
            swarm.course.waypoints[0] = swarm.course.waypoints[0] @ rotation.T + (50.0, -80.0)
        actions.append(make(best, scenario).act(swarm.observe()))
    assert np.abs(actions[0]).max() > 0.1
    np.testing.assert_allclose(actions[0], actions[1], atol=5e-4)


def test_features_are_bounded_and_feel_what_is_near(place):
    scenario = load_scenario("single_obstacle", num_vehicles=3)
    eyes = Eyes(scenario, BARRIER)
    swarm = place("single_obstacle", [[0, 0, 0], [6.0, 0, 0], [-300.0, 5.0, 0]], obstacles=[(60.0, 0, 25.0)])
    features, barrier = np.empty((1, 3, eyes.size), np.float32), np.empty((1, 3, 2), np.float32)
    eyes.look(swarm.percept.flat, features, barrier, np.zeros(1, np.int64))
    assert np.abs(features).max() <= 4.0
    assert barrier[0, 0, 0] < -0.3, "pushed back by the vehicle ahead"
    before = features.copy()
    swarm.state.eta[0, 1, 0] = 7.0
    eyes.look(swarm.observe().flat, features, barrier, np.zeros(1, np.int64))
    assert np.abs(features - before)[0, 0].max() > 0.02


@pytest.mark.parametrize("n", [1, 54])
def test_a_run_depends_on_its_seed_alone(best, n):
    scenario = granted(best, load_scenario("tracking", num_vehicles=n, overrides=SHORT))
    together = {e.seed: e for e in evaluate(scenario, best, [4, 5, 6]) if isinstance(e, Run)}
    (alone,) = (e for e in evaluate(scenario, best, [5]) if isinstance(e, Run))
    assert together[5].metrics == alone.metrics
    np.testing.assert_array_equal(together[5].routes.position, alone.routes.position)


def test_the_environment_gives_the_same_run(best):
    scenario = granted(best, load_scenario("tracking", num_vehicles=5, overrides=SHORT))
    env, swarm = parallel_env(scenario), Swarm(scenario)
    through, direct = make(best, env), make(best, scenario)
    observations, _ = env.reset(seed=3)
    percept = swarm.reset(3)
    for _ in range(20):
        observations, *_ = env.step(through(observations))
        percept = swarm.step(direct.act(percept))
    np.testing.assert_array_equal(env.unwrapped.swarm.state.eta, swarm.state.eta)


def test_it_works_for_any_size_and_declares_what_it_needs(best):
    assert knowledge(best) == {
        "channels": [],
        "yaw_damping_nms": 600.0,
        "source": load_checkpoint(learned_file(best)).digest,
    }
    for n in (1, 200):
        scenario = granted(best, load_scenario("tracking", num_vehicles=n))
        assert make(best, scenario).act(Swarm(scenario).reset(0)).shape == (1, n, 2)
    with pytest.raises(PolicyError, match="yaw damping of 600.*granted"):
        make(best, load_scenario("tracking"))


def test_another_percept_or_period_is_refused_with_the_remedy(best):
    other = granted(best, load_scenario("tracking", overrides={"sonar.arrays.bow.sub_sectors": 5}))
    with pytest.raises(PolicyError, match="another percept.*'heard 21 1 1.0' against 'heard 19 1 1.0'; use"):
        make(best, other)
    slow = granted(best, load_scenario("tracking", overrides={"timing.decision_period_s": 1.0}))
    with pytest.raises(PolicyError, match="every 0.1 to 0.5 s.*override timing.decision_period_s"):
        make(best, slow)


def test_what_is_no_checkpoint_is_explained(best, tmp_path):
    with pytest.raises(PolicyError, match="can't be read.*give a checkpoint"):
        make(str(tmp_path / "nowhere"), load_scenario("tracking"))
    (tmp_path / "bad").write_bytes(b"\x80\x04pickled")
    with pytest.raises(PolicyError, match="holds no policy of uuv_marl"):
        make(str(tmp_path / "bad"), load_scenario("tracking"))
    (tmp_path / "other").write_bytes(safetensors.numpy.save({"x": np.zeros(2, np.float32)}))
    with pytest.raises(PolicyError, match="holds no policy of uuv_marl"):
        make(str(tmp_path / "other"), load_scenario("tracking"))
    save_checkpoint(tmp_path / "narrow", card(), actor(features=100))
    with pytest.raises(PolicyError, match=r"expected float32 \(123"):
        make(str(tmp_path / "narrow"), load_scenario("tracking"))
    with pytest.raises(PolicyError, match="did you mean 'bio_inspired'.*paths of checkpoints"):
        make("bio_inspred", load_scenario("tracking"))


def test_a_rewritten_checkpoint_is_loaded_anew(best):
    before = learned_class(best)
    assert learned_class(best) is before
    save_checkpoint(learned_file(best), card(yaw_damping_nms=100.0), actor())
    assert learned_class(best).yaw_damping_nms == 100.0


def test_results_refuse_other_weights_of_the_same_path(best, tmp_path):
    scenario = granted(best, load_scenario("tracking", num_vehicles=2, overrides=SHORT))
    results = Results(tmp_path / "out", [scenario])
    for run in evaluate(scenario, best, [0]):
        if isinstance(run, Run):
            results.add(scenario.name, best, run)
    assert Results(tmp_path / "out", [scenario]).has("tracking", best, 0)
    assert results.trace("tracking", best, 0)["time_s"].size
    save_checkpoint(learned_file(best), card(), actor(seed=1))
    with pytest.raises(ResultsError, match="as it was before its file changed"):
        Results(tmp_path / "out", [scenario])


def test_one_table_holds_names_and_checkpoints(best, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    shutil.move(best, tmp_path / "runs" / "best")
    options = [f"--set={key}={json.dumps(value)}" for key, value in SHORT.items()]
    command = ["benchmark", "--scenario=tracking", "--seeds=1", "--policy=idle", "--policy=runs/best", "--output=out"]
    done = CliRunner().invoke(app, [*command, *options, "--set=swarm.num_vehicles=4"])
    assert done.exit_code == 0, done.output
    table = (tmp_path / "out" / "table.md").read_text()
    assert "| idle |" in table
    assert "| runs/best | yaw damping 600 N m s |" in table


def test_weights_that_change_during_a_benchmark_are_refused(best, tmp_path):
    scenario = granted(str(best), load_scenario("tracking", num_vehicles=4, overrides=SHORT))
    results = Results(tmp_path / "out", [scenario])
    results.use(str(best))
    runs = [run for run in evaluate(scenario, str(best), [0, 1]) if isinstance(run, Run)]
    results.add(scenario.name, str(best), runs[0])
    save_checkpoint(learned_file(best), card(), actor(seed=1))
    with pytest.raises(ResultsError, match="before its file changed"):
        results.add(scenario.name, str(best), runs[1])
    assert [row.seed for row in results.rows] == [0]
