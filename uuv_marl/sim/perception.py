"""Percepts: echoes of obstacles (Eq. 11, 16-17), detections and navigation in the body frame of each vehicle."""

import math

from uuv_marl.percept import MAX_SPEED, Fields
from uuv_marl.scenario import MAX_RANGE_M
from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import compiled, compiled_inline, compiled_inner
from uuv_marl.sim.detection import Pose
from uuv_marl.sim.model import Model
from uuv_marl.sim.nearby import choose
from uuv_marl.sim.sonar import SonarSuite, cross
from uuv_marl.sim.workspace import MOST_NEARBY, ObstacleBuffers, Workspace, obstacle_columns


@compiled_inline
def echo(
    c_x: float, c_y: float, radius: float, l_x: float, l_y: float, u_x: float, u_y: float
) -> tuple[float, float, float]:
    """Range [m] and nearest point, in the body frame [m], of a disc's surface within a beam. Eq. 16-17.

    The range is infinite for none, and 0 inside the disc. The beam lies between unit vectors l and u; c is the disc's
    centre.
    """
    ahead = cross(l_x, l_y, c_x, c_y) > 0.0 and cross(u_x, u_y, c_x, c_y) <= 0.0
    if ahead or c_x * c_x + c_y * c_y <= 1.001 * radius * radius:  # saves most calls of hypot
        distance = math.hypot(c_x, c_y)
        if distance <= radius:
            return 0.0, 0.0, 0.0
        if ahead:
            share = 1.0 - radius / distance
            return distance - radius, share * c_x, share * c_y
    best, p_x, p_y = math.inf, 0.0, 0.0
    for edge in range(2):
        e_x, e_y = (l_x, l_y) if edge == 0 else (u_x, u_y)
        along, off = e_x * c_x + e_y * c_y, cross(e_x, e_y, c_x, c_y)
        if along > 0.0 and abs(off) <= radius:
            reach = along - math.sqrt(radius * radius - off * off)
            if reach < best:
                best, p_x, p_y = reach, reach * e_x, reach * e_y
    return best, p_x, p_y


@compiled
def saturate(value: float, limit: float) -> float:
    """The nearest value within [-limit, limit]."""
    return min(max(value, -limit), limit)


@compiled_inline
def toward(dx: float, dy: float, c: float, s: float) -> tuple[float, float]:
    """A vector (north, east) in the body frame, ahead and to starboard [m]; at most ``MAX_RANGE_M`` long."""
    far = max(math.sqrt(dx * dx + dy * dy) / MAX_RANGE_M, 1.0)
    return saturate((c * dx + s * dy) / far, MAX_RANGE_M), saturate((c * dy - s * dx) / far, MAX_RANGE_M)


@compiled_inline
def body_velocity(v_x: float, v_y: float, c: float, s: float) -> tuple[float, float]:
    """A velocity (north, east) in the body frame, ahead and to starboard [m/s]; at most ``MAX_SPEED`` each."""
    return saturate(c * v_x + s * v_y, MAX_SPEED), saturate(c * v_y - s * v_x, MAX_SPEED)


@compiled_inline
def write_reference(w: int, i: int, pose: Pose, world: World, see: Fields) -> None:
    """Write l(t) and its velocity, if vehicle i is informed, as it perceives them at a pose."""
    if world.world_map.informed[w, i]:
        (x, y, c, s), l_t = pose, world.facts.reference[w, world.world_map.group[w, i]]
        see.reference[w, i, 0], see.reference[w, i, 1] = toward(l_t[0] - x, l_t[1] - y, c, s)
        see.reference_velocity[w, i, 0], see.reference_velocity[w, i, 1] = body_velocity(l_t[2], l_t[3], c, s)


@compiled_inline
def write_percept(p: int, w: int, world: World, model: Model, workspace: Workspace, see: Fields) -> None:
    """Write the percept of entry p's vehicle. Eq. 11, 14-17."""
    cells, listener, world_map = workspace.cells, workspace.listener, world.world_map
    nu, i = world.state.nu, cells.vehicle[p]
    x, y, c, s = cells.x[p], cells.y[p], cells.cos[p], cells.sin[p]
    for k in range(world.senses.percept.shape[2]):
        world.senses.percept[w, i, k] = 0.0
    see.velocity[w, i, 0] = saturate(nu[w, i, 0], MAX_SPEED)
    see.velocity[w, i, 1] = saturate(nu[w, i, 1], MAX_SPEED)
    see.yaw_rate[w, i, 0] = saturate(nu[w, i, 2], MAX_SPEED)
    write_reference(w, i, (x, y, c, s), world, see)
    for k in range(see.detected.shape[2]):
        j = listener.detected_index[k]
        see.detected[w, i, k] = 1.0 if j >= 0 else 0.0
        see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1] = listener.detected_ahead[k], listener.detected_abeam[k]
        if see.link_identity.shape[2] > 0 and j >= 0:
            c_j, s_j = cells.cos[cells.entry[j]], cells.sin[cells.entry[j]]
            v_x, v_y = c_j * nu[w, j, 0] - s_j * nu[w, j, 1], s_j * nu[w, j, 0] + c_j * nu[w, j, 1]
            see.link_identity[w, i, k] = j + 1
            see.link_velocity[w, i, k, 0], see.link_velocity[w, i, k, 1] = body_velocity(v_x, v_y, c, s)
    if see.compass.shape[2] > 0:
        see.compass[w, i, 0], see.compass[w, i, 1] = c, s
    if see.identity.shape[2] > 0:
        see.identity[w, i, 0] = (i + 0.5) / see.identity.shape[1]
    obstacles, num = obstacle_columns(workspace.obstacles), world_map.num_obstacles[w]
    if num > MOST_NEARBY:
        l_x, l_y, u_x, u_y = model.suite.cone
        cone = c * l_x - s * l_y, s * l_x + c * l_y, c * u_x - s * u_y, s * u_x + c * u_y
        num = choose(num, x, y, model.suite.reach, cone, obstacles)
    for t in range(num):
        m = obstacles.chosen[t]
        dx, dy = obstacles.x[m] - x, obstacles.y[m] - y
        if math.sqrt(dx * dx + dy * dy) - obstacles.radius[m] < model.suite.reach:
            write_echoes(i, w, num, (x, y, c, s), workspace.obstacles, model.suite, see)
            break


@compiled_inner
def write_echoes(
    i: int, w: int, num: int, pose: Pose, buffers: ObstacleBuffers, suite: SonarSuite, see: Fields
) -> None:
    """Write the echo of the nearest of ``num`` chosen obstacles in each active sub-sector. Eq. 11, 16-17.

    Fields without an echo stay as they are.
    """
    (x, y, c, s), obstacles = pose, obstacle_columns(buffers)
    for t in range(num):
        m = obstacles.chosen[t]
        dx, dy = obstacles.x[m] - x, obstacles.y[m] - y
        obstacles.ahead[t], obstacles.abeam[t] = c * dx + s * dy, c * dy - s * dx
        obstacles.gap[t] = math.sqrt(dx * dx + dy * dy) - obstacles.radius[m]
    for a in range(suite.active.shape[0]):
        k = suite.active[a]
        best = suite.active_range[a]
        for t in range(num):
            if obstacles.gap[t] >= best:
                continue
            m = int(obstacles.chosen[t])
            c_x, c_y, radius = obstacles.ahead[t], obstacles.abeam[t], obstacles.radius[m]
            reach, p_x, p_y = echo(
                c_x, c_y, radius, suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
            )
            if reach < best:
                best = reach
                if not suite.reports_surface:
                    p_x, p_y = c_x, c_y
                see.echo[w, i, a], see.echo_range[w, i, a] = 1.0, reach
                see.echo_position[w, i, a, 0] = saturate(p_x, MAX_RANGE_M)
                see.echo_position[w, i, a, 1] = saturate(p_y, MAX_RANGE_M)
