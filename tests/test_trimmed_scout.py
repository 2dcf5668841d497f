"""Learned policies with memory: nothing said is ``scout``, by one of the first trainer's networks."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from uuv_marl import load_scenario
from uuv_marl.baselines import granted, make
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, Card, card_rows, load_checkpoint, save_checkpoint
from uuv_marl.baselines.learned.memory_features import NUM_MEMORY_FEATURES
from uuv_marl.baselines.learned.network import forward
from uuv_marl.baselines.learned.trimmed_scout import TrimmedScout
from uuv_marl.baselines.memory.doubt import doubt, trim_weights
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import softened, wary
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.sim.swarm import Swarm

FEW = {"swarm.num_vehicles": 12, "timing.decision_period_s": 0.2, "sonar.echo_reports": "surface"}
ROUGH = {
    "noise.bearing_deg": 10.0, "noise.range_share": 0.2, "noise.false_echo_probability": 0.1, "current.speed_mps": 1.5,
    "latency.processing_s": 0.5, "noise.silence_probability": 0.1, "noise.silence_readings": 10,
}  # fmt: skip


LAG = {"actuators.thrust_lag_s": 0.2, "actuators.yaw_lag_s": 0.2}


def actor(scale, seed=0):
    rng = np.random.default_rng(seed)
    sizes = itertools.pairwise((NUM_MEMORY_FEATURES, 16, 1))
    shapes = (
        (f"{k}.{name}", shape) for k, (a, b) in enumerate(sizes) for name, shape in (("weight", (a, b)), ("bias", b))
    )
    return {name: scale * rng.standard_normal(shape, np.float32) for name, shape in shapes}


@pytest.fixture
def saved(tmp_path):
    def save(scale, **changes):
        card = Card(percept=card_rows(load_scenario("tracking"), "memory"), features="memory", **changes)
        save_checkpoint(tmp_path / f"{scale}" / WEIGHTS_FILE, card, actor(scale))
        return str(tmp_path / f"{scale}")

    return save


def actions(policy, seed=10_007, decisions=150, worlds=1, overrides=FEW):
    scenario = granted(policy, load_scenario("random_field", overrides=overrides))
    swarm, acts = Swarm(scenario, worlds), make(policy, scenario, worlds)
    percept, done = swarm.reset(seed), []
    for _ in range(decisions):
        done.append(acts.act(percept).copy())
        percept = swarm.step(done[-1])
    return np.array(done)


def test_an_actor_that_says_nothing_is_scout(saved):
    lagging = FEW | LAG
    np.testing.assert_array_equal(actions(saved(0.0), overrides=lagging), actions("scout", overrides=lagging))
    assert not np.array_equal(actions(saved(0.3), overrides=lagging), actions("scout", overrides=lagging))


def test_trimmed_scout_is_its_law_where_nothing_lags():
    done = []
    for name in ("trimmed_scout", "scout,preset=wary"):
        scenario = granted(name, load_scenario("random_field", overrides=FEW))
        swarm, policy = Swarm(scenario), make(name, scenario)
        percept = swarm.reset(10_007)
        for _ in range(150):
            percept = swarm.step(policy.act(percept))
        done.append(swarm.state.eta.copy())
    np.testing.assert_allclose(*done, rtol=0, atol=1e-3)


@pytest.mark.parametrize("overrides", [FEW, FEW | LAG], ids=["calm", "lag"])
def test_the_network_is_asked_only_where_its_output_counts(overrides, saved):
    scenario = granted("scout", load_scenario("random_field", overrides=overrides))
    swarm, policy, asked = Swarm(scenario), make(saved(0.3), scenario), []
    percept, features = swarm.reset(10_007), np.zeros((1, 12, NUM_MEMORY_FEATURES), np.float32)
    for _ in range(100):
        policy.hear(percept)
        action = policy.decide(percept).copy()
        asked.append(policy._heeded.mean())
        policy.look(features)
        everywhere = forward(policy.checkpoint.layers, features[0])[None]
        np.testing.assert_array_equal(action, policy.trim(everywhere))
        percept = swarm.step(policy.drive(percept, action))
    assert (np.mean(asked) > 0.9) == (overrides != FEW), "hardly anybody's in calm water, nearly all where they lag"


@pytest.mark.parametrize("trims", [[], ["steering", "steering"], ["thrust"]])
def test_a_card_names_what_can_be_trimmed(trims, saved):
    card = load_checkpoint(Path(saved(0.3))).card.model_dump()
    with pytest.raises(ValueError, match="trims"):
        Card.model_validate({**card, "trims": trims})


@pytest.mark.parametrize(
    ("overrides", "least", "most"),
    [
        ({}, 0.0, 0.1),
        (LAG, 0.95, 1.0),
        ({"noise.bearing_deg": 2.0}, 0.8, 1.0),
        ({"timing.decision_period_s": 0.5}, 0.25, 1.0),
    ],
    ids=["calm", "lag", "noise", "slow"],
)
def test_an_actor_has_its_say_where_vehicles_doubt(overrides, least, most):
    scenario = granted("scout", load_scenario("random_field", num_vehicles=20, overrides=overrides))
    swarm, policy, doubts = Swarm(scenario), make("scout", scenario), []
    percept, decisions = swarm.reset(10_007), round(40.0 / scenario.timing.decision_period_s)
    for k in range(decisions):
        percept = swarm.step(policy.act(percept))
        if k > decisions / 4:
            doubts.append([doubt(0, i, policy.memory)[1] for i in range(20)])
    assert least <= np.mean(doubts) <= most


@pytest.mark.parametrize(("noise_deg", "least", "most"), [(0.0, 0.9, 1.0), (10.0, 0.0, 0.1)], ids=["exact", "noisy"])
def test_who_makes_up_for_its_lag_steers_softly_only_where_it_hears_well(noise_deg, least, most):
    rough = LAG | {"noise.bearing_deg": noise_deg}
    scenario = granted("scout,preset=lead", load_scenario("random_field", num_vehicles=20, overrides=rough))
    swarm, policy, told = Swarm(scenario), make("scout,preset=lead", scenario), []
    percept = swarm.reset(10_007)
    for k in range(300):
        percept = swarm.step(policy.act(percept))
        if k > 100:
            told += [
                [*trim_weights(0, i, lead, policy.memory), *doubt(0, i, policy.memory)]
                for i in range(20)
                for lead in (0, 1)
            ]
    without, made_up = np.array(told[::2]), np.array(told[1::2])
    np.testing.assert_array_equal(without[:, :2], without[:, 2:])
    np.testing.assert_array_equal(made_up[:, 1], made_up[:, 3])
    assert least <= made_up[:, 0].sum() / made_up[:, 2].sum() <= most


def test_who_does_not_doubt_has_the_gains_of_the_law():
    law = ScoutGains(pull_in_doubt=-0.3, push_in_doubt=0.7)
    assert wary(law, 0.0) == law
    assert wary(law, 1.0) == law._replace(pull=law.pull * math.exp(-0.3), push=law.push * math.exp(0.7))


def test_whatever_the_actor_says_the_filter_has_the_last_word(saved):
    """An actor that pushes at random at full length collides no more than ``scout`` does: not at all."""
    policy = saved(3.0)
    scenario = granted(policy, load_scenario("random_field", overrides=FEW))
    runs = [event for event in evaluate(scenario, policy, [10_007, 10_008]) if isinstance(event, Run)]
    assert [run.metrics["collisions"] for run in runs] == [0, 0]


def test_trims_by_hand():
    law = ScoutGains(steering=0.8)
    assert softened(law, -0.25, 1.0) == law._replace(steering=0.8 * math.exp(-2.0)) == softened(law, -1.0, 0.25)
    assert softened(law, 0.25, 1.0) == softened(law, 0.0, 1.0) == softened(law, -0.25, 0.0) == law, "never harder"
    assert softened(law, -3.0, 1.0).steering == pytest.approx(0.8 * math.exp(-3.0)), "nor so soft that a vehicle drifts"


@pytest.mark.parametrize("overrides", [FEW, FEW | ROUGH], ids=["calm", "rough"])
def test_what_an_actor_sees_is_bounded(overrides):
    scenario = granted("scout", load_scenario("random_field", overrides=overrides))
    swarm, policy = Swarm(scenario), TrimmedScout(scenario)
    percept, features = swarm.reset(10_008), np.full((1, 12, NUM_MEMORY_FEATURES), np.nan, np.float32)
    most = np.zeros(NUM_MEMORY_FEATURES)
    for _ in range(400):
        policy.hear(percept)
        policy.look(features)
        most = np.maximum(most, np.abs(features[0]).max(axis=0))
        action = policy.trim(np.zeros((1, 12, 1), np.float32))
        percept = swarm.step(policy.drive(percept, action))
    assert np.isfinite(most).all()
    assert most.max() < 8.0
    assert (most > 0.0).sum() > NUM_MEMORY_FEATURES - 10, "most features say something"
