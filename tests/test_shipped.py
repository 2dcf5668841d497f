"""Networks that ship and their second trainings: each is what its recipe makes, and runs where its task is."""

import pytest

from research.second import SECOND, runnable
from tests.processes import ROOT
from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES, make_policy, with_policy_requirements
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.registry import policy_class
from uuv_marl.scenario import scenario_names
from uuv_marl.sim.observation import observation_layout
from uuv_marl.train.training import Ppo, Training, recipe_fields

RECIPES = ROOT / "examples" / "training"
NETWORKS = [*(name for name, kind in POLICIES.items() if isinstance(kind, Trained)), *SECOND]


@pytest.mark.parametrize("name", NETWORKS)
def test_it_is_end_to_end_and_runs_where_its_task_is(name):
    card = policy_class(runnable(name)).checkpoint.card
    assert card.policy_class == "end to end"
    rows = observation_layout(load_scenario(card.training.get("scenario", "training_field")), "closeness").table
    for scenario in map(load_scenario, scenario_names()):
        if observation_layout(scenario, "closeness").table == rows:
            make_policy(runnable(name), with_policy_requirements(runnable(name), scenario))


@pytest.mark.parametrize("name", [name for name in NETWORKS if name.startswith("mappo")])
def test_it_is_what_its_recipe_makes(name):
    """But for the seed, which each training of the same recipe has of its own."""
    card = policy_class(runnable(name)).checkpoint.card
    first, _, number = name.rpartition("_")
    fields = recipe_fields(str(RECIPES / f"{first if number.isdigit() else name}.toml"))
    made = Training(**fields | {"seed": card.training["seed"]})
    told = made.model_dump(mode="json")
    for model, now, then in ((Training, told, card.training), (Ppo, told["ppo"], card.training["ppo"])):
        later = {name: now.pop(name) for name in now.keys() - then.keys()}  # fields that came after it
        assert all(model.model_fields[name].default == value for name, value in later.items())
    assert card.training == card.training | told
    assert card == made.card.model_copy(update={"training": card.training})
