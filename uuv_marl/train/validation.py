"""How good a policy is: deterministic episodes on validation seeds, through the benchmark's own ``evaluate``."""

import json
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import Run, episodes
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.scenario import load_scenario
from uuv_marl.scenario.overrides import leaves
from uuv_marl.train.rows import TRAINING_SEEDS
from uuv_marl.train.training import Part, Training, overrides_for

VALIDATION_SEEDS = TRAINING_SEEDS[1]
"""The first of the validation seeds: up to 999,999, which no training uses."""
_EVERY_POLICYS_OWN = ("sonar.channels", "actuators.yaw_damping_nms")


class Worst(NamedTuple):
    """An episode."""

    scenario: str
    vehicles: int
    seed: int


class Validation(NamedTuple):
    """Episodes of a validation."""

    swarm_success: float
    """Share of episodes in which all vehicles did their task, and nobody touched anything (``Task.metrics``)."""
    share: float
    """The task's headline, such as the share of vehicles that did theirs untouched; in ``follow`` that of swarms."""
    collisions: float
    """That began, mean over episodes."""
    time_s: float | None
    """Mean over whole episodes, of the time until the task was done."""
    worst: Worst
    """Of the fewest vehicles that did their task, then of the most contacts."""

    @property
    def score(self) -> float:
        """By which policies are chosen [1]: the mean of both shares."""
        return (self.swarm_success + self.share) / 2.0


def validate(policy: str, training: Training) -> Validation:
    """Run a policy, by its name or path, on a training's validation seeds, with each scenario and size of swarm."""
    number = max(1, training.validation_episodes // len(training.parts))
    seeds = range(VALIDATION_SEEDS, VALIDATION_SEEDS + number)
    runs = [(part, run) for part in training.parts for run in _runs(policy, part, seeds)]
    shares, swarm_success = zip(
        *(shares_of(run.metrics, part.scenario.task_class.headline) for part, run in runs), strict=True
    )
    times = [_end_s(run) for (_, run), all_did in zip(runs, swarm_success, strict=True) if all_did]
    collisions = [run.metrics["collisions"] for _, run in runs]
    part, run = runs[min(range(len(runs)), key=lambda k: (shares[k], -collisions[k]))]
    return Validation(
        swarm_success=len(times) / len(runs),
        share=sum(shares) / len(runs),
        collisions=sum(collisions) / len(runs),
        time_s=sum(times) / len(times) if times else None,
        worst=Worst(part.name, part.vehicles, run.seed),
    )


def _runs(policy: str, part: Part, seeds: Sequence[int]) -> Iterator[Run]:
    scenario = with_policy_requirements(policy, part.scenario)
    yield from (event for event in episodes(scenario, policy, seeds) if isinstance(event, Run))


def _end_s(run: Run) -> float:
    """When an episode's task was done, if it was."""
    arrived = run.metrics["task_time_s"]
    return float(run.routes.time_s[-1]) if arrived is None else arrived


def shares_of(metrics: Metrics, headline: str) -> tuple[float, bool]:
    """An episode's headline, and whether the swarm was whole; in ``follow`` whether it came and touched nothing."""
    own = metrics.get("task", {})
    if "swarm_success" not in own:
        swarm_success = metrics["task_time_s"] is not None and not metrics["collisions"]
        return float(swarm_success), swarm_success
    share = own.get(headline)
    return (own["success_share"] if share is None else share) or 0.0, own["swarm_success"] == 1.0


def replay_command(policy: Path, training: Training, worst: Worst) -> str:
    """The command that shows an episode of a validation."""
    name, n, seed = worst
    own = training.overrides if name == training.scenario else {}
    changes = {**leaves(overrides_for(name, own)), "swarm.num_vehicles": n}
    if n == load_scenario(name).swarm.num_vehicles:
        del changes["swarm.num_vehicles"]
    fields = {field: value for field, value in changes.items() if field not in _EVERY_POLICYS_OWN}
    sets = [f" --set {shlex.quote(f'{field}={json.dumps(value)}')}" for field, value in fields.items()]
    scenario, path = shlex.quote(name), shlex.quote(str(policy))
    return f"uuv-marl replay --scenario {scenario} --policy {path} --seed {seed}{''.join(sets)}"
