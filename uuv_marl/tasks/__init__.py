"""Tasks, one file each. ``Task`` is the base of your own; ``uuv_marl.scenario.task`` finds a scenario's by name."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uuv_marl.tasks.follow import Follow
    from uuv_marl.tasks.task import Task

__all__ = ["TASKS", "Follow", "Task"]

TASKS = {
    "follow": "uuv_marl.tasks.follow:Follow",
    "reach": "uuv_marl.tasks.reach:Reach",
    "hard_water": "uuv_marl.tasks.hard_water:HardWater",
    "two_swarms": "uuv_marl.tasks.two_swarms:TwoSwarms",
    "few_informed": "uuv_marl.tasks.few_informed:FewInformed",
    "silent_targets": "uuv_marl.tasks.silent_targets:SilentTargets",
}
"""The shipped tasks by name: where each class is, imported on first use."""


def __getattr__(name: str) -> Any:
    """A class by its name, imported on first use, so that a scenario is read without the simulation."""
    if name not in ("Follow", "Task"):
        raise AttributeError(f"module 'uuv_marl.tasks' has no attribute {name!r}")
    return getattr(importlib.import_module(f"uuv_marl.tasks.{name.lower()}"), name)
