"""Tasks: what a swarm is to do, one file each. ``Task`` is the base of your own.

``uuv_marl.scenario.task`` finds a task by the name that a scenario gives, so that the water can ask it what to draw.
"""

from uuv_marl.tasks.follow import Follow
from uuv_marl.tasks.hard_water import HardWater
from uuv_marl.tasks.reach import Reach
from uuv_marl.tasks.task import Task

TASKS: dict[str, type[Task]] = {
    "follow": Follow,
    "reach": Reach,
    "hard_water": HardWater,
}
"""Every task that ships with the package."""

__all__ = ["TASKS", "Follow", "HardWater", "Reach", "Task"]
