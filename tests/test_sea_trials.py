"""The sea trials: their table is made of the shipped episodes, which are all that were planned."""

import itertools
from pathlib import Path

import pytest

from research.dynamics import sea_trials
from research.dynamics.sea_trials import POLICIES, SCENARIOS, SEEDS, Episode
from uuv_marl.scenario import vehicle_names

SHIPPED = Path(__file__).parent.parent / "docs" / "sea-trials.csv"


def test_the_shipped_episodes_are_all_that_are_planned():
    episodes = sea_trials.read(SHIPPED)
    planned = itertools.product(SCENARIOS, vehicle_names(), POLICIES, range(SEEDS))
    assert [(e.scenario, e.vehicle, e.policy, e.seed) for e in episodes] == list(planned)
    for e in episodes:
        assert e.task_time_s is None or e.task_time_s >= e.duration_s - 1.0, e
        assert 0.0 <= e.effort <= 1.0


def test_a_run_is_kept_and_read_again(tmp_path, monkeypatch):
    monkeypatch.setattr(sea_trials, "SCENARIOS", ("sea_trial",))
    monkeypatch.setattr(sea_trials, "POLICIES", ("bio_inspired", "mappo"))
    monkeypatch.setattr(sea_trials, "SEEDS", 1)
    monkeypatch.setattr(sea_trials, "vehicle_names", lambda: ["lauv"])
    path = tmp_path / "episodes.csv"
    for _ in range(2):  # the second finds all of it
        sea_trials.run(tmp_path / "runs", path, lambda *a: None)
        episodes = sea_trials.read(path)
        assert [(e.vehicle, e.policy, e.seed) for e in episodes] == [("lauv", "bio_inspired", 0), ("lauv", "mappo", 0)]
    assert episodes[0].duration_s == pytest.approx(543.3, rel=0.01)
    head, *rows = sea_trials.table(episodes, "sea_trial")
    assert [row[:2] for row in rows] == [("`lauv`", "`bio_inspired`"), ("`lauv`", "`mappo`")]
    assert all(len(row) == len(head) for row in rows)


def test_a_row_says_what_its_episodes_say(monkeypatch):
    monkeypatch.setattr(sea_trials, "vehicle_names", lambda: ["lauv"])
    monkeypatch.setattr(sea_trials, "POLICIES", ("pull",))
    one = Episode("sea_trial", "lauv", "pull", 0, 110.0, 100.0, 0, 5.4, 2.16, 0.5)
    hit = one._replace(seed=1, task_time_s=130.0, collisions=3, min_obstacle_distance_m=-1.08, min_spacing_m=1.08)
    late = one._replace(seed=2, task_time_s=None, min_obstacle_distance_m=None, effort=0.2)
    _, row = sea_trials.table([one, hit, late], "sea_trial")
    assert row[2:] == ("2 of 3", "1 of 3", "3", "-1.08", "-1.0", "1.08", "1.0", "1.200", "0.400")
