"""By what learners are compared: tasks, tiers of episodes, budgets, and each learner's settings (protocol.toml)."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from uuv_marl.benchmark.robustness.axes import AXES
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.training import Training, overrides_for

PROTOCOL = "protocol.toml"
_TOLD: dict[str, Any] = read_toml("learners", PROTOCOL)
TRAININGS: int = _TOLD["trainings"]
"""Of each learner on each task, with seeds from 0 on."""
AGENT_STEPS: int = _TOLD["agent_steps"]
MINUTES: float = _TOLD["minutes"]
MEASURES: int = _TOLD["measures"]
TRIED_ON: list[str] = _TOLD["tried_on"]
SEA, SEA_LEVEL = "sea", 1
"""Name of a set in the sea, and the level of the robustness axis ``X`` there."""


class Judged(NamedTuple):
    """Episodes of one kind."""

    name: str
    scenario: str
    overrides: Mapping[str, object]
    episodes: range
    """Their seeds."""


class Task(NamedTuple):
    """A scenario to learn, and the episodes by which it is judged."""

    name: str
    """That of the scenario."""
    num_vehicles: int
    policies: tuple[str, ...]
    """Run beside the learners: the best law without a privilege, then others."""
    tiers: tuple[tuple[Judged, ...], ...]
    """Sets of unseen seeds; of unseen sizes and ranges; of unseen kinds of maps and the sea."""

    @property
    def sets(self) -> tuple[Judged, ...]:
        """Of all tiers."""
        return tuple(each for tier in self.tiers for each in tier)

    @property
    def scenario(self) -> Scenario:
        """What is trained on, for every learner alike."""
        return load_scenario(self.name, num_vehicles=self.num_vehicles, overrides=overrides_for(self.name, {}))

    def training(self, **more: Any) -> Training:
        """A training of ours on it, which also says what validations are of all learners."""
        return Training(
            scenario=self.name, sizes=[self.num_vehicles], validations=MEASURES,
            validation_episodes=_TOLD["validation_episodes"], **more,
        )  # fmt: skip


class Learner(NamedTuple):
    """Who learns, and how."""

    name: str
    by: str
    """Whose trainer: ``own``, ``sb3``, ``benchmarl``."""
    tried: tuple[dict[str, object], ...]
    """Settings that were tried."""
    chosen: int
    """Which of them it has."""

    @property
    def settings(self) -> dict[str, object]:
        """What differs from the trainer's defaults."""
        return self.tried[self.chosen]


def _task(told: Mapping[str, Any]) -> Task:
    task: str = told["name"]
    own: dict[str, object] = {"swarm.num_vehicles": told["num_vehicles"]}
    seeds = [range(_TOLD["first"], _TOLD["first"] + count) for count in _TOLD["tiers"]]
    tiers: list[list[Judged]] = [[Judged(task, task, own, seeds[0])], [], []]
    for tier, key in ((1, "two"), (2, "three")):
        for change in told[key]:
            if change == SEA:
                sea = AXES["X"].overrides(SEA_LEVEL, load_scenario(task).trajectory.speed_mps)
                tiers[tier].append(Judged(f"{task}-{SEA}", task, own | sea, seeds[tier]))
            else:
                other = {**change}
                name, scenario = other.pop("name"), other.pop("scenario", task)
                tiers[tier].append(Judged(name, scenario, own | other if scenario == task else other, seeds[tier]))
    return Task(task, told["num_vehicles"], tuple(told["policies"]), tuple(map(tuple, tiers)))


TASKS = {told["name"]: _task(told) for told in _TOLD["tasks"]}
LEARNERS = {
    name: Learner(name, told["by"], tuple({**told["always"], **each} for each in told["tried"]), told["chosen"])
    for name, told in _TOLD["learners"].items()
}
