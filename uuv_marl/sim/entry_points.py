"""What Python calls of the compiled simulation.

Numba compiles ``uuv_marl.sim.world`` once without a sea and once with one, so that calm worlds hold nothing of it.
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
    """Facts and percepts of a world that has just been reset. The first thread's room is used."""
    observe_world(w, world, model, workspace(buffers, 0), disturbances)


@compiled
def step_worlds(
    thread: int, begin: int, end: int, active: Bool, action: Float32, world: World, model: Model, buffers: WorkspaceBuffers,
    disturbances: Disturbances | None,
) -> bool:  # fmt: skip
    """One decision period of those worlds in a range that are active; whether any of them has diverged.

    ``begin`` and ``end`` bound the range, ``thread`` is the index of the room to work in.
    """
    own, diverged = workspace(buffers, thread), False
    for w in range(begin, end):
        if active[w]:
            step_world(w, action, world, model, own, disturbances)
        diverged = diverged or world.facts.diverged[w] >= 0
    return diverged
