"""Research on tasks: what is run, the page by hand, a blind training, and the shipped pages from the shipped rows."""

from pathlib import Path

import numpy as np
import pytest

from research.episodes import read_rows
from research.tasks import learn
from research.tasks.learner import OBSERVE, sight
from research.tasks.page import report
from research.tasks.studies import STUDIES, set_name
from uuv_marl import load_scenario
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.sim.observation import observation_layout
from uuv_marl.tasks.maps import KINDS

DOCS = Path(__file__).resolve().parent.parent / "docs"
LEARNED = Path(learn.__file__).resolve().parent
STUDY = STUDIES["hard_water"]


def rows(policy, share):
    told = dict.fromkeys(STUDY.metrics, "1.000") | {"untouched_share": f"{share:.3f}", "whole": "0.000"}
    return [{"set": name, "policy": policy, "seed": str(seed), **told} for name in STUDY.sets for seed in range(3)]


def episodes(name, share):
    return [
        {"learner": name, "set": each, "seed": str(seed), **dict.fromkeys(STUDY.metrics, "1.000")}
        | {"untouched_share": f"{share:.3f}"}
        for each in STUDY.judged
        for seed in range(3)
    ]


def test_reported_episodes_count_from_zero_and_every_set_is_what_its_name_says():
    for study in STUDIES.values():
        assert study.judged
        for name, each in study.sets.items():
            case = each.cases(None)[0]
            scenario = case.load()
            kind, n = getattr(scenario.task_numbers, "kinds", [""])[0], scenario.swarm.num_vehicles
            usual, informed = load_scenario(scenario.name), case.overrides.get("task.informed", 0)
            assert name == set_name(scenario.name, kind, informed or (0 if n == usual.swarm.num_vehicles else n))
            assert case.seeds == range(100)
    assert [*STUDY.judged] == [set_name("hard_water", kind) for kind in KINDS]


def test_the_page_by_hand():
    done = [*rows("scout", 0.5), *rows("apf", 0.25), *rows("oracle", 1.0), *rows("sff_informed", 0.9)]
    learned = [*episodes("sighted-0", 0.75), *episodes("zeroed-0", 0.2), *episodes("blind-0", 0.25)]
    text = report("hard_water", done, learned)
    assert "| scout | .50 [.50, .50], .00 | .50 [.50, .50], .00 | .50 [.50, .50], .00 |" in text
    assert "| oracle | 1.00, .00 | 1.00, .00 |" in text
    assert "| scout |" + " .50, .00 |" * 7 + " 1.00 | 0.10 | 1.0 m | 1.0 m |" in text
    assert "| PPO, trained with echoes zeroed | .25 |" in text
    assert "| the best law: scout | .50 |" in text
    assert "| PPO above the best law |  |  |  |  |  |  |  | .25 [.25, .25] |" in text


def test_a_blind_learner_sees_no_echo_and_its_budget_ends():
    scenario = load_scenario("hard_water")
    blind, layout = sight(scenario, True), observation_layout(scenario, OBSERVE)
    echoes = [f.name for f in layout.table if blind[layout.starts[f.name]] == 0.0]
    assert echoes == [f.name for f in layout.table if f.name.startswith("echo")]
    assert sight(scenario, False).all()
    env = learn.Sighted(SwarmVecEnv(scenario, 2, observe=OBSERVE, max_cycles=3), blind)
    assert not env.reset()[:, blind == 0.0].any()
    for _ in range(4):
        observation, _, done, infos = env.step(np.zeros((env.num_envs, 2), np.float32))
        assert not observation[:, blind == 0.0].any()
        assert observation[:, blind == 1.0].any()
        assert not any(infos[row]["terminal_observation"][blind == 0.0].any() for row in np.flatnonzero(done))
    _, curve = learn.learn("hard_water", 0, True, 0.01, lambda _: None)
    assert curve[0]["agent_steps"] == "0"


@pytest.mark.docs
@pytest.mark.parametrize("task", [task for task in STUDIES if (DOCS / f"{task}.csv.gz").exists()])
def test_the_shipped_page_is_made_of_the_shipped_rows(task):
    made = report(task, read_rows(DOCS / f"{task}.csv.gz"), read_rows(LEARNED / f"learned_{task}.csv.gz"))
    assert (DOCS / f"{task}.md").read_text() == made
