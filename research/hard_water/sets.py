"""What is run in hard water: every policy on maps of each tier, kind and size of swarm."""

from collections.abc import Iterator
from typing import Any

from research.data import read_toml
from research.sets import EpisodeSet

TOLD: dict[str, Any] = read_toml("hard_water", "sets.toml")
KINDS: list[str] = TOLD["trained"] + TOLD["held_out"]
METRICS = ("untouched_share", "whole", "time_ratio", "collisions", "min_obstacle_distance_m", "min_spacing_m")
"""What is kept of an episode."""


def set_name(tier: str, kind: str, num_vehicles: int) -> str:
    """How a set is named: ``medium-gate-10``."""
    return f"{tier}-{kind}-{num_vehicles}"


def _sets() -> Iterator[EpisodeSet]:
    runs: dict[tuple[str, int], list[str]] = {}
    for run in TOLD["runs"]:
        for tier in run["tiers"]:
            runs.setdefault((tier, run["num_vehicles"]), []).extend(TOLD["policies"][run["policies"]])
    for (tier, n), policies in runs.items():
        for kind in KINDS:
            changes = {"task.kinds": [kind], "swarm.num_vehicles": n}
            seeds = {policy: range(TOLD["maps"]) for policy in policies}
            yield EpisodeSet(set_name(tier, kind, n), TOLD["tiers"][tier], seeds, changes)


SETS = tuple(_sets())
"""Those of ``sets.toml``."""
