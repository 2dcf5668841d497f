"""One world, compiled: move, lose, measure, judge arrival, hear. ``Swarm`` holds the arrays it works on.

Every array's first axis is the world; each function touches the rows of one world only, so that a world's run never
depends on its neighbours in the batch.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import Offsets
from uuv_marl.sim.arrays import Course, Facts, Rules, Scratch, Senses, State, desk
from uuv_marl.sim.cells import Cells, Grid, sort
from uuv_marl.sim.compiled import compiled, compiled_parallel
from uuv_marl.sim.hearing import Ear, hear
from uuv_marl.sim.motion import Columns, aim, load, load_one, move, push
from uuv_marl.sim.perception import write_percept
from uuv_marl.sim.sonar import Suite
from uuv_marl.sim.spacing import extent, measure_obstacles, measure_vehicles
from uuv_marl.sim.trajectory import reference
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import Plant

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


RUNAWAY = 1000.0
"""A vehicle whose velocities (surge, sway [m/s], yaw rate [rad/s]) add up to this has diverged. Assumed: no vehicle
under water is a hundredth as fast."""


@compiled
def hold(w: int, first: bool, state: State, facts: Facts, plant: Plant, rules: Rules, now: Columns) -> None:
    """Actions become forces, forces become motion. Eq. 1-4, 22-24."""
    push(first, now, plant)
    move(rules.steps, rules.step_s, now, plant)
    for i in range(state.eta.shape[1]):
        state.before[w, i, 0], state.before[w, i, 1] = state.eta[w, i, 0], state.eta[w, i, 1]
        if not state.alive[w, i]:
            continue
        if not abs(now.u[i]) + abs(now.v[i]) + abs(now.r[i]) < RUNAWAY:  # so asked, NaN counts as too fast
            if facts.diverged[w] < 0:
                facts.diverged[w] = i
            load_one(w, i, state.eta, state.nu, now)
            continue
        state.eta[w, i, 0], state.eta[w, i, 1], state.eta[w, i, 2] = now.x[i], now.y[i], now.psi[i]
        state.nu[w, i, 0], state.nu[w, i, 1], state.nu[w, i, 2] = now.u[i], now.v[i], now.r[i]
        facts.effort[w, i] += now.effort[i] / rules.holds
        if now.effort[i] >= 1.0 - 1e-6:
            facts.saturated[w] += 1.0


@compiled
def lose(w: int, state: State, course: Course, facts: Facts, rules: Rules) -> None:
    """Vehicles whose scheduled time has come fall silent and stop."""
    for k in range(rules.loss_ticks.shape[0]):
        if rules.loss_ticks[k] == state.tick[w]:
            drop(w, course.losses[w, k], state, facts)


@compiled
def drop(w: int, i: int, state: State, facts: Facts) -> None:
    """Lose one vehicle."""
    if state.alive[w, i]:
        state.alive[w, i] = False
        state.nu[w, i] = 0.0
        facts.lost[w, i] = True


@compiled
def arrange(w: int, state: State, rules: Rules, now: Columns, cells: Cells) -> Grid:
    """Sort the living into cells."""
    return sort(now.x, now.y, now.cos, now.sin, state.alive, w, rules.cell_side, cells)


@compiled
def measure(w: int, state: State, course: Course, facts: Facts, rules: Rules, cells: Cells, grid: Grid) -> int:
    """Distances of the living, folded into the facts of the step; how many contact episodes began now."""
    began = measure_vehicles(w, rules.hull, state.before, cells, grid, facts.spacing, facts.contacts)
    began += measure_obstacles(
        w, rules.hull, state.before, course.obstacles, course.num_obstacles[w], cells, grid,
        facts.clearance, facts.obstacle_clearance, facts.contacts,
    )  # fmt: skip
    for i in range(state.alive.shape[1]):
        facts.min_spacing[w] = min(facts.min_spacing[w], facts.spacing[w, i])
    facts.max_spacing[w] = extent(cells, grid)
    facts.collisions[w] += began
    return began


@compiled
def judge(w: int, state: State, course: Course, facts: Facts, rules: Rules) -> None:
    """Where the reference and the swarm's centre are, and whether the swarm has arrived."""
    last = course.last[w]
    t = state.tick[w] * rules.hold_s
    l_x, l_y, l_vx, l_vy = reference(t, course.waypoints[w], course.times[w], last)
    facts.time_s[w] = t
    facts.reference[w, 0], facts.reference[w, 1], facts.reference[w, 2], facts.reference[w, 3] = l_x, l_y, l_vx, l_vy
    x, y, far, num = 0.0, 0.0, 0.0, 0
    for i in range(state.eta.shape[1]):
        if state.alive[w, i]:
            x, y, num = x + state.eta[w, i, 0], y + state.eta[w, i, 1], num + 1
            far = max(far, math.hypot(state.eta[w, i, 0] - l_x, state.eta[w, i, 1] - l_y))
    if num == 0:
        facts.centre[w] = math.nan
        return
    facts.centre[w, 0], facts.centre[w, 1] = x / num, y / num
    error = math.hypot(x / num - l_x, y / num - l_y)
    rests = t >= course.times[w, last] and far <= rules.spread
    for k in range(rules.arrival_radii.shape[0]):
        if not (rests and error <= rules.arrival_radii[k]):
            state.dwell[w, k] = 0
            continue
        if state.dwell[w, k] == rules.dwell_ticks and math.isnan(facts.arrival_s[w, k]):
            facts.arrival_s[w, k] = t - rules.dwell_ticks * rules.hold_s
        state.dwell[w, k] += 1


@compiled
def perceive(
    w: int, state: State, course: Course, facts: Facts, suite: Suite, at: Offsets, senses: Senses, now: Columns,
    cells: Cells, grid: Grid, ear: Ear,
) -> None:  # fmt: skip
    """What the living hear, and everybody's percept."""
    for i in range(state.alive.shape[1]):
        senses.heading[w, i, 0], senses.heading[w, i, 1] = now.cos[i], now.sin[i]
        if not state.alive[w, i]:  # its columns have moved on, its state has not
            senses.heading[w, i, 0], senses.heading[w, i, 1] = cos_sin(state.eta[w, i, 2])
            senses.heard[w, i] = -1
            senses.percept[w, i] = 0.0
    num_obstacles = course.num_obstacles[w]
    for p in range(grid.living):
        hear(p, w, course.obstacles, num_obstacles, cells, grid, suite, ear)
        i = cells.vehicle[p]
        for k in range(suite.lower.shape[0]):
            senses.heard[w, i, k] = ear.heard[k]
        write_percept(
            p, w, state.nu, facts.reference, course.obstacles, num_obstacles, cells, suite, ear, at, senses.percept
        )


@compiled
def clear(w: int, facts: Facts) -> None:
    """Forget the step before."""
    facts.spacing[w] = math.inf
    facts.clearance[w] = math.inf
    facts.obstacle_clearance[w] = math.inf
    facts.min_spacing[w] = math.inf
    facts.contacts[w] = 0
    facts.collisions[w] = 0
    facts.lost[w] = False
    facts.effort[w] = 0.0
    facts.saturated[w] = 0.0


@compiled
def observe_world(
    w: int, state: State, course: Course, facts: Facts, senses: Senses, rules: Rules, suite: Suite, at: Offsets,
    room: Scratch,
) -> None:  # fmt: skip
    """Facts and percepts of a world that has just been reset."""
    now, cells, ear = desk(room, 0)
    clear(w, facts)
    state.dwell[w] = 0
    facts.arrival_s[w] = math.nan
    facts.diverged[w] = -1
    load(w, state.eta, state.nu, now)
    grid = arrange(w, state, rules, now, cells)
    measure(w, state, course, facts, rules, cells, grid)
    judge(w, state, course, facts, rules)
    perceive(w, state, course, facts, suite, at, senses, now, cells, grid, ear)


@compiled
def pass_hold(
    w: int, first: bool, state: State, course: Course, facts: Facts, plant: Plant, rules: Rules, now: Columns,
    cells: Cells,
) -> Grid:  # fmt: skip
    """One control hold of world w and what becomes true by it; the cells of the living afterwards."""
    hold(w, first, state, facts, plant, rules, now)
    state.tick[w] += 1
    lose(w, state, course, facts, rules)
    grid = arrange(w, state, rules, now, cells)
    began = measure(w, state, course, facts, rules, cells, grid)
    if rules.contact_ends and began > 0:
        for i in range(state.alive.shape[1]):
            if facts.contacts[w, i] > 0:
                drop(w, i, state, facts)
        grid = arrange(w, state, rules, now, cells)
    judge(w, state, course, facts, rules)
    return grid


@compiled
def step_world(
    w: int, action: Float32, state: State, course: Course, facts: Facts, senses: Senses, plant: Plant, rules: Rules,
    suite: Suite, at: Offsets, now: Columns, cells: Cells, ear: Ear,
) -> None:  # fmt: skip
    """One decision period of a world. ``action`` (world, vehicle, 2) holds shares of full force, body frame.

    A world that has diverged stays as it is.
    """
    if facts.diverged[w] >= 0:
        return
    clear(w, facts)
    num_alive = 0
    for i in range(action.shape[1]):
        num_alive += int(state.alive[w, i])
    load(w, state.eta, state.nu, now)
    aim(w, action, now)
    grid = pass_hold(w, True, state, course, facts, plant, rules, now, cells)
    for _ in range(1, rules.holds):
        grid = pass_hold(w, False, state, course, facts, plant, rules, now, cells)
    facts.saturated[w] /= max(num_alive * rules.holds, 1)
    perceive(w, state, course, facts, suite, at, senses, now, cells, grid, ear)


@compiled
def step_alone(
    action: Float32, state: State, course: Course, facts: Facts, senses: Senses, plant: Plant, rules: Rules,
    suite: Suite, at: Offsets, room: Scratch,
) -> bool:  # fmt: skip
    """One decision period of the only world; whether it has diverged."""
    now, cells, ear = desk(room, 0)
    step_world(0, action, state, course, facts, senses, plant, rules, suite, at, now, cells, ear)
    return facts.diverged[0] >= 0


@compiled_parallel
def step_worlds(
    threads: int, active: Bool, action: Float32, state: State, course: Course, facts: Facts, senses: Senses,
    plant: Plant, rules: Rules, suite: Suite, at: Offsets, room: Scratch,
) -> bool:  # fmt: skip
    """One decision period of every active world, a run of worlds for each thread; whether any has diverged."""
    share = (action.shape[0] + threads - 1) // threads
    for t in numba.prange(threads):
        now, cells, ear = desk(room, t)
        for w in range(t * share, min((t + 1) * share, action.shape[0])):
            if active[w]:
                step_world(w, action, state, course, facts, senses, plant, rules, suite, at, now, cells, ear)
    diverged = False
    for w in range(action.shape[0]):
        diverged = diverged or facts.diverged[w] >= 0
    return diverged
