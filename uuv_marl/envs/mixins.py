"""Common parts of the environments of all APIs: their worlds, and pictures of them."""

from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from uuv_marl.envs.core import BatchedEnv
from uuv_marl.envs.drawing.options import RenderOptions
from uuv_marl.envs.renderer import Renderer
from uuv_marl.scenario import Scenario, conditions
from uuv_marl.scenario.overrides import plain
from uuv_marl.sim.swarm import Swarm


class EnvMixin:
    """A ``BatchedEnv``, its scenario and swarm, and pictures."""

    _batch: BatchedEnv
    _renderer: Renderer
    metadata: dict[str, Any]

    def _wrap(
        self, batch: BatchedEnv, render_mode: str | None, options: RenderOptions | None = None,
        sonar_of: int | None = None,
    ) -> None:  # fmt: skip
        """Wrap these worlds; ``sonar_of``: index of the inspected vehicle if the options name none."""
        self._batch = batch
        self._renderer = Renderer(batch.swarm, render_mode, self.metadata["render_modes"], options, sonar_of)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self._renderer.fps}

    def __repr__(self) -> str:
        scenario, swarm = self.scenario, self.swarm
        worlds = "" if swarm.num_worlds == 1 else f"{swarm.num_worlds} worlds, "
        return f"{type(self).__name__}({scenario.name}: {worlds}{swarm.num_vehicles} vehicles, {conditions(scenario)})"

    @property
    def scenario(self) -> Scenario:
        """The scenario that is simulated."""
        return self._batch.swarm.scenario

    @property
    def observes_positions(self) -> bool:
        """Whether policies can use the observations: ``observe="positions"``."""
        return self._batch.layout == self.swarm.layout

    @property
    def swarm(self) -> Swarm:
        """The simulation, with state that agents don't observe, for evaluation and rewards."""
        return self._batch.swarm


class SpecMixin:
    """Gymnasium's ``spec`` with values that JSON can hold: a scenario as its fields, a path or a mode as text."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The specification from which ``gymnasium.make`` made this environment."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None:
            kwargs = {name: plain(getattr(value, "value", value)) for name, value in spec.kwargs.items()}
            spec = replace(spec, kwargs=kwargs)  # with the values of enumerations
        self._spec = spec


class RenderMixin(EnvMixin):
    """Pictures and a window of an environment of one world."""

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        self._batch.check_reset("render()")
        return self._renderer.draw()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()
