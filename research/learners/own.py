"""Our own trainer as a learner."""

from research.episodes import Row
from research.learners.watch import Asked, point
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.train.run import train
from uuv_marl.train.training import Training, changed_fields


def learn(asked: Asked) -> list[Row]:
    """As ``watch.Trainer`` says. Without a cost of contacts beyond the reward, which no other learner has."""
    told = asked.task.training(steps=asked.agent_steps, seed=asked.seed).model_dump(mode="json")
    training = Training(**changed_fields(told, {"ppo.contact_cost": [0.0, 0.0], **asked.settings}))
    curve: list[Row] = []
    for record in train(asked.folder / "run", training):
        minutes, steps = record.seconds / 60.0, record.agent_steps
        asked.report(max(steps / asked.agent_steps, minutes / asked.minutes))
        if record.share is not None and record.whole is not None and record.contacts is not None:
            contacts = record.contacts / asked.task.num_vehicles
            curve.append(point(steps, minutes, record.share, record.whole, contacts))
        if minutes >= asked.minutes:
            break
    (asked.folder / "run" / "best" / WEIGHTS_FILE).replace(asked.folder / WEIGHTS_FILE)
    return curve
