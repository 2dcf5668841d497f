"""What is run for each task: policies on sets of episodes, and what a plain learner trains on."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from research.sets import EpisodeSet

_TOLD: dict[str, Any] = read_toml("tasks", "studies.toml")
SEEDS: int = _TOLD["seeds"]
"""Episodes of each policy on each set, from seed 0 on."""
METRICS = ("untouched_share", "whole", "time_ratio", "collisions", "min_obstacle_distance_m", "min_spacing_m")
"""What is kept of an episode."""


SIZE = "swarm.num_vehicles"


class Study(NamedTuple):
    """What is run for a task."""

    sets: Mapping[str, EpisodeSet]
    """By name."""
    learns: str
    """The scenario that a plain learner trains on."""
    worlds: int
    """How many it trains in."""
    judged: tuple[str, ...]
    """Names of the sets that it is judged on, of the scenario's own size."""


def set_name(scenario: str, kind: str = "", num_vehicles: int = 0) -> str:
    """``two_swarms_easy``, ``hard_water-gate``, ``hard_water-gate-54``."""
    return "-".join([scenario, *([kind] if kind else []), *([str(num_vehicles)] if num_vehicles else [])])


def _study(told: dict[str, Any]) -> Study:
    """One table of ``studies.toml``."""
    changes: dict[str, tuple[str, dict[str, object]]] = {}
    policies: dict[str, dict[str, range]] = {}
    for run in told["runs"]:
        n = run.get("num_vehicles", 0)
        for scenario in run["scenarios"]:
            for kind in run.get("kinds", [""]):
                name = set_name(scenario, kind, n)
                own: dict[str, object] = {"task.kinds": [kind]} if kind else {}
                changes[name] = scenario, (own | {SIZE: n} if n else own)
                policies.setdefault(name, {}).update(dict.fromkeys(_TOLD["policies"][run["policies"]], range(SEEDS)))
    sets = {name: EpisodeSet(name, scenario, policies[name], own) for name, (scenario, own) in changes.items()}
    judged = tuple(name for name, (_, own) in changes.items() if name.startswith(told["judged"]) and SIZE not in own)
    return Study(sets, told["learns"], told["worlds"], judged)


STUDIES = {name: _study(_TOLD[name]) for name in ("hard_water", "two_swarms")}
"""By task."""
SETS = tuple(each for study in STUDIES.values() for each in study.sets.values())
"""All of them."""
