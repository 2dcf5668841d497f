"""Learned policies from checkpoints: what they see, what they refuse, and that every path gives one run."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy

from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, granted, make
from uuv_marl.baselines.learned.checkpoint import (
    WEIGHTS_FILE,
    Card,
    Layer,
    card_rows,
    load_checkpoint,
    save_checkpoint,
    vehicle_of,
)
from uuv_marl.baselines.learned.network import forward
from uuv_marl.baselines.learned.percept_features import BARRIER
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.results import knowledge
from uuv_marl.scenario import scenario_names
from uuv_marl.sim.swarm import Swarm

SHORT = {"trajectory.waypoints_m": [[0.0, 0.0], [40.0, 0.0]], "time_limit.extra_s": 1.0, "time_limit.factor": 1.0}


def actor(scale=0.3, seed=0, hidden=16, features=11 + 4 * 28):
    rng, sizes = np.random.default_rng(seed), (features, hidden, 2)
    return [
        Layer(scale * rng.standard_normal((a, b), np.float32), scale * rng.standard_normal(b, np.float32))
        for a, b in itertools.pairwise(sizes)
    ]


def card(**changes):
    return Card(**{"percept": card_rows(load_scenario("tracking")), **changes})


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


@pytest.mark.parametrize("n", [1, 54])
def test_a_run_depends_on_its_seed_alone(best, n):
    scenario = granted(best, load_scenario("tracking", num_vehicles=n, overrides=SHORT))
    together = {e.seed: e for e in evaluate(scenario, best, [4, 5, 6]) if isinstance(e, Run)}
    (alone,) = (e for e in evaluate(scenario, best, [5]) if isinstance(e, Run))
    assert together[5].metrics == alone.metrics
    np.testing.assert_array_equal(together[5].routes.position, alone.routes.position)


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
    with pytest.raises(
        PolicyError, match=r"another percept.*was .'heard', 21, '1', 1.0. in .* is .'heard', 19, '1', 1.0. here; use"
    ):
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
    with pytest.raises(PolicyError, match="did you mean 'bio_inspired'.*paths of checkpoints"):
        make("bio_inspred", load_scenario("tracking"))


def test_a_rewritten_checkpoint_is_loaded_anew(best):
    assert policy_class(best).yaw_damping_nms == 600.0
    save_checkpoint(learned_file(best), card(yaw_damping_nms=100.0), actor())
    assert policy_class(best).yaw_damping_nms == 100.0


@pytest.mark.parametrize(("field", "value"), [("vehicle.m_kg", 600.0), ("actuators.lever_arm_m", 2.0)])
@pytest.mark.parametrize("name", ["mappo", "best"])
def test_another_vehicle_is_refused_unless_asked_for(name, field, value, best):
    """Also by checkpoints of version 0.1.0, which do not name theirs: the shipped one."""
    name = best if name == "best" else name
    other = granted(name, load_scenario("tracking", num_vehicles=2, overrides={field: value}))
    was = {**vehicle_of(load_scenario("tracking"))}[field]
    told = f"{field} was {was} in the training and is {value} here"
    message = f"another vehicle than scenario 'tracking' has: {told}.*any_vehicle=True"
    with pytest.raises(PolicyError, match=message):
        make(name, other)
    assert make(name, other, any_vehicle=True).act(Swarm(other).reset(0)).shape == (1, 2, 2)


def test_a_checkpoint_runs_on_the_vehicle_that_it_was_trained_on(best):
    heavy = load_scenario("tracking", overrides={"vehicle.m_kg": 600.0})
    save_checkpoint(learned_file(best), card(vehicle=vehicle_of(heavy)), actor())
    make(best, granted(best, heavy))
    with pytest.raises(PolicyError, match=r"vehicle.m_kg was 600.0 in the training and is 185.0"):
        make(best, granted(best, load_scenario("tracking")))


@pytest.mark.parametrize("name", ["mappo", "ppo"])
def test_weights_of_the_first_version_run_on_every_shipped_scenario(name):
    for scenario in scenario_names():
        make(name, granted(name, load_scenario(scenario)))


def changed(k=0, name="weight", value=None, at=None):
    """The actor with one array replaced, or one entry of it."""
    layers = actor()
    array = layers[k]._asdict()[name] if value is None or at is not None else np.asarray(value, np.float32)
    if at is not None:
        array[at] = value
    layers[k] = layers[k]._replace(**{name: array})
    return layers


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        (actor(features=100), r"0.weight is float32 \(100, 16\), expected float32 \(123, 16\)"),
        (changed(at=(0, 0), value=np.nan), "0.weight must hold finite numbers"),
        (changed(at=(3, 1), value=1e38), "0.weight must hold finite numbers of at most 1e"),
        (changed(value=np.zeros((123, 16, 2))), r"0.weight is float32 \(123, 16, 2\), expected"),
        (changed(0, "bias", 0.0), r"0.bias is float32 \(1,\), expected"),
        (changed(1, value=np.zeros((16, 3))), r"1.weight is float32 \(16, 3\), expected float32 \(16, 2\)"),
        ([], "0.weight is missing"),
    ],
)
def test_weights_that_cannot_run_are_refused(layers, message, tmp_path):
    save_checkpoint(tmp_path / "bad", card(), layers)
    with pytest.raises(PolicyError, match=f"bad holds no policy of uuv_marl .{message}"):
        make(str(tmp_path / "bad"), load_scenario("tracking"))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("barrier", [1.0]),
        ("barrier", [0.0, 0.8, float("nan"), 0.3, 140.0, 0.0]),
        ("decision_period_s", [0.5, 0.1]),
        ("decision_period_s", [0.0, 0.1]),
        ("yaw_damping_nms", float("nan")),
        ("percept", "none"),
        ("format", 2),
        ("wings", 2),
    ],
)
def test_cards_that_say_nothing_sensible_are_refused(field, value, tmp_path):
    tensors = {f"{k}.{name}": a for k, layer in enumerate(actor()) for name, a in layer._asdict().items()}
    said = json.dumps({**card().model_dump(mode="json"), field: value})
    (tmp_path / "bad").write_bytes(safetensors.numpy.save(tensors, {"uuv_marl": said}))
    with pytest.raises(PolicyError, match=f"bad holds no policy of uuv_marl .its card's {field}"):
        make(str(tmp_path / "bad"), load_scenario("tracking"))
