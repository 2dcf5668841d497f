"""What every API's object shows: the scenario, the swarm, pictures. pygame, an extra, is imported on first use."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.drawing.camera import CAMERAS
from uuv_marl.envs.drawing.scene import Memory, Scene
from uuv_marl.envs.task import Task
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm

_SIDE_PX = (320, 4096)


class RenderOptions(TypedDict, total=False):
    """How an environment draws. Every entry may be left out."""

    size: tuple[int, int]
    """Width and height of a picture or the window [px], 800 x 800 by default."""
    camera: Literal["follow", "map"]
    """``follow`` (the default) keeps the swarm and l(t) in view, with the whole course in a corner; ``map`` shows the
    whole course."""
    sonar_of: int | None
    """Index of the vehicle whose sonar is drawn: its arrays, whom it hears, its echoes. None by default."""


class Look(NamedTuple):
    """``RenderOptions``, checked and complete."""

    size: tuple[int, int] = (800, 800)
    camera: str = "follow"
    sonar_of: int | None = None


def look(options: RenderOptions | None, num_vehicles: int, sonar_of: int | None = None) -> Look:
    """The checked options; ``sonar_of`` where they name no vehicle.

    Raises:
        ValueError: one can't be used; the message names it, its value and what it may be.
    """
    given: Any = {} if options is None else options
    if not isinstance(given, Mapping):
        raise ValueError(f"render_options must be a dictionary such as {{'camera': 'map'}}, got {given!r}")
    if unknown := [name for name in given if name not in Look._fields]:
        raise ValueError(f"render_options has no {unknown[0]!r}; it has {', '.join(Look._fields)}")
    chosen, (low, high) = Look(**{"sonar_of": sonar_of, **given}), _SIDE_PX
    if not _is_size(chosen.size):
        raise ValueError(
            f"render_options['size'] must be (width, height), whole numbers of pixels from {low} to {high}, "
            f"got {chosen.size!r}"
        )
    if chosen.camera not in CAMERAS:
        raise ValueError(f"render_options['camera'] must be one of {list(CAMERAS)}, got {chosen.camera!r}")
    i = chosen.sonar_of
    if i is not None and not (_whole(i) and 0 <= i < num_vehicles):
        raise ValueError(
            f"render_options['sonar_of'] must be the index of a vehicle, 0 to {num_vehicles - 1}, or None, got {i!r}"
        )
    return chosen._replace(size=(int(chosen.size[0]), int(chosen.size[1])))


def _whole(number: Any) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)


def _is_size(size: Any) -> bool:
    low, high = _SIDE_PX
    sides = size if isinstance(size, Sequence) and len(size) == 2 else ()
    return len(sides) == 2 and all(_whole(side) and low <= side <= high for side in sides)


class View:
    """Draws a task's worlds for an environment.

    Args:
        task: gives the worlds, and the pictures per second.
        render_mode: one of ``modes``, or None.
        modes: ``rgb_array``, and ``human`` where the environment can show a window.
        options: how to draw.
        sonar_of: whose sonar is drawn where the options name no vehicle.
    """

    def __init__(
        self,
        task: Task,
        render_mode: str | None,
        modes: Sequence[str],
        options: RenderOptions | None = None,
        sonar_of: int | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in modes:
            raise ValueError(f"render_mode must be one of {list(modes)} or None, got {render_mode!r}")
        self.mode = render_mode
        self.fps = round(1.0 / task.swarm.scenario.timing.decision_period_s) or 1
        self._task = task
        self._look = look(options, task.swarm.num_vehicles, sonar_of)
        self._memory = Memory(task)
        self._canvas: Any = None

    def draw(self, world: int = 0) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        if self.mode is None:
            raise RuntimeError("render() needs a render_mode: make the environment with render_mode='rgb_array'")
        self._memory.note(self._task)
        if self.mode == "human":
            return self._window().show(self._scene, wait=False)
        from uuv_marl.envs.drawing.frame import Frame, Panel, pixels  # noqa: PLC0415

        self._canvas = self._canvas or Frame(self._look.size)
        name, worlds = self._task.swarm.scenario.name, self._task.swarm.num_worlds
        title = name if worlds == 1 else f"{name}, world {world}"
        return pixels(self._canvas.draw([Panel(title, self._scene(self._look.sonar_of, world))], self._look.camera))

    def update(self) -> None:
        """Look at the worlds after a reset or a step; bring a window up to date, if there is one."""
        if self.mode is not None:
            self._memory.note(self._task)
        if self.mode == "human":
            self._window().show(self._scene, wait=True)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._canvas is not None and self.mode == "human":
            self._canvas.close()
        self._canvas = None

    def _scene(self, sonar_of: int | None, world: int = 0) -> Scene:
        return self._memory.scene(self._task, world, sonar_of)

    def _window(self) -> Any:
        if self._canvas is None:
            from uuv_marl.envs.drawing.window import Window  # noqa: PLC0415

            self._canvas = Window(self._task.swarm.scenario, self._look, self.fps)
        return self._canvas

    def __getstate__(self) -> dict[str, Any]:
        """For pickle and deepcopy: everything but the window."""
        return {**self.__dict__, "_canvas": None}


class TaskBased:
    """What every API's object shows of the task below it, and how it draws."""

    _task: Task
    _view: View
    metadata: dict[str, Any]

    def _show(
        self, task: Task, render_mode: str | None, options: RenderOptions | None = None, sonar_of: int | None = None
    ) -> None:
        """Take a task and how ``View`` draws it."""
        self._task = task
        self._view = View(task, render_mode, self.metadata["render_modes"], options, sonar_of)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self._view.fps}

    @property
    def scenario(self) -> Scenario:
        """What is simulated."""
        return self._task.swarm.scenario

    @property
    def swarm(self) -> Swarm:
        """The simulation: truth that agents don't observe, for evaluation and custom rewards."""
        return self._task.swarm


class OneWorld(TaskBased):
    """What the environments of one world share: pictures and a window."""

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        self._task.need_reset("render()")
        return self._view.draw()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._view.close()
