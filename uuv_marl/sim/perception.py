"""What a vehicle perceives: echoes of obstacles (Eq. 11, 16-17), and the percept made of all that it knows."""

import math

from uuv_marl.percept import MAX_SPEED
from uuv_marl.scenario import MAX_RANGE_M
from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import compiled, compiled_inline
from uuv_marl.sim.desk import Desk
from uuv_marl.sim.hearing import Pose
from uuv_marl.sim.model import Model
from uuv_marl.sim.sonar import cross


@compiled
def echo(
    c_x: float, c_y: float, radius: float, l_x: float, l_y: float, u_x: float, u_y: float
) -> tuple[float, float, float]:
    """Range and nearest point, in the body frame, of a disc's surface within a beam; range infinite for none.

    The disc is centred on c, the beam lies between the unit vectors l and u. Inside the disc the range is 0.
    """
    distance = math.hypot(c_x, c_y)
    if distance <= radius:
        return 0.0, 0.0, 0.0
    if cross(l_x, l_y, c_x, c_y) > 0.0 and cross(u_x, u_y, c_x, c_y) <= 0.0:
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
def write_percept(p: int, w: int, world: World, model: Model, desk: Desk) -> None:
    """What entry p of the cells knows in world w, as a flat vector in physical units. Eq. 11, 14-17."""
    cells, ear, suite, at = desk.cells, desk.ear, model.suite, model.at
    nu, reference, obstacles, out = world.state.nu, world.facts.reference, world.course.obstacles, world.senses.percept
    i = cells.vehicle[p]
    x, y, c, s = cells.x[p], cells.y[p], cells.cos[p], cells.sin[p]
    for k in range(out.shape[2]):
        out[w, i, k] = 0.0
    out[w, i, at.velocity] = saturate(nu[w, i, 0], MAX_SPEED)
    out[w, i, at.velocity + 1] = saturate(nu[w, i, 1], MAX_SPEED)
    out[w, i, at.yaw_rate] = saturate(nu[w, i, 2], MAX_SPEED)
    dx, dy = reference[w, 0] - x, reference[w, 1] - y
    v_x, v_y = reference[w, 2], reference[w, 3]
    far = max(math.sqrt(dx * dx + dy * dy) / MAX_RANGE_M, 1.0)
    out[w, i, at.reference] = saturate((c * dx + s * dy) / far, MAX_RANGE_M)
    out[w, i, at.reference + 1] = saturate((c * dy - s * dx) / far, MAX_RANGE_M)
    out[w, i, at.reference_velocity] = saturate(c * v_x + s * v_y, MAX_SPEED)
    out[w, i, at.reference_velocity + 1] = saturate(c * v_y - s * v_x, MAX_SPEED)
    for k in range(suite.lower.shape[0]):
        j = ear.heard[k]
        out[w, i, at.heard + k] = 1.0 if j >= 0 else 0.0
        out[w, i, at.neighbour + 2 * k] = ear.kept_ahead[k]
        out[w, i, at.neighbour + 2 * k + 1] = ear.kept_abeam[k]
        if at.link_identity >= 0 and j >= 0:
            c_j, s_j = cells.cos[cells.entry[j]], cells.sin[cells.entry[j]]
            v_x, v_y = c_j * nu[w, j, 0] - s_j * nu[w, j, 1], s_j * nu[w, j, 0] + c_j * nu[w, j, 1]
            out[w, i, at.link_identity + k] = j + 1
            out[w, i, at.link_velocity + 2 * k] = saturate(c * v_x + s * v_y, MAX_SPEED)
            out[w, i, at.link_velocity + 2 * k + 1] = saturate(c * v_y - s * v_x, MAX_SPEED)
    if at.compass >= 0:
        out[w, i, at.compass], out[w, i, at.compass + 1] = c, s
    for m in range(world.course.num_obstacles[w]):
        dx, dy = obstacles[w, m, 0] - x, obstacles[w, m, 1] - y
        if math.sqrt(dx * dx + dy * dy) - obstacles[w, m, 2] < suite.reach:
            write_echoes(i, w, (x, y, c, s), world, model)
            break


@compiled
def write_echoes(i: int, w: int, pose: Pose, world: World, model: Model) -> None:
    """What vehicle i hears of obstacles: per active sub-sector the nearest surface. Eq. 11, 16-17."""
    suite, at, obstacles, out = model.suite, model.at, world.course.obstacles, world.senses.percept
    x, y, c, s = pose
    for a in range(suite.active.shape[0]):
        k = suite.active[a]
        best = suite.active_range[a]
        for m in range(world.course.num_obstacles[w]):
            dx, dy, radius = obstacles[w, m, 0] - x, obstacles[w, m, 1] - y, obstacles[w, m, 2]
            if math.sqrt(dx * dx + dy * dy) - radius >= best:
                continue
            c_x, c_y = c * dx + s * dy, c * dy - s * dx
            reach, p_x, p_y = echo(
                c_x, c_y, radius, suite.lower[k, 0], suite.lower[k, 1], suite.upper[k, 0], suite.upper[k, 1]
            )
            if reach < best:
                best = reach
                if not suite.reports_surface:
                    p_x, p_y = c_x, c_y
                out[w, i, at.echo + a] = 1.0
                out[w, i, at.echo_range + a] = reach
                out[w, i, at.echo_position + 2 * a] = saturate(p_x, MAX_RANGE_M)
                out[w, i, at.echo_position + 2 * a + 1] = saturate(p_y, MAX_RANGE_M)
