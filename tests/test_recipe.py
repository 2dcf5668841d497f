"""Recipes: what they say is what is trained on, in turn; they resume exactly."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES
from uuv_marl.baselines.learned.checkpoint import load_checkpoint
from uuv_marl.baselines.scout.gains import PRESETS
from uuv_marl.cli import app
from uuv_marl.scenario.conditions import disturbances
from uuv_marl.sim.swarm import Swarm
from uuv_marl.studies.robustness.axes import AXES

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


def test_a_recipe_draws_what_it_says():
    from uuv_marl.train.recipe import load_recipe

    one, other = (load_recipe("mappo_v2").settings(seed) for seed in (0, 1))
    assert one == load_recipe("mappo_v2").settings(0)
    assert one.conditions != other.conditions
    assert one.validation_conditions == other.validation_conditions
    assert not any("random_field.legs" in changes for changes in one.validation_conditions), "of the set's own length"
    for conditions in (one.conditions, other.conditions):
        loaded = [load_scenario(one.scenario, overrides={**one.overrides, **changes}) for changes in conditions]
        calm = [scenario for scenario in loaded if not disturbances(scenario)]
        assert 0.02 < len(calm) / len(loaded) < 0.25
        assert {scenario.sonar.echo_reports for scenario in loaded} == {"centre", "surface"}
        assert {scenario.timing.decision_period_s for scenario in loaded} == {0.1, 0.2, 0.5}


def test_a_recipe_may_disturb_an_episode_twice():
    from uuv_marl.train.recipe import load_recipe

    settings = load_recipe("mappo_v3").settings(0)
    episodes, speed = load_recipe("mappo_v3").episodes, load_scenario(settings.scenario).trajectory.speed_mps
    group_of = {field: axis.group for axis in map(AXES.get, episodes.axes) for field in axis.overrides(1, speed)}
    groups = [{group_of[field] for field in c if field in group_of} for c in settings.conditions]
    assert {len(names) for names in groups} == {0, 2}
    assert sum("A" in names for names in groups) > 0.5 * len(groups), "most of what is learned from"
    for changes in settings.conditions:
        load_scenario(settings.scenario, overrides={**settings.overrides, **changes})


def test_episodes_take_their_conditions_in_turn_and_an_output_is_held(tmp_path):
    from uuv_marl.train.env import TrainingEnv
    from uuv_marl.train.group import Problem
    from uuv_marl.train.recipe import load_recipe

    settings = load_recipe(recipe(tmp_path / "r.toml")).settings(0)
    problem = Problem(
        settings.load(), settings.sizes, settings.weights, settings.sees, held_s=0.5, conditions=settings.conditions
    )
    rng = np.random.default_rng(0)
    env = TrainingEnv(problem, lambda num: rng.integers(100_000, 900_000, num))
    seen = [[group.swarm] for group in env._groups]
    for _ in range(260):
        before = [group.swarm.facts.time_s[0] for group in env._groups]
        env.step(np.zeros((env.rows, env.outputs), np.float32))
        for group, swarms, then in zip(env._groups, seen, before, strict=True):
            if group.swarm is swarms[-1]:
                assert group.swarm.facts.time_s[0] == pytest.approx(then + 0.5)
            else:
                swarms.append(group.swarm)
    conditions = settings.conditions
    for group, swarms in zip(env._groups, seen, strict=True):
        assert len(swarms) > 2
        made = [(s.scenario.timing.decision_period_s, s.scenario.sonar.echo_reports) for s in swarms]
        first = group._turn - len(swarms) + 1
        told = [conditions[(first + k) % len(conditions)] for k in range(len(swarms))]
        assert made == [(t["timing.decision_period_s"], t.get("sonar.echo_reports", "centre")) for t in told]


def test_the_shipped_recipe_trims_the_law_of_scout_plus():
    from uuv_marl.train.recipe import load_recipe

    assert load_recipe("mappo_v2").settings(0).law == PRESETS["plus"].gains


@pytest.mark.parametrize("algorithm", ["mappo", "ppo"])
def test_a_recipe_resumes_bit_for_bit(algorithm, tmp_path):
    from uuv_marl.train import training as trainings
    from uuv_marl.train.recipe import load_recipe

    settings = load_recipe(recipe(tmp_path / "r.toml")).settings(3, algorithm)
    settings = dataclasses.replace(settings, checkpoint_every=1)
    list(trainings.train(tmp_path / "whole", settings))
    stopped = iter([False, True])
    list(trainings.train(tmp_path / "parts", settings, stop=lambda: next(stopped)))
    list(trainings.train(tmp_path / "parts", settings, resume=True))
    one, two = (load_checkpoint(tmp_path / name / "best").layers for name in ("whole", "parts"))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.weight, b.weight)


def test_a_recipe_can_choose_the_last_policy(tmp_path):
    from uuv_marl.train import training as trainings
    from uuv_marl.train.recipe import load_recipe

    settings = load_recipe(recipe(tmp_path / "r.toml", chosen='"last"', validate_every=1)).settings(0)
    *_, last = trainings.train(tmp_path / "run", settings)
    best, end = (load_checkpoint(tmp_path / "run" / name) for name in ("best", f"checkpoints/{last.iteration:06d}"))
    assert best.card.training["record"]["iteration"] == last.iteration > 1
    np.testing.assert_array_equal(best.layers[0].weight, end.layers[0].weight)


@pytest.mark.parametrize(
    ("recipe", "seed", "name"),
    [
        ("mappo_v4", 0, "trimmed_scout"),
    ],
)
def test_what_ships_says_that_it_was_trained_by_the_recipe(recipe, seed, name):
    from uuv_marl.train.recipe import load_recipe

    told = json.loads(json.dumps(dataclasses.asdict(load_recipe(recipe).settings(seed))))
    card = POLICIES[name].checkpoint.card
    # It was chosen by hand what the recipe says since; some numbers had no field.
    said = {"chosen": "last", "safety": list(card.safety), "trims": list(card.trims), **card.training}
    said |= {"law": list(card.law), "algorithm": {"first_outputs": [], **card.training["algorithm"]}}
    assert {field: said[field] for field in told} == told
    assert (card.law, card.safety) == PRESETS["wary"]


def test_a_recipe_like_another_says_only_what_differs(tmp_path):
    from uuv_marl.train.recipe import load_recipe, recipes

    whole = load_recipe("mappo_v2")
    for name in recipes():
        one = load_recipe(name)
        assert one.mappo | {"noise": 0, "first_outputs": 0} == whole.mappo | {"noise": 0, "first_outputs": 0}
        assert (one == whole) == (name == "mappo_v2")
    assert load_recipe("shipped") == load_recipe("mappo_v4")
    calm = load_recipe("mappo_v2_calm")
    assert calm.episodes == whole.episodes.model_copy(update={"calm": 1.0})
    (tmp_path / "own.toml").write_text('title = "own"\nlike = "mappo_v2_calm"\nsteps = 7\n', encoding="utf-8")
    own = load_recipe(str(tmp_path / "own.toml"))
    assert own == calm.model_copy(update={"title": "own", "steps": 7})


def test_a_filter_that_sees_nothing_changes_nothing():
    from uuv_marl.train.acting import ACTING
    from uuv_marl.train.recipe import load_recipe

    changed = {}
    for name in ("mappo_v2", "mappo_v2_unfiltered"):
        settings = load_recipe(name).settings(0)
        scenario = load_scenario("random_field", num_vehicles=10, overrides=settings.overrides)
        swarm, changed[name] = Swarm(scenario, 1), 0.0
        swarm.reset([100_000])
        acting = ACTING["memory"](scenario, 1, settings.law, settings.safety, settings.trims)
        for _ in range(100):
            acting.hear(swarm.percept)
            swarm.step(acting.actions(np.zeros((1, 10, acting.num_outputs(settings.trims)), np.float32)))
            changed[name] += acting.changed.sum()
    assert changed["mappo_v2"] > 0.0 == changed["mappo_v2_unfiltered"]


def test_the_robustness_page_marks_what_was_trained_with():
    from uuv_marl.studies.robustness.page import _LEARNED
    from uuv_marl.train.recipe import load_recipe

    for policy, told in _LEARNED.items():
        episodes = load_recipe(policy.removesuffix("_seed1")).episodes
        assert told == (frozenset(episodes.axes), frozenset(episodes.levels)), policy


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sees": '"nothing"'}, "sees"),
        ({"sizez": "[[4, 2]]"}, "sizez"),
        ({"scenario": '"nowhere"'}, "nowhere"),
        ({"held_s": -1}, "held_s"),
        ({"ppo": "{ noise = [0.4, 0.2] }"}, "noise"),
        ({"mappo": "{ noize = [0.4, 0.2] }"}, "noize"),
        ({"mappo": "{ first_outputs = [0.1, 0.2] }"}, "first_outputs must have a number for each of 1 outputs, got 2"),
        ({"safety": "{ horizon_km = 0.0 }"}, "horizon_km"),
        ({"mappo": "{ noise_kept = 1.2 }"}, "noise_kept"),
        ({"mappo": "{ horizon = 0 }"}, "horizon"),
        ({"ppo": "{ epochs = 0 }"}, "epochs"),
        ({"like": '"nowhere"'}, "like = 'nowhere' must name another recipe"),
    ],
)
def test_bad_recipes_are_refused_by_name(tmp_path, changes, told):
    from uuv_marl.errors import ResultsError
    from uuv_marl.train.recipe import load_recipe

    with pytest.raises(ResultsError, match=told):
        load_recipe(recipe(tmp_path / "bad.toml", **changes))


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ('axes = ["W1", "X"]\nlevels = [2, 4]', r"axis X has the levels \[1, 3, 5\]; add one of them to levels"),
        ("periods_s = [1.0]", "decision_period_s of an episode is 1, but trained policies decide every 0.1 to 0.5 s"),
    ],
)
def test_episodes_that_cannot_be_drawn_or_run_are_refused(tmp_path, line, told):
    from uuv_marl.errors import ResultsError
    from uuv_marl.train.recipe import load_recipe

    path = tmp_path / "bad.toml"
    path.write_text(f'title = "bad"\n[episodes]\n{line}\n', encoding="utf-8")
    with pytest.raises(ResultsError, match=told):
        load_recipe(str(path))


def test_the_command_trains_what_a_recipe_says_and_nothing_else_beside_it(tmp_path):
    command = ["train", "mappo", "--recipe", recipe(tmp_path / "r.toml"), "--output", str(tmp_path / "run")]
    refused = CliRunner().invoke(app, [*command, "--scenario", "tracking"])
    assert refused.exit_code == 2
    assert "--recipe says this already; leave out --scenario tracking" in " ".join(refused.output.split())
    done = CliRunner().invoke(app, [*command, "--steps", "1000", "--seed", "2"])
    assert done.exit_code == 0, done.output
    card = load_checkpoint(tmp_path / "run" / "best").card
    assert (card.features, card.training["seed"], len(card.training["conditions"])) == ("memory", 2, 12)
