"""Our own trainer as a learner."""

from pathlib import Path
from threading import Event
from typing import Any

from research.episodes import Row
from research.learners.watch import TrainingRequest, point
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.train.run import train
from uuv_marl.train.training import Training, changed_fields
from uuv_marl.train.validation import validate


def learn(asked: TrainingRequest) -> list[Row]:
    """A ``watch.Trainer``. Without a cost of collisions beyond the reward, as for all learners.

    Noise, rate and measurements follow the budget that is spent first: with a memory the time, else the agent-steps.
    """
    budget: dict[str, Any] = (
        {"minutes": asked.minutes} if asked.settings.get("network.memory") else {"steps": asked.agent_steps}
    )
    settings = asked.task.training(**budget, seed=asked.seed).model_dump(mode="json")
    training = Training(**changed_fields(settings, {"ppo.collision_cost": [0.0, 0.0], **asked.settings}))
    curve: list[Row] = []
    run, spent, n = asked.folder / "run", Event(), asked.task.num_vehicles
    for record in train(run, training, stop=spent.is_set):
        minutes, steps, best = record.seconds / 60.0, record.agent_steps, record.best
        share = max(steps / asked.agent_steps, minutes / asked.minutes)
        asked.report(share)
        if record.share is not None and record.swarm_success is not None and record.collisions is not None:
            curve.append(point(steps, minutes, record.share, record.swarm_success, record.collisions / n))
        elif spent.is_set():  # the other budget ended first
            last = max((run / "checkpoints").iterdir())
            judged = validate(str(last), training)
            curve.append(point(steps, minutes, judged.share, judged.swarm_success, judged.collisions / n))
            if best is None or judged.score >= best:
                return _keep_best(last, asked, curve)
        if share >= 1.0:
            spent.set()
    return _keep_best(run / "best", asked, curve)


def _keep_best(policy: Path, asked: TrainingRequest, curve: list[Row]) -> list[Row]:
    (policy / WEIGHTS_FILE).replace(asked.folder / WEIGHTS_FILE)
    return curve
