"""How an episode ended, or its present state: entries of infos in every API."""

from typing import Any

from uuv_marl.envs.core import BatchedEnv


def succeeded(batch: BatchedEnv, world: int, vehicle: int | None = None) -> bool:
    """``is_success`` of ``ending``."""
    alive, diverged = batch.swarm.state.alive[world], batch.swarm.facts.diverged[world] >= 0
    present = alive.any() if vehicle is None else alive[vehicle]
    return bool(present and not diverged and batch.task.success(world, vehicle))


def ending(batch: BatchedEnv, world: int, vehicle: int | None = None) -> dict[str, Any]:
    """Why the episode of a world or of one vehicle ended, or that it goes on; as plain Python values.

    Args:
        batch: the worlds, before the next step or reset of an episode that has ended.
        world: index of the world.
        vehicle: index of the vehicle; None for the world as a whole.

    Returns:
        ``is_success`` (``Task.success`` of what is not lost: in ``follow`` the swarm arrived, in most other tasks this
        vehicle, or all, are at the goal and collision-free), ``ending`` (``arrival`` in ``follow``, ``done`` in
        other tasks, ``time_limit``, also after an arrival if ``arrival.ends_episode`` is false, ``lost``: this vehicle
        or all, ``diverged``: the integration step is too long, or ``running``), ``arrived`` (the swarm has arrived, or
        the task is done), ``time_s`` since the reset, and ``collisions``, those of the whole swarm so far.
    """
    swarm, task = batch.swarm, batch.task
    done, arrived = bool(task.done()[world]), task.arrived(world)
    alive = swarm.state.alive[world]
    if not (alive.any() if vehicle is None else alive[vehicle]):
        reason = "lost"
    elif swarm.facts.diverged[world] >= 0:
        reason = "diverged"
    elif not batch.over[world]:
        reason = "running"
    else:
        reason = task.ending if done else "time_limit"
    return {
        "is_success": succeeded(batch, world, vehicle),
        "ending": reason,
        "arrived": arrived,
        "time_s": float(swarm.facts.time_s[world]),
        "collisions": int(batch.collisions[world]),
    }
