"""What a training may spend, and its curve: the same for every learner."""

import time
from collections.abc import Callable
from pathlib import Path

from research.episodes import Row
from research.learners.protocol import MEASURES, Task
from uuv_marl.train.validation import validate

Report = Callable[[float], None]
"""Called with the share of the budget that is spent."""


class Watch:
    """Counts processor time, measuring apart, and measures a policy in even parts of the budget.

    Args:
        task: what is learned.
        agent_steps: of the whole budget.
        minutes: of processor time, if that ends first.
        report: called as it goes on.
    """

    def __init__(self, task: Task, agent_steps: int, minutes: float, report: Report) -> None:
        self.curve: list[Row] = []
        """A row for each measurement."""
        self._training = task.training(steps=agent_steps)
        self._whole, self._minutes, self._report = agent_steps, minutes, report
        self._vehicles = task.num_vehicles
        self._begin, self._apart, self._best = time.process_time(), 0.0, -1.0

    @property
    def minutes(self) -> float:
        """Processor time so far, measuring apart [min]."""
        return (time.process_time() - self._begin - self._apart) / 60.0

    @property
    def late(self) -> bool:
        """Whether the processor time is spent."""
        return self.minutes >= self._minutes

    def share(self, agent_steps: int) -> float:
        """The part of the budget that is spent after so many agent-steps."""
        spent = max(agent_steps / self._whole, self.minutes / self._minutes)
        self._report(min(spent, 1.0))
        return spent

    def due(self, agent_steps: int) -> bool:
        """Whether the policy is to be measured now."""
        return len(self.curve) < MEASURES and self.share(agent_steps) * MEASURES >= len(self.curve) + 1

    def measure(self, policy: str, agent_steps: int) -> bool:
        """Run a policy on the episodes of validation, and note what came of it; whether it is the best so far."""
        minutes, begin = self.minutes, time.process_time()
        judged = validate(policy, self._training)
        self._apart += time.process_time() - begin
        self.curve.append(point(agent_steps, minutes, judged.share, judged.whole, judged.contacts / self._vehicles))
        better = judged.score >= self._best
        self._best = max(self._best, judged.score)
        return better


def point(agent_steps: int, minutes: float, share: float, whole: float, contacts: float) -> Row:
    """A row of a curve; the contacts are those of a vehicle."""
    return {
        "agent_steps": str(agent_steps), "minutes": f"{minutes:.2f}", "share": f"{share:.4f}", "whole": f"{whole:.4f}",
        "contacts": f"{contacts:.3f}",
    }  # fmt: skip


Trainer = Callable[[Task, int, Path, dict[str, object], int, float, Report], list[Row]]
"""Trains on a task with a seed, into a folder, with settings, for so many agent-steps or minutes; the curve. The folder
then holds the best policy, ``policy.safetensors``."""
