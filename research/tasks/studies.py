"""What is run for each task: policies on sets of episodes."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from research.sets import EpisodeSet

_DATA: dict[str, Any] = read_toml("tasks", "studies.toml")
SEEDS: int = _DATA["seeds"]
"""Episodes of each policy on each set, from seed 0 on."""
_FINAL = "final"
"""Seeds of a final set, and the end of its name; a policy runs on them only after its weights are frozen."""
SIZE, INFORMED = "swarm.num_vehicles", "task.informed"


class Study(NamedTuple):
    """What is run for a task."""

    sets: Mapping[str, EpisodeSet]
    """Sets by name."""
    medium: str
    """The scenario of the medium tier."""
    own: tuple[str, ...]
    """Names of the sets that differ from their scenario in the kind of map only."""
    metrics: tuple[str, ...]
    """The metrics that a row of an episode holds."""
    failures: tuple[str, ...]
    """The policies whose failures are counted, the first with a picture."""

    @property
    def headline(self) -> str:
        """The metric by which policies are compared."""
        return self.metrics[0]

    @property
    def final(self) -> Mapping[str, str]:
        """Final sets by scenario."""
        return {each.scenario: name for name, each in self.sets.items() if name.endswith(f"-{_FINAL}")}


def set_name(scenario: str, kind: str = "", number: int = 0) -> str:
    """``two_swarms_easy``, ``hard_water-gate``, ``hard_water-gate-54``: the number of vehicles, or of the informed."""
    return "-".join([scenario, *([kind] if kind else []), *([str(number)] if number else [])])


def _study(task: str, table: dict[str, Any]) -> Study:
    """One table of ``studies.toml``."""
    changes: dict[str, tuple[str, dict[str, object]]] = {}
    policies: dict[str, dict[str, range]] = {}
    for run in table["runs"]:
        own = {field: run[key] for field, key in ((SIZE, "num_vehicles"), (INFORMED, "informed")) if key in run}
        seeds = range(*run.get(_FINAL, (SEEDS,)))
        for scenario in run["scenarios"]:
            for kind in run.get("kinds", [_FINAL if _FINAL in run else ""]):
                name = set_name(scenario, kind, *own.values())
                changes[name] = scenario, ({"task.kinds": [kind], **own} if "kinds" in run else own)
                policies.setdefault(name, {}).update(dict.fromkeys(_DATA["policies"][run["policies"]], seeds))
    sets = {name: EpisodeSet(name, scenario, policies[name], own) for name, (scenario, own) in changes.items()}
    own = (
        name for name, (scenario, fields) in changes.items()
        if scenario == task and not name.endswith(_FINAL) and not {SIZE, INFORMED} & {*fields}
    )  # fmt: skip
    return Study(sets, task, tuple(own), tuple(table["metrics"]), tuple(table["failures"]))


STUDIES = {name: _study(name, _DATA[name]) for name in ("hard_water", "two_swarms", "few_informed", "silent_targets")}
"""Studies by task."""
SETS = tuple(each for study in STUDIES.values() for each in study.sets.values())
"""All sets."""
METRICS = frozenset(name for study in STUDIES.values() for name in study.metrics)
"""All metrics of all tasks."""
