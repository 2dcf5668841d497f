"""Task of a scenario and the task's own numbers; ``uuv_marl.tasks`` holds the tasks."""

from typing import Any, cast

from pydantic import ConfigDict, ValidationError

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.modules import named_object
from uuv_marl.scenario.fields import Section
from uuv_marl.scenario.messages import explain


class TaskSettings(Section):
    """The task: its name, and numbers of its own, which its class validates."""

    model_config = ConfigDict(extra="allow")

    name: str
    """One of ``uuv_marl.tasks.TASKS``, or ``module:Class`` for a user's own."""


def named_task(value: Any) -> Any:
    """A table with a task's name, if only the name is given."""
    if isinstance(value, type):
        raise ValueError(f"must be a name; give module:Class, such as '{value.__module__}:{value.__qualname__}'")
    return {"name": value} if isinstance(value, str) else value


def shipped_tasks() -> dict[str, str]:
    """Module and class of each shipped task, by its name, without importing a task."""
    return cast(dict[str, str], named_object("uuv_marl.tasks:TASKS"))


def check_task(task: TaskSettings) -> None:
    """Raise ScenarioError for an unknown task or invalid numbers.

    A shipped task without numbers is not checked until a swarm is made, so that reading a scenario does not import the
    simulation.
    """
    if task.model_extra or task.name not in shipped_tasks():
        task_numbers(task)


def check_channels(task: TaskSettings, channels: tuple[str, ...]) -> None:
    """Raise ScenarioError for a channel that is neither common to all tasks nor the task's own."""
    common = cast(tuple[str, ...], named_object("uuv_marl.percept:CHANNELS")) if channels else ()
    for channel in channels:
        if channel not in common and channel not in (own := task_class(task.name).channels):
            having = [name for name in shipped_tasks() if channel in task_class(name).channels]
            raise ScenarioError(
                f"sonar.channels can't hold {channel!r} with task {task.name!r}, whose channels are "
                f"{', '.join((*common, *own))}" + "".join(f"; task {name!r} has it" for name in having)
            )


def task_class(name: str) -> Any:
    """The class of a task, by its name. Raises ScenarioError if it is unknown or invalid."""
    tasks = shipped_tasks()
    if name not in tasks and ":" not in name:
        raise ScenarioError(
            f"task {name!r} is unknown; {hint(name, tasks)}there are {', '.join(tasks)}, and module:Class for your own"
        )
    try:
        task_type = named_object(tasks.get(name, name))
    except ImportError as error:
        raise ScenarioError(f"task {name!r} {error}; give module:Class of a module that Python finds") from None
    base: Any = named_object("uuv_marl.tasks:Task")
    if not (isinstance(task_type, type) and issubclass(task_type, base)):
        raise ScenarioError(f"task {name!r} must be a subclass of uuv_marl.tasks.Task, got {task_type!r}")
    cast(Any, task_type).check()
    return task_type


def task_numbers(task: TaskSettings) -> Any:
    """The task's own numbers, validated by its class. Raises ScenarioError for an unknown or invalid number."""
    numbers = task_class(task.name).Numbers
    try:
        return numbers.model_validate(task.model_extra or {})
    except ValidationError as error:
        raise ScenarioError(explain(error, task.model_extra, numbers, "task.")) from None
