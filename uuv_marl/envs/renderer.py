"""Pictures of an environment's worlds, as arrays or in a window. pygame, an extra, is imported on first use."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.drawing.options import RenderOptions, look
from uuv_marl.envs.drawing.scene import SceneHistory
from uuv_marl.sim.swarm import Swarm


class Renderer:
    """Draws the worlds of an environment.

    Args:
        swarm: the worlds.
        render_mode: one of ``modes``, or None.
        modes: ``rgb_array``, and ``human`` if the environment can show a window.
        options: see ``RenderOptions``.
        sonar_of: index of the inspected vehicle if the options name none.
    """

    def __init__(
        self,
        swarm: Swarm,
        render_mode: str | None,
        modes: Sequence[str],
        options: RenderOptions | None = None,
        sonar_of: int | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in modes:
            raise ValueError(f"render_mode must be one of {list(modes)} or None, got {render_mode!r}")
        self.mode = render_mode
        self.fps = round(1.0 / swarm.scenario.timing.decision_period_s) or 1
        self._swarm = swarm
        self._look = look(options, swarm.num_vehicles, sonar_of)
        self._memory = SceneHistory(swarm)
        self._shown: Any = None

    def draw(self, world: int = 0) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        if self.mode is None:
            raise RuntimeError("render() needs a render_mode: make the environment with render_mode='rgb_array'")
        self._memory.note()
        if self.mode == "human":
            return self._window().show(self._memory.scene, wait=False)
        from uuv_marl.envs.drawing.frame import Panel, draw_frame, pixels  # noqa: PLC0415

        name, scene = self._swarm.scenario.name, self._memory.scene(self._look.sonar_of, world)
        title = name if self._swarm.num_worlds == 1 else f"{name}, world {world}"
        return pixels(draw_frame([Panel(title, scene)], self._look.size, self._look.camera))

    def update(self) -> None:
        """Record the worlds after a reset or a step, and draw them in the window, if there is one."""
        if self.mode is not None:
            self._memory.note()
        if self.mode == "human":
            self._window().show(self._memory.scene, wait=True)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._shown is not None:
            self._shown.close()
        self._shown = None

    def _window(self) -> Any:
        if self._shown is None:
            from uuv_marl.envs.drawing.window import Window  # noqa: PLC0415

            self._shown = Window(self._swarm.scenario, self._look, self.fps)
        return self._shown

    def __getstate__(self) -> dict[str, Any]:
        """For pickle and deepcopy: everything but the window."""
        return {**self.__dict__, "_shown": None}
