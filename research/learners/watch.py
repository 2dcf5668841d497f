"""Budget and curve of a training, the same for every learner."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from research.episodes import Row
from research.learners.protocol import MEASURES, Task
from uuv_marl.train.validation import validate

Report = Callable[[float], None]
"""Called with the share of the budget that is spent."""


class TrainingRequest(NamedTuple):
    """The training that a trainer has to run."""

    task: Task
    seed: int
    folder: Path
    """Folder of the best policy, ``policy.safetensors``."""
    settings: dict[str, Any]
    """Settings that differ from the trainer's defaults."""
    agent_steps: int
    """Budget of agent-steps."""
    minutes: float
    """Budget of processor time [min]; the training ends with the first that is spent."""
    report: Report


Trainer = Callable[[TrainingRequest], list[Row]]
"""Trains, writes its best policy, and returns the curve: a row for each measurement."""


class Watch:
    """Counts processor time without measuring, and measures a policy at equal parts of the budget."""

    def __init__(self, asked: TrainingRequest) -> None:
        self.curve: list[Row] = []
        """A row for each measurement."""
        self._asked, self._training = asked, asked.task.training(steps=asked.agent_steps)
        self._begin, self._apart, self._best = time.process_time(), 0.0, -1.0

    @property
    def minutes(self) -> float:
        """Processor time so far without measuring [min]."""
        return (time.process_time() - self._begin - self._apart) / 60.0

    @property
    def late(self) -> bool:
        """Whether the processor time is spent."""
        return self.minutes >= self._asked.minutes

    def share(self, agent_steps: int) -> float:
        """Share of the budget that is spent after a number of agent-steps."""
        spent = max(agent_steps / self._asked.agent_steps, self.minutes / self._asked.minutes)
        self._asked.report(min(spent, 1.0))
        return spent

    def due(self, agent_steps: int) -> bool:
        """Whether the policy is to be measured now."""
        return len(self.curve) < MEASURES and self.share(agent_steps) * MEASURES >= len(self.curve) + 1

    def measure(self, policy: str, agent_steps: int) -> bool:
        """Run a policy on the validation episodes, and record the results; whether it is the best so far."""
        minutes, begin, vehicles = self.minutes, time.process_time(), self._asked.task.num_vehicles
        judged = validate(policy, self._training)
        self._apart += time.process_time() - begin
        self.curve.append(point(agent_steps, minutes, judged.share, judged.swarm_success, judged.collisions / vehicles))
        better = judged.score >= self._best
        self._best = max(self._best, judged.score)
        return better


def point(agent_steps: int, minutes: float, share: float, success: float, collisions: float) -> Row:
    """A row of a curve; collisions are per vehicle."""
    return {
        "agent_steps": str(agent_steps), "minutes": f"{minutes:.2f}", "share": f"{share:.4f}",
        "swarm_success": f"{success:.4f}",
        "collisions_per_vehicle": f"{collisions:.3f}",
    }  # fmt: skip
