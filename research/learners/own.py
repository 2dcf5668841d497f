"""Our own trainer as a learner."""

from pathlib import Path
from typing import Any

from research.episodes import Row
from research.learners.protocol import Task
from research.learners.watch import Report, point
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.errors import ResultsError
from uuv_marl.train.run import train
from uuv_marl.train.training import Training, changed_fields


def learn(
    task: Task, seed: int, folder: Path, settings: dict[str, object], agent_steps: int, minutes: float, report: Report
) -> list[Row]:
    """As ``watch.Trainer`` says. Without a cost of contacts beyond the reward, which no other learner has."""
    told: dict[str, Any] = task.training(steps=agent_steps, seed=seed).model_dump(mode="json")
    training = Training(**changed_fields(told, {"ppo.contact_cost": [0.0, 0.0], **settings}))
    curve: list[Row] = []
    for record in train(folder / "run", training):
        report(max(record.agent_steps / agent_steps, record.seconds / 60.0 / minutes))
        if record.share is not None and record.whole is not None and record.contacts is not None:
            curve.append(
                point(
                    record.agent_steps,
                    record.seconds / 60.0,
                    record.share,
                    record.whole,
                    record.contacts / task.num_vehicles,
                )
            )
        if record.seconds > 60.0 * minutes:
            raise ResultsError(f"{agent_steps:,} agent-steps take longer than {minutes:g} minutes here; lower them")
    (folder / "run" / "best" / WEIGHTS_FILE).replace(folder / WEIGHTS_FILE)
    return curve
