"""The step of a world, compiled: motion, losses, distances, arrival, sonar. ``Swarm`` owns the arrays.

Every array's first axis is the world. Each function accesses one world only, so that results never depend on the others
in the batch.
"""

import math

from uuv_marl.sim.arrays import Facts, World, WorldMap
from uuv_marl.sim.cells import Grid, sort
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.detection import detect
from uuv_marl.sim.disturbances import disturbances as disturbing
from uuv_marl.sim.disturbances.actuation import is_lost_to_fault
from uuv_marl.sim.disturbances.disturbances import Disturbances
from uuv_marl.sim.disturbances.readings import any_due
from uuv_marl.sim.model import Model, Rules
from uuv_marl.sim.motion import apply_actuators, integrate, load_action, load_one, load_state
from uuv_marl.sim.nearby import load_obstacles, load_places, remember_nearby
from uuv_marl.sim.perception import write_percept
from uuv_marl.sim.spacing import extent, measure_obstacles, measure_vehicles
from uuv_marl.sim.stopping import stop_hulls
from uuv_marl.sim.traffic import triangle
from uuv_marl.sim.trajectory import reference
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.views import fields
from uuv_marl.sim.workspace import MOST_NEARBY, Columns, Workspace, WorkspaceBuffers, workspace
from uuv_marl.types import Bool, Float32, Float64

RUNAWAY = 1000.0
"""A vehicle has diverged if |u| + |v| + |r| [m/s, m/s, rad/s] reaches this. Assumed: a hundred times any real one."""


@compiled_inner
def integrate_control_step(
    w: int, first: bool, world: World, model: Model, now: Columns, disturbances: Disturbances | None
) -> None:
    """Apply the actions' forces and integrate the motion of one control step. Eq. 1-4, 22-24.

    ``first`` says whether it is the first of its decision; later ones keep the force's direction in the world. States
    and facts are written.
    """
    state, facts, rules = world.state, world.facts, model.rules
    apply_actuators(first, now, model.plant)
    if disturbances is None:
        integrate(rules.steps, rules.step_s, now, model.plant)
    else:
        disturbing.integrate_disturbed(w, state, rules, now, disturbances)
    for i in range(state.eta.shape[1]):
        state.before[w, i, 0], state.before[w, i, 1] = state.eta[w, i, 0], state.eta[w, i, 1]
        if not state.alive[w, i]:
            continue
        if not abs(now.u[i]) + abs(now.v[i]) + abs(now.r[i]) < RUNAWAY:  # "not <" includes NaN
            if facts.diverged[w] < 0:
                facts.diverged[w] = i
            load_one(w, i, state, now)
            continue
        state.eta[w, i, 0], state.eta[w, i, 1], state.eta[w, i, 2] = now.x[i], now.y[i], now.psi[i]
        state.nu[w, i, 0], state.nu[w, i, 1], state.nu[w, i, 2] = now.u[i], now.v[i], now.r[i]
        facts.effort[w, i] += now.effort[i] / rules.control_steps
        if now.effort[i] >= 1.0 - 1e-6:
            facts.saturated[w] += 1.0


@compiled_inner
def apply_losses(w: int, world: World, rules: Rules, disturbances: Disturbances | None) -> None:
    """Lose the vehicles with a loss scheduled now, and those lost to faults."""
    if disturbances is not None:
        for i in range(world.state.alive.shape[1]):
            if is_lost_to_fault(w, i, world.state.tick[w], disturbances.actuation_model, disturbances.hull):
                lose_vehicle(w, i, world)
    for k in range(rules.loss_ticks.shape[0]):
        if rules.loss_ticks[k] == world.state.tick[w]:
            lose_vehicle(w, world.world_map.losses[w, k], world)


@compiled_inner
def lose_vehicle(w: int, i: int, world: World) -> None:
    """Mark a vehicle as lost and set its velocity to 0."""
    if world.state.alive[w, i]:
        world.state.alive[w, i] = False
        world.state.nu[w, i] = 0.0
        world.facts.lost[w, i] = True


@compiled_inner
def move_obstacles(w: int, tick: int, world_map: WorldMap, control_step_s: float) -> None:
    """Move the moving obstacles by one control step, which ``tick`` counts."""
    for k in range(world_map.num_obstacles[w]):
        if world_map.swing_control_steps[w, k] > 0:
            ahead = triangle(tick, world_map.swing_control_steps[w, k])
            speed = ahead - triangle(tick - 1, world_map.swing_control_steps[w, k])
            for c in range(2):
                start, velocity = world_map.swing[w, k, c], world_map.swing[w, k, 2 + c]
                world_map.obstacles[w, k, c] = start + ahead * control_step_s * velocity
                world_map.obstacle_velocity[w, k, c] = speed * velocity
        elif world_map.obstacle_velocity[w, k, 0] != 0.0 or world_map.obstacle_velocity[w, k, 1] != 0.0:
            world_map.obstacles[w, k, 0] += world_map.obstacle_velocity[w, k, 0] * control_step_s
            world_map.obstacles[w, k, 1] += world_map.obstacle_velocity[w, k, 1] * control_step_s


@compiled_inner
def measure_distances(w: int, world: World, model: Model, workspace: Workspace, grid: Grid) -> int:
    """Update the facts of distances and collisions of the living; return the number of new collisions."""
    facts, hull_radius = world.facts, model.rules.hull_radius
    began = measure_vehicles(w, hull_radius, world, workspace.cells, grid)
    began += measure_obstacles(w, hull_radius, world, workspace.obstacles, workspace.cells, grid)
    for i in range(facts.spacing.shape[1]):
        facts.min_spacing[w] = min(facts.min_spacing[w], facts.spacing[w, i])
    facts.max_spacing[w] = extent(workspace.cells, grid)
    facts.collisions[w] += began
    return began


@compiled_inner
def check_group(w: int, g: int, world: World, rules: Rules) -> tuple[float, float, int, float, float, bool]:
    """Update a group's reference and its vehicles' distances from it.

    Returns:
        Sums of the living vehicles' positions [m], their number, the largest distance of one of them from the end, that
        of their centre [m], and whether l(t), or with ``arrival.criterion = passage`` the centre, is at the end.
    """
    state, world_map, facts = world.state, world.world_map, world.facts
    t, last, l_t = facts.time_s[w], world_map.last[w, g], facts.reference[w, g]
    l_t[0], l_t[1], l_t[2], l_t[3] = reference(t, world_map.waypoints[w, g], world_map.times[w, g], last, rules.passes)
    x, y, num = 0.0, 0.0, 0
    for i in range(state.eta.shape[1]):
        if world_map.group[w, i] != g or not (state.alive[w, i] or facts.lost[w, i]):
            continue
        dx, dy = state.eta[w, i, 0] - l_t[0], state.eta[w, i, 1] - l_t[1]
        facts.away[w, i] = math.sqrt(dx * dx + dy * dy)
        if state.alive[w, i]:
            x, y, num = x + state.eta[w, i, 0], y + state.eta[w, i, 1], num + 1
    if num == 0:
        return 0.0, 0.0, 0, 0.0, 0.0, True
    at_x, at_y, at_end = l_t[0], l_t[1], t >= world_map.times[w, g, last]
    if rules.passes:
        at_x, at_y, beyond = passed(x / num, y / num, world_map.waypoints[w, g], last)
        at_end = at_end and beyond
    far = 0.0
    for i in range(state.eta.shape[1]):
        if state.alive[w, i] and world_map.group[w, i] == g:
            far = max(far, math.hypot(state.eta[w, i, 0] - at_x, state.eta[w, i, 1] - at_y))
    return x, y, num, far, math.hypot(x / num - at_x, y / num - at_y), at_end


@compiled_inner
def check_arrival(w: int, world: World, rules: Rules) -> None:
    """Update references, the swarm's centre, and whether all groups have arrived."""
    state, facts = world.state, world.facts
    facts.time_s[w] = state.tick[w] * rules.control_step_s
    x, y, living, far, error, at_end = 0.0, 0.0, 0, 0.0, 0.0, True
    for g in range(facts.reference.shape[1]):
        g_x, g_y, num, g_far, g_error, g_at_end = check_group(w, g, world, rules)
        x, y, living = x + g_x, y + g_y, living + num
        far, error, at_end = max(far, g_far), max(error, g_error), at_end and g_at_end
    if living == 0:
        facts.centre[w] = math.nan
        return
    facts.centre[w, 0], facts.centre[w, 1] = x / living, y / living
    for k in range(rules.arrival_radii.shape[0]):
        if not (at_end and far <= rules.spread and error <= rules.arrival_radii[k]):
            state.dwell[w, k] = 0
            continue
        if state.dwell[w, k] == rules.dwell_ticks and math.isnan(facts.arrival_s[w, k]):
            facts.arrival_s[w, k] = facts.time_s[w] - rules.dwell_ticks * rules.control_step_s
        state.dwell[w, k] += 1


@compiled_inner
def passed(x: float, y: float, waypoints: Float64, last: int) -> tuple[float, float, bool]:
    """Projection of a point onto the line of the last leg [m], and whether it lies beyond the end."""
    end_x, end_y = waypoints[last, 0], waypoints[last, 1]
    leg_x, leg_y = end_x - waypoints[last - 1, 0], end_y - waypoints[last - 1, 1]
    along = ((x - end_x) * leg_x + (y - end_y) * leg_y) / (leg_x * leg_x + leg_y * leg_y)
    return end_x + along * leg_x, end_y + along * leg_y, along >= 0.0


@compiled_inner
def perceive(w: int, world: World, model: Model, workspace: Workspace, grid: Grid, detects: bool) -> None:
    """Update detections and percepts of all vehicles.

    ``detects`` is False where later code replaces the detections by earlier readings.
    """
    state, senses, now = world.state, world.senses, workspace.now
    see = fields(senses.percept, model.at)
    for i in range(state.alive.shape[1]):
        senses.heading[w, i, 0], senses.heading[w, i, 1] = now.cos[i], now.sin[i]
        if not state.alive[w, i]:  # its columns move on, its state doesn't
            senses.heading[w, i, 0], senses.heading[w, i, 1] = cos_sin(state.eta[w, i, 2])
            senses.detected_index[w, i] = -1
            senses.percept[w, i] = 0.0
    for p in range(grid.living):
        if detects:
            detect(p, w, world.world_map, model.suite, workspace, grid)
        else:
            workspace.listener.detected_index[:] = -1
            workspace.listener.detected_ahead[:] = workspace.listener.detected_abeam[:] = 0.0
        i = workspace.cells.vehicle[p]
        for k in range(model.suite.lower.shape[0]):
            senses.detected_index[w, i, k] = workspace.listener.detected_index[k]
        write_percept(p, w, world, model, workspace, see)


@compiled_inner
def clear_facts(w: int, facts: Facts) -> None:
    """Reset the facts of a step."""
    for i in range(facts.away.shape[1]):
        facts.away_before[w, i] = facts.away[w, i]
    facts.spacing[w] = math.inf
    facts.clearance[w] = math.inf
    facts.obstacle_clearance[w] = math.inf
    facts.min_spacing[w] = math.inf
    facts.vehicle_collisions[w] = 0
    facts.collisions[w] = 0
    facts.lost[w] = False
    facts.effort[w] = 0.0
    facts.saturated[w] = 0.0


@compiled
def observe_world(
    w: int, world: World, model: Model, buffers: WorkspaceBuffers, disturbances: Disturbances | None
) -> None:
    """Compute facts and percepts of a world after a reset; ``state.dwell`` is written, too."""
    own = workspace(buffers, 0)
    clear_facts(w, world.facts)
    world.state.dwell[w] = 0
    world.state.collided[w] = False
    world.facts.arrival_s[w] = math.nan
    world.facts.diverged[w] = -1
    load_state(w, world.state, own.now)
    load_obstacles(w, world.world_map, own.obstacles)
    grid = sort(w, world.state.alive, model.rules.cell_side, own.now, own.cells)
    measure_distances(w, world, model, own, grid)
    check_arrival(w, world, model.rules)
    for i in range(world.facts.away.shape[1]):
        world.facts.away_before[w, i] = world.facts.away[w, i]
    perceive(w, world, model, own, grid, True)
    if disturbances is not None:
        disturbing.begin_disturbances(w, world, disturbances)
        disturbing.take_readings(w, world, model.at, disturbances)
        disturbing.apply_disturbances(w, world, model.at, disturbances)


@compiled_inner
def control_step(
    w: int, first: bool, world: World, model: Model, workspace: Workspace, disturbances: Disturbances | None
) -> Grid:
    """Advance a world by one control step and update its facts; return the grid of the living.

    ``first`` is that of ``integrate_control_step``.
    """
    integrate_control_step(w, first, world, model, workspace.now, disturbances)
    world.state.tick[w] += 1
    apply_losses(w, world, model.rules, disturbances)
    move_obstacles(w, world.state.tick[w], world.world_map, model.rules.control_step_s)
    load_places(w, world.world_map, workspace.obstacles)
    if model.rules.collision_stops:
        stop_hulls(w, world, model.rules, model.plant, workspace, disturbances)
    grid = sort(w, world.state.alive, model.rules.cell_side, workspace.now, workspace.cells)
    began = measure_distances(w, world, model, workspace, grid)
    if model.rules.collision_ends and began > 0:
        for i in range(world.state.alive.shape[1]):
            if world.facts.vehicle_collisions[w, i] > 0:
                lose_vehicle(w, i, world)
        grid = sort(w, world.state.alive, model.rules.cell_side, workspace.now, workspace.cells)
    check_arrival(w, world, model.rules)
    return grid


@compiled_inner
def step_world(
    w: int, action: Float32, world: World, model: Model, workspace: Workspace, disturbances: Disturbances | None
) -> None:
    """Advance a world by one decision period, unless it has diverged."""
    facts, control_steps = world.facts, model.rules.control_steps
    if facts.diverged[w] >= 0:
        return
    load_obstacles(w, world.world_map, workspace.obstacles)
    if world.world_map.num_obstacles[w] > MOST_NEARBY:
        remember_nearby(w, world, model.rules, workspace.obstacles)
    clear_facts(w, facts)
    num_alive = 0
    for i in range(action.shape[1]):
        num_alive += int(world.state.alive[w, i])
    load_state(w, world.state, workspace.now)
    load_action(w, action, workspace.now, model.plant)
    if disturbances is not None:
        disturbing.load_messages(w, action, world, disturbances)
    for control_step_index in range(control_steps):
        grid = control_step(w, control_step_index == 0, world, model, workspace, disturbances)
        if disturbances is not None:
            disturbing.advance_disturbances(w, world, disturbances)
        due = disturbances is not None and any_due(
            w, world.state.tick[w], disturbances.sonar_timing, disturbances.delay_line
        )
        if due or control_step_index == control_steps - 1:
            perceive(w, world, model, workspace, grid, due or disturbances is None or disturbances.sonar_timing.ideal)
            if disturbances is not None:
                disturbing.take_readings(w, world, model.at, disturbances)
    facts.saturated[w] /= max(num_alive * control_steps, 1)
    if disturbances is not None:
        disturbing.apply_disturbances(w, world, model.at, disturbances)


@compiled
def step_worlds(
    thread: int, begin: int, end: int, active: Bool, action: Float32, world: World, model: Model,
    buffers: WorkspaceBuffers, disturbances: Disturbances | None,
) -> bool:  # fmt: skip
    """Advance the active worlds from ``begin`` to ``end`` by one decision period; return whether any has diverged.

    ``active`` has shape (world,), ``action`` (world, vehicle, entry); ``thread`` is the index of the workspace.
    """
    own, diverged = workspace(buffers, thread), False
    for w in range(begin, end):
        if active[w]:
            step_world(w, action, world, model, own, disturbances)
        diverged = diverged or world.facts.diverged[w] >= 0
    return diverged
