"""The groups of an episode, their paths and informed vehicles, for pictures."""

from typing import NamedTuple

import numpy as np

from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float64, Int64


class Groups(NamedTuple):
    """The groups of an episode that have vehicles."""

    team: Int64
    """Team of each vehicle, 0 to 3, which pictures show in one of four colours, shape (vehicle,)."""
    informed: Bool
    """Whether a vehicle perceives its reference, shape (vehicle,)."""
    paths: dict[int, tuple[int | None, Float64]]
    """By the group's index its team, None for a single group, and the corners of its trajectory, north and east [m],
    shape (point, 2); only the last corner of a reference at rest, if there are several groups or no goal."""


def groups_of(swarm: Swarm, w: int = 0) -> Groups:
    """The groups of a world."""
    world_map, team, paths = swarm.world_map, np.asarray(swarm.task.teams(w), np.int64) % 4, {}
    indices, first = np.unique(world_map.group[w], return_index=True)
    for g, i in zip(indices.tolist(), first.tolist(), strict=True):
        corners, rests = world_map.waypoints[w, g, : world_map.last[w, g] + 1].copy(), not world_map.times[w, g].any()
        short = corners[-1:] if rests and (len(indices) > 1 or not swarm.task.has_goal) else corners
        paths[g] = (int(team[i]) if len(indices) > 1 else None, short)
    return Groups(team, world_map.informed[w].copy(), paths)
