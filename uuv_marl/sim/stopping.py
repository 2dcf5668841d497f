"""Collisions that stop (``collision.stops``): a hull that hits a surface or another hull stops there.

A central impulse without friction removes the velocity into it: perfectly inelastic, so that energy never rises; that
between two hulls conserves their momentum (added mass included).
"""

import math

from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.disturbances.actuation import own_plant
from uuv_marl.sim.disturbances.disturbances import Disturbances
from uuv_marl.sim.model import Rules
from uuv_marl.sim.motion import load_one
from uuv_marl.sim.nearby import ROUND_M, nearest_surface
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import Plant
from uuv_marl.sim.workspace import Workspace, obstacle_columns

SINK_M = 0.001
"""Overlap left between a hull and what it hits [m], so that pressing on stays one collision. Assumed."""


@compiled_inner
def stop_hulls(
    w: int, world: World, rules: Rules, plant: Plant, workspace: Workspace, disturbances: Disturbances | None
) -> None:
    """Move colliding hulls of world w to the surface, each of two by half, and remove their velocity into it.

    States and their columns are written.
    """
    state, world_map, touch = world.state, world.world_map, 2.0 * rules.hull_radius
    obstacles = obstacle_columns(workspace.obstacles)
    for i in range(state.eta.shape[1]):
        if not state.alive[w, i]:
            continue
        clear = min(nearest_surface(i, state.eta[w, i, 0], state.eta[w, i, 1], obstacles)) > rules.hull_radius + ROUND_M
        for k in range(0 if clear else world_map.num_obstacles[w]):
            near = world_map.obstacles[w, k, 2] + rules.hull_radius
            dx = state.eta[w, i, 0] - world_map.obstacles[w, k, 0]
            dy = state.eta[w, i, 1] - world_map.obstacles[w, k, 1]
            if dx * dx + dy * dy < near * near:
                d, n_x, n_y = length_and_direction(dx, dy)
                speed, yields = along(w, i, n_x, n_y, world, plant, disturbances)
                speed -= n_x * world_map.obstacle_velocity[w, k, 0] + n_y * world_map.obstacle_velocity[w, k, 1]
                deep, impulse = max(near - d - SINK_M, 0.0), max(-speed, 0.0) / yields
                push(w, i, n_x, n_y, deep, impulse, world, plant, disturbances)
        for j in range(i):
            dx, dy = state.eta[w, i, 0] - state.eta[w, j, 0], state.eta[w, i, 1] - state.eta[w, j, 1]
            if state.alive[w, j] and dx * dx + dy * dy < touch * touch:
                d, n_x, n_y = length_and_direction(dx, dy)
                half = 0.5 * max(touch - d - SINK_M, 0.0)
                speed_i, yields_i = along(w, i, n_x, n_y, world, plant, disturbances)
                speed_j, yields_j = along(w, j, n_x, n_y, world, plant, disturbances)
                impulse = max(speed_j - speed_i, 0.0) / (yields_i + yields_j)
                push(w, i, n_x, n_y, half, impulse, world, plant, disturbances)
                push(w, j, -n_x, -n_y, half, impulse, world, plant, disturbances)
    for i in range(state.eta.shape[1]):
        load_one(w, i, state, workspace.now)


@compiled
def length_and_direction(dx: float, dy: float) -> tuple[float, float, float]:
    """Length of a vector [m] and its direction, a unit vector; north for length 0."""
    d = math.sqrt(dx * dx + dy * dy)
    return (d, dx / d, dy / d) if d > 0.0 else (0.0, 1.0, 0.0)


@compiled_inner
def along(
    w: int, i: int, n_x: float, n_y: float, world: World, plant: Plant, disturbances: Disturbances | None
) -> tuple[float, float]:
    """A vehicle's velocity over ground along the unit vector n [m/s], and its change per impulse [1/kg]."""
    c, s = cos_sin(world.state.eta[w, i, 2])
    ahead, abeam = c * n_x + s * n_y, c * n_y - s * n_x
    speed = ahead * world.state.nu[w, i, 0] + abeam * world.state.nu[w, i, 1]
    if disturbances is not None:
        speed += n_x * disturbances.flow.flow[w, i, 0] + n_y * disturbances.flow.flow[w, i, 1]
        plant = own_plant(w, i, disturbances.hull)
    return speed, ahead * ahead * plant.inverse_11 + abeam * abeam * plant.inverse_22


@compiled_inner
def push(
    w: int, i: int, n_x: float, n_y: float, distance: float, impulse: float, world: World, plant: Plant,
    disturbances: Disturbances | None,
) -> None:  # fmt: skip
    """Move a vehicle by a distance [m] along the unit vector n, and apply an impulse [N s], by its inertia (Eq. 2)."""
    world.state.eta[w, i, 0] += distance * n_x
    world.state.eta[w, i, 1] += distance * n_y
    if disturbances is not None:
        plant = own_plant(w, i, disturbances.hull)
    c, s = cos_sin(world.state.eta[w, i, 2])
    abeam = impulse * (c * n_y - s * n_x)
    world.state.nu[w, i, 0] += plant.inverse_11 * impulse * (c * n_x + s * n_y)
    world.state.nu[w, i, 1] += plant.inverse_22 * abeam
    world.state.nu[w, i, 2] += plant.inverse_23 * abeam
