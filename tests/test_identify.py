"""Identification: its space, its errors, its search, and the result that ships."""

import pytest

from research.dynamics import identify, unknowns
from research.dynamics.unknowns import DEFAULTS, OBJECTIVES, UNKNOWNS, Numbers
from uuv_marl import load_scenario

HIT = Numbers(10.03, 12.29, 11.0, 205.0, 0.0)


@pytest.mark.parametrize("name", ["tracking", "single_obstacle", "multi_obstacle"])
def test_the_defaults_change_nothing(name):
    choice = unknowns.case(DEFAULTS, name)
    assert choice.load() == load_scenario(name)
    assert choice.parameters == {"obstacle_term": "per_echo"}


@pytest.mark.parametrize("name", UNKNOWNS)
def test_every_unknown_has_an_effect_and_holds_its_default(name):
    unknown = UNKNOWNS[name]
    ends = unknown.choices or (unknown.low, unknown.high)
    assert unknown.default in unknown.choices if unknown.choices else unknown.low <= unknown.default <= unknown.high
    made = [unknowns.case({**DEFAULTS, name: end}, "tracking") for end in ends]
    assert made[0] != made[1]
    for choice in made:
        choice.load()


def test_errors_are_relative_and_none_inside_the_papers_range():
    assert unknowns.errors(HIT) == (0.0, 0.0, 0.0)
    assert unknowns.errors(HIT._replace(min_obstacle_distance_m=10.48))[1] == 0.0
    assert unknowns.errors(HIT._replace(min_obstacle_distance_m=12.63 * 1.1))[1] == pytest.approx(0.1)
    assert unknowns.errors(HIT._replace(min_obstacle_distance_m=10.48 * 0.9))[1] == pytest.approx(0.1)
    assert unknowns.errors(HIT._replace(task_time_s=205.0 * 1.02))[2] == pytest.approx(0.02)
    spacing = HIT._replace(min_spacing_m=10.03 * 0.98, mean_min_spacing_m=12.29 * 0.93)
    assert unknowns.errors(spacing)[0] == pytest.approx(0.07)


@pytest.fixture(scope="module")
def shipped():
    return identify.identified()


@pytest.mark.docs
def test_the_shipped_front_follows_from_the_shipped_trials(shipped):
    table = identify.trials()
    members, chosen = identify.pareto(table)
    assert len(table["trial"]) == shipped["trials"]
    assert [member["trial"] for member in shipped["front"]] == members
    assert shipped["chosen"]["trial"] == chosen
    assert shipped["defaults"]["values"] == DEFAULTS
    for member in (*shipped["front"], shipped["chosen"], shipped["defaults"]):
        row = member["trial"]
        for part in ("values", "numbers", "errors"):
            for name, value in member[part].items():
                assert table[name][row] == value
    for row in range(len(table["trial"])):
        numbers = Numbers(*(float(table[name][row]) for name in Numbers._fields))
        again = unknowns.errors(numbers)
        assert again == pytest.approx([table[name][row] for name in OBJECTIVES], abs=2e-5)


@pytest.mark.docs
def test_the_shipped_point_is_loaded_and_runs_as_recorded(shipped):
    assert shipped["all_within_5_percent"] == (max(shipped["chosen"]["errors"].values()) <= identify.GOAL)
    numbers = unknowns.measure(shipped["chosen"]["values"])
    for name, value in shipped["chosen"]["numbers"].items():
        assert getattr(numbers, name) == pytest.approx(value, rel=0.02)
