"""Tasks: what a swarm is to do, one file each. ``Task`` is the base of your own.

``uuv_marl.scenario.task`` finds a task by the name that a scenario gives, so that the water can ask it what to draw.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uuv_marl.tasks.few_informed import FewInformed
    from uuv_marl.tasks.follow import Follow
    from uuv_marl.tasks.hard_water import HardWater
    from uuv_marl.tasks.reach import Reach
    from uuv_marl.tasks.silent_targets import SilentTargets
    from uuv_marl.tasks.task import Task
    from uuv_marl.tasks.two_swarms import TwoSwarms

__all__ = ["TASKS", "FewInformed", "Follow", "HardWater", "Reach", "SilentTargets", "Task", "TwoSwarms"]

TASKS = {
    "follow": "uuv_marl.tasks.follow:Follow",
    "reach": "uuv_marl.tasks.reach:Reach",
    "hard_water": "uuv_marl.tasks.hard_water:HardWater",
    "two_swarms": "uuv_marl.tasks.two_swarms:TwoSwarms",
    "few_informed": "uuv_marl.tasks.few_informed:FewInformed",
    "silent_targets": "uuv_marl.tasks.silent_targets:SilentTargets",
}
"""Every task that ships with the package: where its class is, imported when a swarm is to do it."""


def __getattr__(name: str) -> Any:
    """A class by its name, imported on first use: a scenario can be read without the simulation."""
    homes = {"Task": "uuv_marl.tasks.task"} | {
        place.partition(":")[2]: place.partition(":")[0] for place in TASKS.values()
    }
    if name in homes:
        return getattr(importlib.import_module(homes[name]), name)
    raise AttributeError(f"module 'uuv_marl.tasks' has no attribute {name!r}")
