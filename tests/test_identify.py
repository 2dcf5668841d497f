"""Identification: its space, its errors, its search, and the result that ships."""

import numpy as np
import pytest

from research.columns import read_columns
from research.dynamics import identify, unknowns
from research.dynamics.unknowns import DEFAULTS, OBJECTIVES, UNKNOWNS, Numbers
from uuv_marl import load_scenario

HIT = Numbers(10.03, 12.29, 11.0, 205.0, 0.0)


def synthetic(values, seeds=None):
    """Numbers that depend smoothly on every unknown; a corner of the space fails."""
    share = [
        u.choices.index(values[name]) / (len(u.choices) - 1) if u.choices else (values[name] - u.low) / (u.high - u.low)
        for name, u in UNKNOWNS.items()
    ]
    mean = sum(share) / len(share)
    if share[0] > 0.9:
        return Numbers(failed=0.25)
    return Numbers(10.03 * (0.7 + mean), 12.29, 11.0 + 10 * share[3] * share[4], 205.0 * (1.2 - share[5] / 2), 0.0)


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


def test_failing_runs_are_dominated_by_any_that_succeed():
    worst = Numbers(0.1, 500.0, 5000.0, 1e6, 0.0)
    losses = np.array([unknowns.errors(n) for n in (worst, HIT._replace(failed=0.125), Numbers())])
    assert np.isfinite(losses).all()
    assert (losses[0] < losses[1]).all()
    assert (losses[1] < losses[2]).all()
    assert unknowns.front(losses) == [0]


class Killed(BaseException):
    """Optuna doesn't catch this one: it leaves the trial unfinished, as a lost machine does."""


@pytest.mark.parametrize("end", [KeyboardInterrupt, Killed])
def test_a_resumed_search_is_an_uninterrupted_one(tmp_path, monkeypatch, end):
    monkeypatch.setattr(unknowns, "measure", synthetic)
    monkeypatch.setattr(identify, "STARTUP", 4)
    seen = []
    identify.identify(tmp_path / "whole", 14, lambda done, best: seen.append((done, best)))

    def stops(values):
        calls.append(values)
        if len(calls) in {1, 10}:
            raise end
        return synthetic(values)

    calls = []
    monkeypatch.setattr(unknowns, "measure", stops)
    for _ in range(2):  # in the first trial, and once the optimiser has begun to learn
        with pytest.raises(end):
            identify.identify(tmp_path / "parts", 14, lambda done, best: None)
    identify.identify(tmp_path / "parts", 14, lambda done, best: None)
    for name in ("trials.csv", "identified.json"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    table = read_columns(tmp_path / "whole" / "trials.csv")
    assert {name: table[name][0] for name in UNKNOWNS} == DEFAULTS
    assert [done for done, _ in seen] == list(range(1, 15))
    assert seen[-1][1] == min(max(table[name][row] for name in OBJECTIVES) for row in range(14))


@pytest.fixture(scope="module")
def shipped():
    return identify.identified()


@pytest.mark.docs
def test_the_shipped_search_looked_at_two_scenarios_and_at_tuning_seeds_only(shipped):
    assert set(shipped["scenarios"]) == {"tracking", "single_obstacle"}
    assert all(10_000 <= seed < 100_000 for seed in shipped["seeds"])
    assert shipped["seeds"] == list(unknowns.SEEDS)
    assert set(shipped["space"]) == set(UNKNOWNS)


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
