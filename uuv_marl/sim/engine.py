"""Engine of a swarm: the compiled functions, and the threads that share the worlds."""

import functools
from collections.abc import Callable

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import World
from uuv_marl.sim.cells import max_cells
from uuv_marl.sim.compiled import entry
from uuv_marl.sim.disturbances.disturbances import Disturbances
from uuv_marl.sim.model import model
from uuv_marl.sim.threads import num_threads, on_threads
from uuv_marl.sim.workspace import workspace_buffers
from uuv_marl.sim.world import observe_world, step_worlds
from uuv_marl.types import Bool, Float32

_LEAST = 200
"""Least number of vehicles per thread: waking one takes as long as moving about as many."""
_HEAD = 200
"""Extra vehicles of the calling thread, which moves them while the others wake, and should finish last."""


class Engine:
    """Advances the arrays of a ``World``; it has no state of its own beyond them.

    Few vehicles run in the calling thread; worlds with many are shared among threads.
    """

    def __init__(self, scenario: Scenario, world: World, disturbances: Disturbances | None) -> None:
        n, self._num_worlds = scenario.swarm.num_vehicles, len(world.state.tick)
        self._threads = max(1, min(self._num_worlds, num_threads(), self._num_worlds * n // _LEAST))
        self._head = _HEAD // n
        buffers = workspace_buffers(
            self._threads, n, scenario.sonar.num_sectors, max_cells(n), world.world_map.obstacles.shape[1]
        )
        self._numbers = (world, model(scenario), buffers, disturbances)
        self._every = np.ones(self._num_worlds, np.bool_)

    @functools.cached_property
    def _observe(self) -> Callable[..., None]:
        return entry(observe_world, 0, *self._numbers)

    @functools.cached_property
    def _step(self) -> Callable[..., bool]:
        action = np.zeros((self._num_worlds, 1, 2), np.float32)
        return entry(step_worlds, 0, 0, 0, self._every, action, *self._numbers)

    def __getstate__(self) -> dict[str, object]:
        """All but the compiled entry points, which can't be pickled."""
        return {name: value for name, value in vars(self).items() if name not in ("_observe", "_step")}

    def observe(self, w: int) -> None:
        """Compute facts and percepts of world w from its state and map, as after a reset."""
        self._observe(w, *self._numbers)

    def step(self, action: Float32, active: Bool | None, on_stepped: Callable[[int, int], None] | None = None) -> bool:
        """Advance the ``active`` worlds, shape (world,), default all, by one decision; return whether any has diverged.

        ``action``, shape (world, vehicle, entry), is finite except for lost vehicles. ``on_stepped`` is called with
        start and end of each range of worlds that was stepped. A world that has diverged stays unchanged.
        """
        running = self._every if active is None else np.ascontiguousarray(active)

        def step_range(thread: int, begin: int, end: int) -> bool:
            diverged = self._step(thread, begin, end, running, action, *self._numbers)
            if on_stepped is not None:
                on_stepped(begin, end)
            return diverged

        if self._threads == 1:
            return step_range(0, 0, self._num_worlds)
        return on_threads(step_range, self._num_worlds, self._threads, self._head)
