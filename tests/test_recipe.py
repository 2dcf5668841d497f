"""Recipes: what they say is what is trained on, in turn; they resume exactly."""

import json

import numpy as np
import pytest

from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES
from uuv_marl.baselines.learned.checkpoint import load_checkpoint
from uuv_marl.benchmark.robustness.axes import AXES
from uuv_marl.scenario.conditions import disturbances
from uuv_marl.train.training import Training, read_recipe, recipes

pytestmark = pytest.mark.needs("torch")


def recipe(path, **changes):
    """A recipe of small swarms and short courses; ``changes`` replace its fields."""
    told = {
        "title": '"small"', "sees": '"memory"', "sizes": "[[4, 2], [6, 1]]", "validation": "[[4, 1]]", "held_s": 0.5,
        "steps": 4000, "validate_every": 10, **changes,
    }  # fmt: skip
    episodes = '[episodes]\ncalm = 0.3\nsurface = 0.5\nperiods_s = [0.1, 0.5]\naxes = ["W1", "S1", "A1"]\nnumber = 12\n'
    short = '[episodes.changes]\n"random_field.legs" = [1, 1]\n"random_field.leg_length_m" = [60.0, 80.0]\n'
    path.write_text("".join(f"{key} = {value}\n" for key, value in told.items()) + episodes + short, encoding="utf-8")
    return str(path)


def trained_by(name, **changes):
    return Training(**read_recipe(name) | changes)


def test_a_recipe_draws_what_it_says():
    one, other = (trained_by("trimmed_scout", seed=seed) for seed in (0, 1))
    assert one.conditions == trained_by("trimmed_scout").conditions
    assert one.conditions != other.conditions
    assert one.validation_conditions == other.validation_conditions
    assert not any("random_field.legs" in changes for changes in one.validation_conditions), "of the set's own length"
    for conditions in (one.conditions, other.conditions):
        loaded = [load_scenario(one.loaded, overrides=changes) for changes in conditions]
        calm = [scenario for scenario in loaded if not disturbances(scenario)]
        assert 0.02 < len(calm) / len(loaded) < 0.25
        assert {scenario.sonar.echo_reports for scenario in loaded} == {"centre", "surface"}
        assert {scenario.timing.decision_period_s for scenario in loaded} == {0.1, 0.2, 0.5}


def test_a_recipe_disturbs_an_episode_twice():
    training = trained_by("trimmed_scout")
    speed = training.loaded.trajectory.speed_mps
    axes = [AXES[name] for name in training.episodes.axes]
    group_of = {field: axis.group for axis in axes for field in axis.overrides(2, speed)}
    groups = [{group_of[field] for field in c if field in group_of} for c in training.conditions]
    assert {len(names) for names in groups} == {0, 2}
    assert sum("A" in names for names in groups) > 0.5 * len(groups), "most of what is learned from"


def test_episodes_take_their_conditions_in_turn_and_an_output_is_held(tmp_path):
    from uuv_marl.train.env import TrainingEnv

    training = trained_by(recipe(tmp_path / "r.toml"))
    rng = np.random.default_rng(0)
    env = TrainingEnv(training, lambda num: rng.integers(100_000, 900_000, num))
    seen = [[group.swarm] for group in env._groups]
    for _ in range(260):
        before = [group.swarm.facts.time_s[0] for group in env._groups]
        env.step(np.zeros((env.rows, env.outputs), np.float32))
        for group, swarms, then in zip(env._groups, seen, before, strict=True):
            if group.swarm is swarms[-1]:
                assert group.swarm.facts.time_s[0] == pytest.approx(then + 0.5)
            else:
                swarms.append(group.swarm)
    conditions = training.conditions
    for group, swarms in zip(env._groups, seen, strict=True):
        assert len(swarms) > 2
        made = [(s.scenario.timing.decision_period_s, s.scenario.sonar.echo_reports) for s in swarms]
        first = group._turn - len(swarms) + 1
        told = [conditions[(first + k) % len(conditions)] for k in range(len(swarms))]
        assert made == [(t["timing.decision_period_s"], t.get("sonar.echo_reports", "centre")) for t in told]


def test_a_recipe_resumes_bit_for_bit(tmp_path):
    from uuv_marl.train.run import resume, train

    training = trained_by(recipe(tmp_path / "r.toml"), seed=3, checkpoint_every=1)
    list(train(tmp_path / "whole", training))
    stopped = iter([False, True])
    list(train(tmp_path / "parts", training, stop=lambda: next(stopped)))
    list(resume(tmp_path / "parts"))
    one, two = (load_checkpoint(tmp_path / name / "best").layers for name in ("whole", "parts"))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.weight, b.weight)


def test_what_ships_was_trained_as_its_recipe_says():
    training = trained_by("trimmed_scout")
    shipped = POLICIES["trimmed_scout"]
    card, told = shipped.checkpoint.card, json.loads(training.model_dump_json())
    assert (card.law, card.safety, card.trims) == (training.law, training.safety, training.trims)
    algorithm = {name: value for name, value in card.training["algorithm"].items() if name != "name"}
    assert algorithm == told["mappo"]
    for field in ("scenario", "sees", "sizes", "steps", "held_s", "validation"):
        assert card.training[field] == told[field], field
    assert card.training["weights"] == list(training.weights)
    assert card.training["conditions"] == json.loads(json.dumps(training.conditions))


def test_every_recipe_that_ships_is_a_training():
    assert recipes() == ["mappo", "trimmed_scout"]
    assert trained_by("mappo") == Training(title=trained_by("mappo").title)


def test_a_file_that_is_no_recipe_is_named(tmp_path):
    from uuv_marl.errors import TrainingError

    (tmp_path / "bad.toml").write_text("steps = \n", encoding="utf-8")
    with pytest.raises(TrainingError, match=r"bad.toml' is no TOML"):
        read_recipe(str(tmp_path / "bad.toml"))
