"""Entry points of the compiled simulation from Python.

Numba compiles ``uuv_marl.sim.world`` once with disturbances and once without.
"""

from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.disturbances.disturbances import Disturbances
from uuv_marl.sim.model import Model
from uuv_marl.sim.workspace import WorkspaceBuffers, workspace
from uuv_marl.sim.world import observe_world, step_world
from uuv_marl.types import Bool, Float32


@compiled
def observe(w: int, world: World, model: Model, buffers: WorkspaceBuffers, disturbances: Disturbances | None) -> None:
    """Compute facts and percepts of a world after a reset, in the first thread's workspace."""
    observe_world(w, world, model, workspace(buffers, 0), disturbances)


@compiled
def step_worlds(
    thread: int, begin: int, end: int, active: Bool, action: Float32, world: World, model: Model,
    buffers: WorkspaceBuffers, disturbances: Disturbances | None,
) -> bool:  # fmt: skip
    """Advance the active worlds from ``begin`` to ``end`` by one decision period; return whether any has diverged.

    ``active`` has shape (world,), ``action`` (world, vehicle, 2); ``thread`` is the index of the workspace.
    """
    own, diverged = workspace(buffers, thread), False
    for w in range(begin, end):
        if active[w]:
            step_world(w, action, world, model, own, disturbances)
        diverged = diverged or world.facts.diverged[w] >= 0
    return diverged
