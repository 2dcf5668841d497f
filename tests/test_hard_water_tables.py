"""Research on hard water: its sets, its page by hand, a blind training, and the shipped page from the shipped rows."""

from pathlib import Path

import numpy as np
import pytest

from research.episodes import read_rows
from research.hard_water import learn
from research.hard_water.page import report
from research.hard_water.sets import KINDS, METRICS, SETS, TOLD, set_name
from uuv_marl.envs.observation import observation_layout
from uuv_marl.envs.sb3 import SwarmVecEnv

DOCS = Path(__file__).resolve().parent.parent / "docs"


def rows(policy, share, tiers=("easy", "medium", "hard"), sizes=(10,)):
    told = dict.fromkeys(METRICS, "1.000") | {"untouched_share": f"{share:.3f}", "whole": "0.000"}
    names = [set_name(tier, kind, n) for tier in tiers for kind in KINDS for n in sizes]
    return [{"set": name, "policy": policy, "seed": str(seed), **told} for name in names for seed in range(3)]


def episodes(name, share):
    return [
        {"learner": name, "kind": kind, "seed": str(seed), "untouched_share": f"{share:.3f}"}
        for kind in KINDS
        for seed in range(3)
    ]


def test_reported_maps_count_from_zero_and_every_set_draws_one_kind():
    assert len({each.name for each in SETS}) == len(SETS)
    for each in SETS:
        case = each.cases(None)[0]
        scenario = case.load()
        assert scenario.task_numbers.kinds == (each.name.split("-")[1],)
        assert str(scenario.swarm.num_vehicles) == each.name.split("-")[2]
        assert scenario.name == TOLD["tiers"][each.name.split("-")[0]]
        assert case.seeds == range(100)


def test_the_page_by_hand():
    done = [*rows("scout", 0.5), *rows("apf", 0.25), *rows("oracle", 1.0)]
    learned = [*episodes("sighted-0", 0.75), *episodes("zeroed-0", 0.2), *episodes("blind-0", 0.25)]
    text = report(done, learned)
    assert "| scout | .50 [.50, .50], .00 | .50 [.50, .50], .00 | .50 [.50, .50], .00 |" in text
    assert "| oracle | 1.00, .00 | 1.00, .00 |" in text
    assert "| PPO, trained with echoes zeroed | .25 |" in text
    assert "| the best law: scout | .50 |" in text
    assert "| PPO above the best law |  |  |  |  |  |  |  | .25 [.25, .25] |" in text


def test_a_blind_learner_sees_no_echo_and_its_budget_ends():
    scenario = learn.scenario_of("gate")
    blind, layout = learn.sight(scenario, True), observation_layout(scenario, learn.OBSERVE)
    echoes = [f.name for f in layout.table if blind[layout.starts[f.name]] == 0.0]
    assert echoes == [f.name for f in layout.table if f.name.startswith("echo")]
    assert learn.sight(scenario, False).all()
    env = learn.Sighted(SwarmVecEnv(scenario, 2, observe=learn.OBSERVE, max_cycles=3), blind)
    assert not env.reset()[:, blind == 0.0].any()
    for _ in range(4):
        observation, _, done, infos = env.step(np.zeros((env.num_envs, 2), np.float32))
        assert not observation[:, blind == 0.0].any()
        assert observation[:, blind == 1.0].any()
        assert not any(infos[row]["terminal_observation"][blind == 0.0].any() for row in np.flatnonzero(done))
    _, curve = learn.learn(0, True, 0.01, lambda _: None)
    assert curve[0]["agent_steps"] == "0"


@pytest.mark.docs
def test_the_shipped_page_is_made_of_the_shipped_rows():
    made = report(read_rows(DOCS / "hard_water.csv.gz"), read_rows(DOCS / "hard_water_learners.csv.gz"))
    assert (DOCS / "hard_water.md").read_text() == made
