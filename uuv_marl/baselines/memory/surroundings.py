"""Update of a vehicle's memory from a percept: position, obstacles, neighbours; and its uncertainty."""

import math

from uuv_marl.baselines.memory import discs, neighbours, pose
from uuv_marl.baselines.memory.discs import ActiveSectors
from uuv_marl.baselines.memory.pose import DeadReckoning
from uuv_marl.baselines.memory.response import remains
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.percept import Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Bool, Float32

FULL_SHORTFALL = 0.4  # remaining share of a demand on thrust or torque that means full uncertainty [1]. Assumed.
NOISE = 0.02
"""Position errors of neighbours over range that mean the same [1]. Assumed: those of 2 degrees. Exact echoes cause
errors only at long decision periods, when neighbours are not where they were predicted."""
USUAL_AGE_S, OLD_S = 0.15, 0.2
"""Mean age of readings in ideal conditions, and the excess that means full uncertainty [s]. In still water 95 % of the
means are below 0.12 s, from remembered neighbours; the second number is assumed."""


@compiled
def update_memory(
    flat: Float32, at: Starts, worlds: Bool, own: DeadReckoning, sectors: ActiveSectors, memory_s: float,
    memory: Surroundings,
) -> None:  # fmt: skip
    """Update every vehicle's memory from its percept. Call it once for every decision."""
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1] if worlds[w] else 0):
            if not flat[w, i].any():  # a lost vehicle's
                memory.begun[w, i] = 0.0
                continue
            if memory.begun[w, i] == 0.0:
                pose.begin_map(w, i, see, memory)
            else:
                pose.move(w, i, see, own, memory)
            pose.store_motion(w, i, see, memory)
            discs.update_discs(w, i, see, sectors, memory)
            neighbours.update_neighbours(w, i, see, own.period_s, memory_s, memory)
            _store_distances(w, i, memory)


@compiled
def _store_distances(w: int, i: int, memory: Surroundings) -> None:
    """Store the distances of remembered obstacles and neighbours."""
    x, y = memory.pose[w, i, 0], memory.pose[w, i, 1]
    for d in range(memory.score.shape[2]):
        in_use = memory.score[w, i, d] > 0.0
        disc = memory.disc[w, i, d]
        memory.disc_away[w, i, d] = math.hypot(disc[0] - x, disc[1] - y) if in_use else math.inf
    for k in range(memory.known.shape[2]):
        in_use = memory.known[w, i, k] > 0.0
        place = memory.place[w, i, k]
        memory.away[w, i, k] = math.hypot(place[0] - x, place[1] - y) if in_use else math.inf


@compiled
def uncertainty(w: int, i: int, memory: Surroundings) -> float:
    """Deviation of motion and sonar from a vehicle's model: from 0 (all as predicted, in still water) to 1."""
    old = max(neighbours.age_of(w, i, memory) - USUAL_AGE_S, 0.0)
    moves = max(remains(w, i, 0, memory), remains(w, i, 1, memory)) / FULL_SHORTFALL
    return min(moves + neighbours.noise_of(w, i, memory) / NOISE + old / OLD_S, 1.0)
