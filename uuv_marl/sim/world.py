"""One world, compiled: move, lose, measure, judge arrival, hear. ``Swarm`` holds the arrays it works on.

Every array's first axis is the world; each function touches the rows of one world only, so that a world's run never
depends on its neighbours in the batch.
"""

import math

from uuv_marl.sim.arrays import Course, Facts, World
from uuv_marl.sim.cells import Grid, sort
from uuv_marl.sim.compiled import compiled_inner
from uuv_marl.sim.hearing import hear, hear_nobody
from uuv_marl.sim.model import Model, Rules
from uuv_marl.sim.motion import apply_actuators, integrate, load_action, load_one, load_state
from uuv_marl.sim.nearby import load_obstacles, load_places, remember_nearby
from uuv_marl.sim.perception import write_percept
from uuv_marl.sim.sea.actuation import is_lost_to_fault
from uuv_marl.sim.sea.sea import Sea, begin_sea, drift, integrate_at_sea, know, reads, take_readings
from uuv_marl.sim.spacing import extent, measure_obstacles, measure_vehicles
from uuv_marl.sim.stopping import stop_hulls
from uuv_marl.sim.traffic import triangle
from uuv_marl.sim.trajectory import reference
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.views import fields, sea_fields
from uuv_marl.sim.workspace import MOST_NEARBY, Columns, Workspace
from uuv_marl.types import Float32, Float64

RUNAWAY = 1000.0
"""A vehicle whose velocities (surge, sway [m/s], yaw rate [rad/s]) add up to this has diverged. Assumed: no vehicle
under water is a hundredth as fast."""


@compiled_inner
def control_hold(w: int, first: bool, world: World, model: Model, now: Columns, sea: Sea | None) -> None:
    """Actions become forces, forces become motion. Eq. 1-4, 22-24.

    ``first`` says whether the decision was made at the start of this hold; later ones keep its force's direction in the
    world. States and facts are written.
    """
    state, facts, rules = world.state, world.facts, model.rules
    apply_actuators(first, now, model.plant)
    if sea is None:
        integrate(rules.steps, rules.step_s, now, model.plant)
    else:
        integrate_at_sea(w, state, rules, now, sea)
    for i in range(state.eta.shape[1]):
        state.before[w, i, 0], state.before[w, i, 1] = state.eta[w, i, 0], state.eta[w, i, 1]
        if not state.alive[w, i]:
            continue
        if not abs(now.u[i]) + abs(now.v[i]) + abs(now.r[i]) < RUNAWAY:  # so asked, NaN counts as too fast
            if facts.diverged[w] < 0:
                facts.diverged[w] = i
            load_one(w, i, state, now)
            continue
        state.eta[w, i, 0], state.eta[w, i, 1], state.eta[w, i, 2] = now.x[i], now.y[i], now.psi[i]
        state.nu[w, i, 0], state.nu[w, i, 1], state.nu[w, i, 2] = now.u[i], now.v[i], now.r[i]
        facts.effort[w, i] += now.effort[i] / rules.holds
        if now.effort[i] >= 1.0 - 1e-6:
            facts.saturated[w] += 1.0


@compiled_inner
def apply_losses(w: int, world: World, rules: Rules, sea: Sea | None) -> None:
    """Vehicles whose scheduled time has come fall silent and stop. The sea's faults may lose vehicles, too."""
    if sea is not None:
        for i in range(world.state.alive.shape[1]):
            if is_lost_to_fault(w, i, world.state.tick[w], sea.actuation, sea.hull):
                lose_vehicle(w, i, world)
    for k in range(rules.loss_ticks.shape[0]):
        if rules.loss_ticks[k] == world.state.tick[w]:
            lose_vehicle(w, world.course.losses[w, k], world)


@compiled_inner
def lose_vehicle(w: int, i: int, world: World) -> None:
    """Lose one vehicle."""
    if world.state.alive[w, i]:
        world.state.alive[w, i] = False
        world.state.nu[w, i] = 0.0
        world.facts.lost[w, i] = True


@compiled_inner
def move_obstacles(w: int, tick: int, course: Course, hold_s: float) -> None:
    """Obstacles go on, those that move, for one control hold; ``tick`` counts it."""
    for k in range(course.num_obstacles[w]):
        if course.swing_holds[w, k] > 0:
            ahead = triangle(tick, course.swing_holds[w, k])
            speed = ahead - triangle(tick - 1, course.swing_holds[w, k])
            for c in range(2):
                course.obstacles[w, k, c] = course.swing[w, k, c] + ahead * hold_s * course.swing[w, k, 2 + c]
                course.obstacle_velocity[w, k, c] = speed * course.swing[w, k, 2 + c]
        elif course.obstacle_velocity[w, k, 0] != 0.0 or course.obstacle_velocity[w, k, 1] != 0.0:
            course.obstacles[w, k, 0] += course.obstacle_velocity[w, k, 0] * hold_s
            course.obstacles[w, k, 1] += course.obstacle_velocity[w, k, 1] * hold_s


@compiled_inner
def sort_into_cells(w: int, world: World, model: Model, workspace: Workspace) -> Grid:
    """Sort the living into cells; where these lie."""
    return sort(w, world.state.alive, model.rules.cell_side, workspace.now, workspace.cells)


@compiled_inner
def measure_distances(w: int, world: World, model: Model, workspace: Workspace, grid: Grid) -> int:
    """Distances of the living, folded into the facts of the step; how many contact episodes began now."""
    facts, hull = world.facts, model.rules.hull
    began = measure_vehicles(w, hull, world, workspace.cells, grid)
    began += measure_obstacles(w, hull, world, workspace.obstacles, workspace.cells, grid)
    for i in range(facts.spacing.shape[1]):
        facts.min_spacing[w] = min(facts.min_spacing[w], facts.spacing[w, i])
    facts.max_spacing[w] = extent(workspace.cells, grid)
    facts.collisions[w] += began
    return began


@compiled_inner
def check_group(w: int, g: int, world: World, rules: Rules) -> tuple[float, float, int, float, float, bool]:
    """Where a group's reference is, and how far its vehicles and their centre are from where they are to arrive.

    Returns:
        Sums of the living's positions [m], how many live, the largest distance of one of them from the end, and that of
        their centre [m], and whether l(t), or in passage the centre, has come to the end.
    """
    state, course, facts = world.state, world.course, world.facts
    t, last, l_t = facts.time_s[w], course.last[w, g], facts.reference[w, g]
    l_t[0], l_t[1], l_t[2], l_t[3] = reference(t, course.waypoints[w, g], course.times[w, g], last, rules.passes)
    x, y, num = 0.0, 0.0, 0
    for i in range(state.eta.shape[1]):
        if course.group[w, i] != g or not (state.alive[w, i] or facts.lost[w, i]):
            continue
        dx, dy = state.eta[w, i, 0] - l_t[0], state.eta[w, i, 1] - l_t[1]
        facts.away[w, i] = math.sqrt(dx * dx + dy * dy)
        if state.alive[w, i]:
            x, y, num = x + state.eta[w, i, 0], y + state.eta[w, i, 1], num + 1
    if num == 0:
        return 0.0, 0.0, 0, 0.0, 0.0, True
    at_x, at_y, there = l_t[0], l_t[1], t >= course.times[w, g, last]
    if rules.passes:
        at_x, at_y, beyond = passed(x / num, y / num, course.waypoints[w, g], last)
        there = there and beyond
    far = 0.0
    for i in range(state.eta.shape[1]):
        if state.alive[w, i] and course.group[w, i] == g:
            far = max(far, math.hypot(state.eta[w, i, 0] - at_x, state.eta[w, i, 1] - at_y))
    return x, y, num, far, math.hypot(x / num - at_x, y / num - at_y), there


@compiled_inner
def check_arrival(w: int, world: World, rules: Rules) -> None:
    """Where references and the swarm's centre are, and whether the swarm, all its groups, has arrived."""
    state, facts = world.state, world.facts
    facts.time_s[w] = state.tick[w] * rules.hold_s
    x, y, living, far, error, there = 0.0, 0.0, 0, 0.0, 0.0, True
    for g in range(facts.reference.shape[1]):
        g_x, g_y, num, g_far, g_error, g_there = check_group(w, g, world, rules)
        x, y, living = x + g_x, y + g_y, living + num
        far, error, there = max(far, g_far), max(error, g_error), there and g_there
    if living == 0:
        facts.centre[w] = math.nan
        return
    facts.centre[w, 0], facts.centre[w, 1] = x / living, y / living
    for k in range(rules.arrival_radii.shape[0]):
        if not (there and far <= rules.spread and error <= rules.arrival_radii[k]):
            state.dwell[w, k] = 0
            continue
        if state.dwell[w, k] == rules.dwell_ticks and math.isnan(facts.arrival_s[w, k]):
            facts.arrival_s[w, k] = facts.time_s[w] - rules.dwell_ticks * rules.hold_s
        state.dwell[w, k] += 1


@compiled_inner
def passed(x: float, y: float, waypoints: Float64, last: int) -> tuple[float, float, bool]:
    """The point of the last leg, prolonged, that is nearest to another [m], and whether it lies beyond the end."""
    end_x, end_y = waypoints[last, 0], waypoints[last, 1]
    leg_x, leg_y = end_x - waypoints[last - 1, 0], end_y - waypoints[last - 1, 1]
    along = ((x - end_x) * leg_x + (y - end_y) * leg_y) / (leg_x * leg_x + leg_y * leg_y)
    return end_x + along * leg_x, end_y + along * leg_y, along >= 0.0


@compiled_inner
def perceive(w: int, world: World, model: Model, workspace: Workspace, grid: Grid, listens: bool) -> None:
    """What the living hear, and everybody's percept.

    Without ``listens`` earlier readings stand, so that nobody need listen now.
    """
    state, senses, now = world.state, world.senses, workspace.now
    see = fields(senses.percept, model.at)
    for i in range(state.alive.shape[1]):
        senses.heading[w, i, 0], senses.heading[w, i, 1] = now.cos[i], now.sin[i]
        if not state.alive[w, i]:  # its columns have moved on, its state has not
            senses.heading[w, i, 0], senses.heading[w, i, 1] = cos_sin(state.eta[w, i, 2])
            senses.heard[w, i] = -1
            senses.percept[w, i] = 0.0
    for p in range(grid.living):
        if listens:
            hear(p, w, world.course, model.suite, workspace, grid)
        else:
            hear_nobody(workspace.listener)
        i = workspace.cells.vehicle[p]
        for k in range(model.suite.lower.shape[0]):
            senses.heard[w, i, k] = workspace.listener.heard[k]
        write_percept(p, w, world, model, workspace, see)


@compiled_inner
def clear_facts(w: int, facts: Facts) -> None:
    """Forget the step before."""
    for i in range(facts.away.shape[1]):
        facts.was_away[w, i] = facts.away[w, i]
    facts.spacing[w] = math.inf
    facts.clearance[w] = math.inf
    facts.obstacle_clearance[w] = math.inf
    facts.min_spacing[w] = math.inf
    facts.contacts[w] = 0
    facts.collisions[w] = 0
    facts.lost[w] = False
    facts.effort[w] = 0.0
    facts.saturated[w] = 0.0


@compiled_inner
def observe_world(w: int, world: World, model: Model, own: Workspace, sea: Sea | None) -> None:
    """Facts and percepts of a world that has just been reset. Facts, senses and ``state.dwell`` are written."""
    clear_facts(w, world.facts)
    world.state.dwell[w] = 0
    world.state.touched[w] = False
    world.facts.arrival_s[w] = math.nan
    world.facts.diverged[w] = -1
    load_state(w, world.state, own.now)
    load_obstacles(w, world.course, own.obstacles)
    grid = sort_into_cells(w, world, model, own)
    measure_distances(w, world, model, own, grid)
    check_arrival(w, world, model.rules)
    for i in range(world.facts.away.shape[1]):
        world.facts.was_away[w, i] = world.facts.away[w, i]
    perceive(w, world, model, own, grid, True)
    if sea is not None:
        begin_sea(w, world, sea)
        take_readings(w, world, sea, fields(world.senses.percept, model.at))
        know(w, world, sea, fields(world.senses.percept, model.at), sea_fields(world.senses.percept, model.at))


@compiled_inner
def step_hold(w: int, first: bool, world: World, model: Model, workspace: Workspace, sea: Sea | None) -> Grid:
    """One control hold of a world and what becomes true by it; where the cells of the living lie afterwards.

    ``first`` is that of ``control_hold``.
    """
    control_hold(w, first, world, model, workspace.now, sea)
    world.state.tick[w] += 1
    apply_losses(w, world, model.rules, sea)
    move_obstacles(w, world.state.tick[w], world.course, model.rules.hold_s)
    load_places(w, world.course, workspace.obstacles)
    if model.rules.contact_stops:
        stop_hulls(w, world, model.rules, model.plant, workspace, sea)
    grid = sort_into_cells(w, world, model, workspace)
    began = measure_distances(w, world, model, workspace, grid)
    if model.rules.contact_ends and began > 0:
        for i in range(world.state.alive.shape[1]):
            if world.facts.contacts[w, i] > 0:
                lose_vehicle(w, i, world)
        grid = sort_into_cells(w, world, model, workspace)
    check_arrival(w, world, model.rules)
    return grid


@compiled_inner
def step_world(w: int, action: Float32, world: World, model: Model, workspace: Workspace, sea: Sea | None) -> None:
    """One decision period of a world. A world that has diverged stays as it is."""
    facts, holds = world.facts, model.rules.holds
    if facts.diverged[w] >= 0:
        return
    load_obstacles(w, world.course, workspace.obstacles)
    if world.course.num_obstacles[w] > MOST_NEARBY:
        remember_nearby(w, world, model.rules, workspace.obstacles)
    clear_facts(w, facts)
    num_alive = 0
    for i in range(action.shape[1]):
        num_alive += int(world.state.alive[w, i])
    load_state(w, world.state, workspace.now)
    load_action(w, action, workspace.now, model.plant)
    for hold in range(holds):
        grid = step_hold(w, hold == 0, world, model, workspace, sea)
        if sea is not None:
            drift(w, world, sea)
        due = sea is not None and reads(w, world.state.tick[w], sea)
        if due or hold == holds - 1:
            perceive(w, world, model, workspace, grid, due or sea is None or sea.listening.ideal)
            if sea is not None:
                take_readings(w, world, sea, fields(world.senses.percept, model.at))
    facts.saturated[w] /= max(num_alive * holds, 1)
    if sea is not None:
        know(w, world, sea, fields(world.senses.percept, model.at), sea_fields(world.senses.percept, model.at))
