"""The sea trials: the shipped episodes are all that were planned, and the table says what they say."""

import itertools
from pathlib import Path

from research.dynamics.sea_trials import POLICIES, SCENARIOS, SEEDS
from research.episodes import read_rows
from uuv_marl.scenario import vehicle_names

SHIPPED = Path(__file__).parent.parent / "docs" / "sea-trials.csv.gz"


def test_the_shipped_episodes_are_all_that_are_planned():
    planned = itertools.product(SCENARIOS, vehicle_names(), POLICIES, map(str, range(SEEDS)))
    found = [tuple(row[name] for name in ("scenario", "vehicle", "policy", "seed")) for row in read_rows(SHIPPED)]
    assert found == list(planned)
