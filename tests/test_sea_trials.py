"""The sea trials: the shipped episodes are all that were planned, and the table says what they say."""

import itertools
from pathlib import Path

from research.dynamics import sea_trials
from research.dynamics.sea_trials import POLICIES, SCENARIOS, SEEDS
from research.episodes import read_rows
from uuv_marl.scenario import vehicle_names

SHIPPED = Path(__file__).parent.parent / "docs" / "sea-trials.csv.gz"


def test_the_shipped_episodes_are_all_that_are_planned():
    planned = itertools.product(SCENARIOS, vehicle_names(), POLICIES, map(str, range(SEEDS)))
    found = [tuple(row[name] for name in ("scenario", "vehicle", "policy", "seed")) for row in read_rows(SHIPPED)]
    assert found == list(planned)


def test_a_run_is_kept_and_read_again(tmp_path, monkeypatch):
    monkeypatch.setattr(sea_trials, "SCENARIOS", ("sea_trial",))
    monkeypatch.setattr(sea_trials, "POLICIES", ("bio_inspired", "mappo"))
    monkeypatch.setattr(sea_trials, "SEEDS", 1)
    monkeypatch.setattr(sea_trials, "vehicle_names", lambda: ["lauv"])
    shipped = read_rows(SHIPPED)
    for _ in range(2):  # the second finds all of it
        rows = read_rows(sea_trials.run(tmp_path, lambda *a: None))
        assert [(row["vehicle"], row["policy"], row["seed"]) for row in rows] == [
            ("lauv", "bio_inspired", "0"), ("lauv", "mappo", "0")
        ]  # fmt: skip
    assert all(row.keys() == shipped[0].keys() for row in rows)
    assert sea_trials.table(rows) == [("policy", "`lauv`"), ("`bio_inspired`", "1"), ("`mappo`", "1")]
