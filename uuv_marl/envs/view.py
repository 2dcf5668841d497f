"""What every API's object shows: the scenario, the swarm, pictures. pygame, an extra, is imported on first use."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.task import Task
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm


class View:
    """Draws a swarm for an environment.

    Args:
        render_mode: one of ``modes``, or None.
        modes: ``rgb_array``, and ``human`` where the environment can show a window.
        scenario: gives the pictures per second.
    """

    def __init__(self, render_mode: str | None, modes: Sequence[str], scenario: Scenario) -> None:
        if render_mode is not None and render_mode not in modes:
            raise ValueError(f"render_mode must be one of {list(modes)} or None, got {render_mode!r}")
        self.mode = render_mode
        self.fps = round(1.0 / scenario.timing.decision_period_s) or 1
        self._canvas: Any = None

    def draw(self, swarm: Swarm, world: int = 0) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        if self.mode is None:
            raise RuntimeError("render() needs a render_mode: make the environment with render_mode='rgb_array'")
        if self._canvas is None:
            from uuv_marl.envs.rendering import Canvas  # noqa: PLC0415

            self._canvas = Canvas(window=self.mode == "human", fps=self.fps)
        return self._canvas.draw(swarm, world)

    def update(self, swarm: Swarm) -> None:
        """Bring a window up to date, if there is one."""
        if self.mode == "human":
            self.draw(swarm)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    def __getstate__(self) -> dict[str, Any]:
        """For pickle and deepcopy: everything but the window."""
        return {**self.__dict__, "_canvas": None}


class TaskBased:
    """What every API's object shows of the task below it, and how it draws."""

    _task: Task
    _view: View
    metadata: dict[str, Any]

    def _show(self, task: Task, render_mode: str | None) -> None:
        """Take a task and the render mode, one of ``metadata["render_modes"]`` or None."""
        self._task = task
        self._view = View(render_mode, self.metadata["render_modes"], self.scenario)
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
        return self._view.draw(self.swarm)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._view.close()
