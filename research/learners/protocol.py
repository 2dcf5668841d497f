"""Protocol of the comparison of learners: tasks, tiers of episodes, budgets and settings, from protocol.toml."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from research.data import read_toml
from uuv_marl.benchmark.robustness.axes import AXES
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.training import Training, overrides_for

PROTOCOL = "protocol.toml"
_DATA: dict[str, Any] = read_toml("learners", PROTOCOL)
TRAININGS: int = _DATA["trainings"]
"""Number of trainings of each learner on each task, with seeds from 0 on."""
AGENT_STEPS: int = _DATA["agent_steps"]
MINUTES: float = _DATA["minutes"]
MEASURES: int = _DATA["measures"]
TIE: float = _DATA["tie"]
FLOOR: float = _DATA["floor"]
TUNING: dict[str, Any] = _DATA["tuning"]
"""Tasks, budget, seeds and number of kept settings of the trials."""
DISTURBED, LEVEL = "disturbed", 1
"""Name of a set with disturbances, and its level of the robustness axis ``X``."""


class EvaluationSet(NamedTuple):
    """Episodes of one kind."""

    name: str
    scenario: str
    overrides: Mapping[str, object]
    episodes: range
    """Their seeds."""


class Task(NamedTuple):
    """A scenario to learn, and the episodes of its evaluation."""

    name: str
    """Name of the scenario."""
    num_vehicles: int
    policies: tuple[str, ...]
    """Policies to compare with: first the best controller without extra observations, then others."""
    tiers: tuple[tuple[EvaluationSet, ...], ...]
    """Sets of unseen seeds; of unseen sizes and ranges; of unseen kinds of maps and of disturbances."""
    channels: tuple[str, ...]
    """Channels that all learners observe beyond the sonar."""
    challenge: bool
    """Whether it is in no aggregate."""
    learners: tuple[str, ...]
    """Learners that are trained on it."""

    @property
    def sets(self) -> tuple[EvaluationSet, ...]:
        """The sets of all tiers."""
        return tuple(each for tier in self.tiers for each in tier)

    @property
    def scenario(self) -> Scenario:
        """The scenario of the trainings, the same for all learners."""
        return load_scenario(self.name, num_vehicles=self.num_vehicles, overrides=self.overrides)

    @property
    def overrides(self) -> dict[str, object]:
        """Fields of the scenario that trainings change."""
        return overrides_for(self.name, _channels(self.channels))

    def training(self, **more: Any) -> Training:
        """A training with our trainer, which also determines the validations of all learners."""
        return Training(
            scenario=self.name, sizes=[self.num_vehicles], validations=MEASURES,
            validation_episodes=_DATA["validation_episodes"], overrides=_channels(self.channels), **more,
        )  # fmt: skip


class Learner(NamedTuple):
    """A learning algorithm with its settings."""

    name: str
    trainer: str
    """``own``, ``sb3`` or ``benchmarl``."""
    tried: tuple[dict[str, object], ...]
    """Settings that were tried."""
    chosen: int
    """Index of the chosen ones among them."""

    @property
    def settings(self) -> dict[str, object]:
        """Settings that differ from the trainer's defaults."""
        return self.tried[self.chosen]


def _channels(names: Sequence[str]) -> dict[str, object]:
    return {"sonar.channels": list(names)} if names else {}


def _task(table: Mapping[str, Any]) -> Task:
    task: str = table["name"]
    channels: tuple[str, ...] = tuple(table.get("channels", ()))
    added = _channels(channels)
    own: dict[str, object] = {"swarm.num_vehicles": table["num_vehicles"], **added}
    seeds = [range(_DATA["first"], _DATA["first"] + count) for count in _DATA["tiers"]]
    tiers: list[list[EvaluationSet]] = [[EvaluationSet(task, task, own, seeds[0])], [], []]
    for tier, key in ((1, "two"), (2, "three")):
        for change in table[key]:
            if change == DISTURBED:
                changes = AXES["X"].overrides(LEVEL, load_scenario(task).trajectory.speed_mps)
                tiers[tier].append(EvaluationSet(f"{task}-{DISTURBED}", task, own | changes, seeds[tier]))
            else:
                other = {**change}
                name, scenario = other.pop("name"), other.pop("scenario", task)
                tiers[tier].append(
                    EvaluationSet(name, scenario, (own if scenario == task else added) | other, seeds[tier])
                )
    return Task(
        task, table["num_vehicles"], tuple(table["policies"]), tuple(map(tuple, tiers)), channels,
        table.get("challenge", False), tuple(table.get("learners", _DATA["learners"])),
    )  # fmt: skip


TASKS = {table["name"]: _task(table) for table in _DATA["tasks"]}
AGGREGATED = [name for name, task in TASKS.items() if not task.challenge]
"""Tasks of the aggregates, of which one at the floor still leaves."""
LEARNERS = {
    name: Learner(
        name, table["trainer"], tuple({**table["always"], **each} for each in table["tried"]), table["chosen"]
    )
    for name, table in _DATA["learners"].items()
}
