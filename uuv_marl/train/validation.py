"""Validation of a policy: deterministic episodes on validation seeds, run by the benchmark."""

import json
from pathlib import Path
from typing import NamedTuple

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import Run, episodes
from uuv_marl.benchmark.metrics import shares_of
from uuv_marl.replay.command import command
from uuv_marl.scenario import load_scenario
from uuv_marl.scenario.overrides import leaves
from uuv_marl.train.rows import TRAINING_SEEDS
from uuv_marl.train.training import Training, overrides_for

VALIDATION_SEEDS = TRAINING_SEEDS[1]
"""First validation seed; training uses none from here to 999,999."""
_EVERY_POLICYS_OWN = ("sonar.channels", "actuators.yaw_damping_nms")


class Worst(NamedTuple):
    """An episode."""

    scenario: str
    vehicles: int
    seed: int


class Validation(NamedTuple):
    """Results of a validation."""

    swarm_success: float
    """Share of episodes in which all vehicles succeed without a collision (``Task.metrics``)."""
    share: float
    """Mean headline of the task, such as the share of vehicles that succeed; in ``follow`` ``swarm_success``."""
    collisions: float
    """Mean number of collisions of an episode."""
    time_s: float | None
    """Mean time to complete the task over successful episodes [s]; None without any."""
    worst: Worst
    """The episode with the lowest headline, then with the most collisions."""

    @property
    def score(self) -> float:
        """Mean of both shares, by which the best policy is chosen [1]."""
        return (self.swarm_success + self.share) / 2.0


def validate(policy: str, training: Training) -> Validation:
    """Run a policy, by its name or path, with the training's ``others`` on the validation seeds of each part."""
    policy = training.team(policy).name if training.others else policy
    number = max(1, training.validation_episodes // len(training.parts))
    seeds = range(VALIDATION_SEEDS, VALIDATION_SEEDS + number)
    runs = [(part, run) for part in training.parts
            for run in episodes(with_policy_requirements(policy, part.scenario), policy, seeds)]  # fmt: skip
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


def _end_s(run: Run) -> float:
    """Time at which a successful episode completed its task [s]."""
    arrived = run.metrics["task_time_s"]
    followed = "swarm_success" not in run.metrics.get("task", {})
    return arrived if followed and arrived is not None else float(run.routes.time_s[-1])


def replay_command(policy: Path, training: Training, worst: Worst) -> str:
    """The command that shows an episode of a validation."""
    name, n, seed = worst
    own = training.overrides if name == training.scenario else {}
    changes = {**leaves(overrides_for(name, own)), "swarm.num_vehicles": n}
    if n == load_scenario(name).swarm.num_vehicles:
        del changes["swarm.num_vehicles"]
    sets = [f"{field}={json.dumps(value)}" for field, value in changes.items() if field not in _EVERY_POLICYS_OWN]
    swarm = training.team(str(policy)).name if training.others else str(policy)
    return command(name, swarm, seed, sets)
