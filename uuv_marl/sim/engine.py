"""What advances the worlds of a swarm: compiled code, or plain Python to read. ``Swarm`` is the front of either."""

import os
from typing import Any, Literal, Protocol, cast

import numpy as np
from numba import config, get_num_threads
from numba.np.ufunc.parallel import threading_layer
from numpy.typing import NDArray

from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import World
from uuv_marl.sim.cells import max_cells
from uuv_marl.sim.entry_points import (
    observe,
    observe_at_sea,
    step_alone,
    step_alone_at_sea,
    step_worlds,
    step_worlds_at_sea,
)
from uuv_marl.sim.model import model
from uuv_marl.sim.plain import PlainEngine
from uuv_marl.sim.sea.sea import Sea
from uuv_marl.sim.workspace import scratch

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
EngineName = Literal["numba", "plain"]

_threads_of_parent = False


def _note_fork() -> None:
    global _threads_of_parent  # noqa: PLW0603 - set once, in a forked child
    try:
        threading_layer()
    except ValueError:
        return
    _threads_of_parent = True


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


class Engine(Protocol):
    """Reads and writes the arrays of ``World`` that it was made with; whatever else it holds, no later run needs."""

    def observe(self, w: int) -> None:
        """Facts and percepts of world w from its state and course, as after a reset."""
        ...

    def step(self, action: Float32, active: Bool | None) -> bool:
        """One decision period of the worlds that are ``active``, shape (world,), default all; whether any has diverged.

        ``action``, shape (world, vehicle, 2), is finite but for the lost. A world that has diverged stays as it is.
        """
        ...


class NumbaEngine:
    """One world runs serially, several run on Numba's threads."""

    def __init__(self, scenario: Scenario, world: World, sea: Sea | None) -> None:
        self._world, self._model, self._num_worlds, self._sea = world, model(scenario), len(world.state.tick), sea
        n = scenario.swarm.num_vehicles
        threads = min(self._num_worlds, cast(Any, config).NUMBA_NUM_THREADS)
        self._scratch = scratch(threads, n, scenario.sonar.num_sectors, max_cells(n))

    def observe(self, w: int) -> None:
        """See ``Engine``."""
        if self._sea is None:
            observe(w, self._world, self._model, self._scratch)
        else:
            observe_at_sea(w, self._world, self._model, self._scratch, self._sea)

    def step(self, action: Float32, active: Bool | None) -> bool:
        """See ``Engine``."""
        if self._num_worlds == 1:
            if active is not None and not active[0]:
                return False
            if self._sea is None:
                return step_alone(action, self._world, self._model, self._scratch)
            return step_alone_at_sea(action, self._world, self._model, self._scratch, self._sea)
        if _threads_of_parent:
            raise RuntimeError(
                "several worlds can't be stepped in a process forked after Numba's threads had started; "
                "start workers with the 'spawn' method (multiprocessing.get_context('spawn'))"
            )
        running = np.ones(self._num_worlds, np.bool_) if active is None else active
        threads = min(get_num_threads(), len(self._scratch.reals))
        if self._sea is None:
            return step_worlds(threads, running, action, *self._world, *self._model, self._scratch)
        return step_worlds_at_sea(threads, running, action, *self._world, *self._model, self._scratch, *self._sea)


def make_engine(name: EngineName, scenario: Scenario, world: World, sea: Sea | None) -> Engine:
    """An engine by name.

    Args:
        name: ``numba`` or ``plain``.
        scenario: what to simulate.
        world: the arrays that it works on.
        sea: what disturbs them, None for nothing.
    """
    engines: dict[EngineName, type[NumbaEngine | PlainEngine]] = {"numba": NumbaEngine, "plain": PlainEngine}
    if name not in engines:
        raise ValueError(f"engine must be 'numba' or 'plain', got {name!r}")
    return engines[name](scenario, world, sea)
