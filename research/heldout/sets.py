"""Held-out sets: seeds, worlds, swarm sizes, losses, echoes and decision periods, unused in training and tuning."""

from typing import Any

from research.data import read_toml
from research.sets import EpisodeSet
from uuv_marl.benchmark.suite import NOTHING

_DATA: dict[str, Any] = read_toml("heldout", "sets.toml")
FIRST: int = _DATA["first"]
"""The first held-out seed of most sets; benchmarks count from 0, tuning and training use seeds from 10,000 on."""
GROUPS: dict[str, list[str]] = _DATA["groups"]
"""Policies by the name of their group."""
METRICS = ("task_time_s", "collisions", "min_obstacle_distance_m", "min_spacing_m")
"""Metrics of an episode that are kept."""


def _set(table: dict[str, Any]) -> EpisodeSet:
    """One table of ``sets.toml``: a number of seeds of each group of policies, or of a policy, from its first on."""
    counts = {policy: count for name, count in table["seeds"].items() for policy in GROUPS.get(name, [name])}
    first = table.get("first", FIRST)
    seeds = {policy: range(first, first + count) for policy, count in counts.items()}
    return EpisodeSet(table["name"], table["scenario"], seeds, table.get("overrides", NOTHING))


SETS = tuple(map(_set, _DATA["set"]))
"""The sets of ``sets.toml``, in the order of the page."""
