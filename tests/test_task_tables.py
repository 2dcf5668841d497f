"""Research on tasks: what is run, the page by hand, a blind policy, and the shipped pages from the shipped rows."""

import numpy as np
import pytest

from research.blind import Blind
from research.episodes import read_rows
from research.tasks.page import report
from research.tasks.studies import STUDIES, set_name
from tests.processes import ROOT
from tests.swarms import fly, piloted
from uuv_marl import load_scenario
from uuv_marl.percept import Percept
from uuv_marl.tasks.maps.kinds import KINDS

DOCS = ROOT / "docs"
STUDY = STUDIES["hard_water"]


def rows(policy, share):
    told = dict.fromkeys(STUDY.metrics, "1.000") | {"success_share": f"{share:.3f}", "swarm_success": "0.000"}
    return [{"set": name, "policy": policy, "seed": str(seed), **told} for name in STUDY.sets for seed in range(3)]


def test_reported_episodes_count_from_zero_and_every_set_is_what_its_name_says():
    for study in STUDIES.values():
        assert study.own
        for name, each in study.sets.items():
            case = next(iter(each.cases(None).values()))
            scenario = case.load()
            kind, n = getattr(scenario.task_numbers, "kinds", [""])[0], scenario.swarm.num_vehicles
            usual, informed = load_scenario(scenario.name), case.overrides.get("task.informed", 0)
            kind = "final" if name in study.final.values() else kind
            assert name == set_name(scenario.name, kind, informed or (0 if n == usual.swarm.num_vehicles else n))
            assert case.seeds == (range(20_000, 21_000) if name.endswith("-final") else range(100))
    assert [*STUDY.own] == [set_name("hard_water", kind) for kind in KINDS]


def test_the_page_by_hand():
    done = [*rows("scout", 0.5), *rows("apf", 0.25), *rows("oracle", 1.0), *rows("olfati_saber_informed", 0.9)]
    done += [
        *rows("sdc", 0.3),
        *rows("mappo", 0.75),
        *rows("mappo_2", 0.25),
        *rows("research.blind:Blind,inner=mappo", 0.25),
    ]
    done += [row for row in rows("idle", 0.0) if row["set"].endswith("-final") and row["seed"] == "0"]
    text = report("hard_water", done)
    assert "| scout | .50 [.50, .50], .00 | .50 [.50, .50], .00 | .50 [.50, .50], .00 |" in text
    assert "| oracle with path, link | 1.00, .00 | 1.00, .00 |" in text
    assert "| sdc with compass, link, identity | .30, .00 | .30, .00 |" in text
    assert "| scout |" + " .50, .00 |" * 7 + " 1.00 | 0.10 | 1.0 m | 1.0 m |" in text
    assert "| mappo" + " | .75 [.75, .75], .00 | .25 [.25, .25] over scout" * 2 + " |" in text
    assert "| mappo, 2 trainings" + " | .50 [.25, .75], .00 | .00 [-.25, .25] over scout" * 2 + " |" in text
    assert "The others, on the first 1 of these seeds: on `hard_water` idle .00; on `hard_water_hard` idle .00." in text
    assert "| research.blind:Blind,inner=mappo | .25 [.25, .25], .00 |  |" in text


def test_a_blind_policy_hears_no_echo_and_all_else():
    swarm, sighted = piloted("mappo", "hard_water", worlds=2, seed=10_100, n=4)
    blind = Blind(swarm.scenario, 2, inner="mappo")
    percept = fly(swarm, sighted, 60)
    assert percept["echo"].any()
    unheard = Percept(percept.flat.copy(), percept.layout)
    for name in ("echo", "echo_range", "echo_position"):
        unheard[name][...] = 0.0
    np.testing.assert_array_equal(blind.act(percept), sighted.act(unheard))
    assert not np.array_equal(blind.act(percept), sighted.act(percept))
    assert percept["echo"].any()


@pytest.mark.docs
@pytest.mark.parametrize("task", [task for task in STUDIES if (DOCS / f"{task}.csv.gz").exists()])
def test_the_shipped_page_is_made_of_the_shipped_rows(task):
    made = report(task, read_rows(DOCS / f"{task}.csv.gz"))
    assert (DOCS / f"{task}.md").read_text() == made
