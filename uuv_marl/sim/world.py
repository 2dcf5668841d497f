"""One world, compiled: move, lose, survey, judge arrival, write percepts. ``Swarm`` holds the arrays it works on.

Every array's first axis is the world; each function touches the rows of one world only, so that a world's run never
depends on its neighbours in the batch.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import Offsets
from uuv_marl.sim.compiled import compiled, compiled_parallel
from uuv_marl.sim.sonar import Suite, Survey, survey_world, write_percept
from uuv_marl.sim.trajectory import reference
from uuv_marl.sim.vehicle import Plant, actuators, advance, project, turned, wrap

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


class State(NamedTuple):
    """What a step changes."""

    eta: Float64
    """Pose (north [m], east [m], heading [rad]), shape (world, vehicle, 3)."""
    nu: Float64
    """Velocity (surge, sway [m/s], yaw rate [rad/s]), shape (world, vehicle, 3)."""
    before: Float64
    """Positions one control hold ago [m], shape (world, vehicle, 2)."""
    alive: Bool
    """False for lost vehicles, shape (world, vehicle)."""
    tick: Int64
    """Control holds since the reset, shape (world,)."""
    dwell: Int64
    """Control holds for which the swarm has rested within each arrival radius, shape (world, radius)."""


class Course(NamedTuple):
    """What a reset draws."""

    waypoints: Float64
    """Corners of the trajectory [m], padded, shape (world, point, 2)."""
    times: Float64
    """When l(t) passes them [s], shape (world, point)."""
    last: Int64
    """Index of the last corner, shape (world,)."""
    obstacles: Float64
    """Centre north, east and radius [m], padded, shape (world, obstacle, 3)."""
    num_obstacles: Int64
    """Obstacles of each world, shape (world,)."""
    losses: Int64
    """Vehicle lost at each scheduled loss, shape (world, loss)."""


class Facts(NamedTuple):
    """What is true of the latest step; smallest values and counts are over all its control holds. Lengths in m."""

    time_s: Float64
    """Since the reset, shape (world,)."""
    reference: Float64
    """Position and velocity of l(t), shape (world, 4)."""
    centre: Float64
    """Mean position of the living, shape (world, 2)."""
    spacing: Float64
    """Each vehicle's smallest distance to another, shape (world, vehicle); infinite for the lost."""
    min_spacing: Float64
    """Smallest of them, shape (world,)."""
    max_spacing: Float64
    """Largest distance between two vehicles at the end of the step, shape (world,)."""
    clearance: Float64
    """Each vehicle's smallest distance to an obstacle's surface, shape (world, vehicle); negative inside."""
    obstacle_clearance: Float64
    """The same for each obstacle, shape (world, obstacle); infinite in the padding."""
    contacts: Int64
    """Contact episodes that began, for each vehicle, shape (world, vehicle)."""
    collisions: Int64
    """Contact episodes that began, shape (world,)."""
    lost: Bool
    """Vehicles lost in this step, shape (world, vehicle)."""
    effort: Float64
    """Mean squared action (share of full force), shape (world, vehicle)."""
    saturated: Float64
    """Share of actions at the actuators' limit, shape (world,)."""
    arrival_s: Float64
    """When the swarm arrived, by ``Rules.arrival_radii``; NaN before, shape (world, radius)."""


class Rules(NamedTuple):
    """The scenario's clocks and thresholds, and the loss schedule."""

    hold_s: float
    step_s: float
    holds: int
    steps: int
    hull: float
    contact_ends: bool
    dwell_ticks: int
    spread: float
    arrival_radii: Float64
    loss_ticks: Int64


@compiled
def move(w: int, forces: Float64, state: State, facts: Facts, plant: Plant, rules: Rules) -> None:
    """One control hold: actions become forces, forces become motion. Eq. 1-4, 22-24.

    ``forces`` (vehicle, 3) keeps each vehicle's projected action and the heading at which it was decided.
    """
    eta, nu = state.eta[w], state.nu[w]
    for i in range(eta.shape[0]):
        state.before[w, i, 0], state.before[w, i, 1] = eta[i, 0], eta[i, 1]
        if not state.alive[w, i]:
            continue
        x, y, psi, u, v, r = eta[i, 0], eta[i, 1], eta[i, 2], nu[i, 0], nu[i, 1], nu[i, 2]
        turn = psi - forces[i, 2]
        a_x, a_y = forces[i, 0], forces[i, 1]
        if turn != 0.0:
            a_x, a_y = turned(a_x, a_y, turn, plant)
            a_x, a_y = project(a_x, a_y)
        tau_u, tau_r = actuators(a_x, a_y, r, plant)
        for _ in range(rules.steps):
            x, y, psi, u, v, r = advance(x, y, psi, u, v, r, tau_u, tau_r, rules.step_s, plant)
        eta[i, 0], eta[i, 1], eta[i, 2] = x, y, wrap(psi)
        nu[i, 0], nu[i, 1], nu[i, 2] = u, v, r
        squared = a_x * a_x + a_y * a_y
        facts.effort[w, i] += squared / rules.holds
        if squared >= 1.0 - 1e-6:
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
def look(w: int, listens: bool, state: State, course: Course, rules: Rules, suite: Suite, found: Survey) -> None:
    """Survey the pairs of a world as it stands."""
    survey_world(
        state.eta[w], state.before[w], state.alive[w], course.obstacles[w], course.num_obstacles[w],
        rules.hull, listens, suite, found,
    )  # fmt: skip


@compiled
def keep(w: int, facts: Facts, found: Survey) -> None:
    """Fold one survey into the facts of the step."""
    for i in range(found.spacing.shape[0]):
        facts.spacing[w, i] = min(facts.spacing[w, i], found.spacing[i])
        facts.clearance[w, i] = min(facts.clearance[w, i], found.clearance[i])
        facts.contacts[w, i] += found.contacts[i]
    for k in range(found.obstacle_clearance.shape[0]):
        facts.obstacle_clearance[w, k] = min(facts.obstacle_clearance[w, k], found.obstacle_clearance[k])
    facts.min_spacing[w] = min(facts.min_spacing[w], found.extremes[0])
    facts.max_spacing[w] = found.extremes[1]
    facts.collisions[w] += int(found.extremes[2])


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
    w: int, state: State, course: Course, facts: Facts, suite: Suite, found: Survey, at: Offsets, percept: Float32
) -> None:
    """Write the percepts of a world; those of lost vehicles are zero."""
    l_now = (facts.reference[w, 0], facts.reference[w, 1], facts.reference[w, 2], facts.reference[w, 3])
    for i in range(state.eta.shape[1]):
        if state.alive[w, i]:
            write_percept(
                i, state.eta[w], state.nu[w], found.heading, found.heard[i], l_now,
                course.obstacles[w], course.num_obstacles[w], suite, at, percept[w, i],
            )  # fmt: skip
        else:
            percept[w, i] = 0.0


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
def scratch(found: Survey, w: int) -> Survey:
    """One world's rows of the scratch arrays."""
    return Survey(
        found.heading[w], found.nearest[w], found.heard[w], found.spacing[w], found.clearance[w],
        found.obstacle_clearance[w], found.contacts[w], found.extremes[w],
    )  # fmt: skip


@compiled
def observe_world(
    w: int, state: State, course: Course, facts: Facts, rules: Rules, suite: Suite, found: Survey, at: Offsets,
    percept: Float32,
) -> None:  # fmt: skip
    """Facts and percepts of a world that has just been reset."""
    mine = scratch(found, w)
    clear(w, facts)
    state.dwell[w] = 0
    facts.arrival_s[w] = math.nan
    look(w, True, state, course, rules, suite, mine)
    keep(w, facts, mine)
    judge(w, state, course, facts, rules)
    perceive(w, state, course, facts, suite, mine, at, percept)


@compiled
def step_world(
    w: int, action: Float32, forces: Float64, state: State, course: Course, facts: Facts, plant: Plant, rules: Rules,
    suite: Suite, found: Survey, at: Offsets, percept: Float32,
) -> None:  # fmt: skip
    """One decision period of a world. ``action`` (world, vehicle, 2) holds shares of full force, body frame."""
    mine = scratch(found, w)
    clear(w, facts)
    num_alive = 0
    for i in range(action.shape[1]):
        a_x, a_y = project(float(action[w, i, 0]), float(action[w, i, 1]))
        forces[w, i, 0], forces[w, i, 1], forces[w, i, 2] = a_x, a_y, state.eta[w, i, 2]
        num_alive += int(state.alive[w, i])
    for hold in range(rules.holds):
        move(w, forces[w], state, facts, plant, rules)
        state.tick[w] += 1
        lose(w, state, course, facts, rules)
        listens = hold == rules.holds - 1
        look(w, listens, state, course, rules, suite, mine)
        keep(w, facts, mine)
        if rules.contact_ends and mine.extremes[2] > 0.0:
            for i in range(action.shape[1]):
                if mine.contacts[i] > 0:
                    drop(w, i, state, facts)
            look(w, listens, state, course, rules, suite, mine)
        judge(w, state, course, facts, rules)
    facts.saturated[w] /= max(num_alive * rules.holds, 1)
    perceive(w, state, course, facts, suite, mine, at, percept)


@compiled_parallel
def step_worlds(
    active: Bool, action: Float32, forces: Float64, state: State, course: Course, facts: Facts, plant: Plant,
    rules: Rules, suite: Suite, found: Survey, at: Offsets, percept: Float32,
) -> None:  # fmt: skip
    """One decision period of every active world, worlds spread over threads."""
    for w in numba.prange(action.shape[0]):
        if active[w]:
            step_world(w, action, forces, state, course, facts, plant, rules, suite, found, at, percept)
