"""The physics as the paper's formulas say it, in plain Python: a vehicle, a pair, a sub-sector at a time.

Read from the top: ``PlainEngine.decide`` is one decision of a swarm; its parts follow in the order of a step, and below
each the formulas. Nothing is sorted, tabulated or skipped, so it is slow. The compiled engine gives the same bits:
tests/test_engines.py. Who changes the physics changes both.

Symbols are those of ``uuv_marl.sim.vehicle``: eta = (x north, y east, psi clockwise from north), nu = (u surge, v sway,
r yaw rate) in the body frame, x forward, y starboard; SI units and radians. Equation numbers are the paper's.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import MAX_SPEED, Percept, PerceptLayout
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.scenario.sections import SonarArray
from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import interpreted
from uuv_marl.sim.model import model
from uuv_marl.sim.sea.actuation import THRUSTER, YAW, is_lost
from uuv_marl.sim.sea.sea import Sea, begin, drift, know, reads, take_readings
from uuv_marl.sim.trigonometry import cos_sin as compiled_cos_sin
from uuv_marl.sim.vehicle import STILL, Plant
from uuv_marl.sim.views import Fields, SeaFields
from uuv_marl.sim.world import RUNAWAY

Row = Sequence[float]
Rows = Sequence[Row]
"""One row for each vehicle, obstacle (centre north and east, radius [m]), waypoint or sub-sector."""
Pair = tuple[float, float]

_cos_sin: Callable[[float], Pair] = getattr(compiled_cos_sin, "py_func", compiled_cos_sin)


class PlainEngine:
    """Steps worlds one after the other in plain Python. See ``uuv_marl.sim.engine.Engine``."""

    def __init__(self, scenario: Scenario, world: World, sea: Sea | None) -> None:
        self.world, self.sea = world, sea
        self.state, self.course, self.facts, self.senses = world
        numbers = model(scenario)
        self.plant, self.rules, self.sonar = numbers.plant, numbers.rules, scenario.sonar
        self.sectors = sub_sectors(scenario.sonar.arrays)
        self.percept = Percept(world.senses.percept, PerceptLayout.of(scenario))
        absent = np.zeros((*world.state.alive.shape, 0, 2), np.float32)
        every = dict.fromkeys(("compass", "link_identity", *SeaFields._fields), absent[..., 0])
        every |= {"link_velocity": absent, "modem_velocity": absent, **{n: self.percept[n] for n in self.percept.names}}
        self.fields = Fields(**{name: every[name] for name in Fields._fields})
        self.sea_fields = SeaFields(**{name: every[name] for name in SeaFields._fields})

    def step(self, action: NDArray[np.float32], active: NDArray[np.bool_] | None) -> bool:
        """See ``Engine``."""
        for w in range(len(action)):
            if (active is None or active[w]) and self.facts.diverged[w] < 0:
                self.decide(w, action[w].tolist())
        return bool((self.facts.diverged >= 0).any())

    def decide(self, w: int, action: Rows) -> None:
        """One decision period of world w: control holds, and what is perceived after the last."""
        self.clear_facts(w)
        acting, decided_at = self.living(w), self.state.eta[w, :, 2].tolist()
        action = [project(*a) for a in action]
        for hold in range(self.rules.holds):
            self.move(w, action, None if hold == 0 else decided_at)
            self.state.tick[w] += 1
            self.apply_losses(w)
            self.measure(w)
            self.lose_touching(w)
            self.check_arrival(w)
            if self.sea is not None:
                interpreted(drift)(w, self.world, self.sea)
            if hold == self.rules.holds - 1 or (
                self.sea is not None and interpreted(reads)(w, self.state.tick[w], self.sea)
            ):
                self.perceive(w)
                if self.sea is not None:
                    interpreted(take_readings)(w, self.world, self.sea, self.fields)
        self.facts.saturated[w] /= max(len(acting) * self.rules.holds, 1)
        if self.sea is not None:
            interpreted(know)(w, self.world, self.sea, self.fields, self.sea_fields)

    def observe(self, w: int) -> None:
        """See ``Engine``."""
        self.clear_facts(w)
        self.state.dwell[w], self.facts.arrival_s[w], self.facts.diverged[w] = 0, math.nan, -1
        self.measure(w)
        self.check_arrival(w)
        self.perceive(w)
        if self.sea is not None:
            interpreted(begin)(w, self.world, self.sea)
            interpreted(take_readings)(w, self.world, self.sea, self.fields)
            interpreted(know)(w, self.world, self.sea, self.fields, self.sea_fields)

    def clear_facts(self, w: int) -> None:
        """Clear what is true of one decision."""
        facts = self.facts
        facts.spacing[w] = facts.min_spacing[w] = facts.clearance[w] = facts.obstacle_clearance[w] = math.inf
        facts.contacts[w] = facts.collisions[w] = facts.effort[w] = facts.saturated[w] = 0
        facts.lost[w] = False

    def living(self, w: int) -> list[int]:
        """Indices of the vehicles that are not lost."""
        return np.flatnonzero(self.state.alive[w]).tolist()

    def discs(self, w: int) -> Rows:
        """The obstacles that there are."""
        return self.course.obstacles[w, : self.course.num_obstacles[w]].tolist()

    # --- Motion ---

    def move(self, w: int, action: Rows, decided_at: Row | None) -> None:
        """One control hold. Forces keep their direction in the world, from the headings [rad] at the decision."""
        state, facts = self.state, self.facts
        state.before[w] = state.eta[w, :, :2]
        for i in self.living(w):
            now: Row = [*state.eta[w, i].tolist(), *state.nu[w, i].tolist()]
            a = action[i] if decided_at is None else turned(action[i], now[2] - decided_at[i], self.plant)
            tau = actuators(a, now[5], self.plant)
            now = self.swim(now, tau) if self.sea is None else self.swim_at_sea(w, i, now, tau, self.sea)
            x, y, psi, u, v, r = now
            if not abs(u) + abs(v) + abs(r) < RUNAWAY:  # or not a number: the vehicle stays where it was
                facts.diverged[w] = i if facts.diverged[w] < 0 else facts.diverged[w]
                continue
            state.eta[w, i], state.nu[w, i] = (x, y, wrap(psi)), (u, v, r)
            effort = a[0] * a[0] + a[1] * a[1]
            facts.effort[w, i] += effort / self.rules.holds
            facts.saturated[w] += effort >= 1.0 - 1e-6

    def swim(self, now: Row, tau: Row) -> Row:
        """One control hold of a vehicle in still water."""
        for _ in range(self.rules.steps):
            now = advance(now, (tau, tau, tau), STILL, self.rules.step_s, self.plant)
        return now

    def swim_at_sea(self, w: int, i: int, now: Row, tau: Row, sea: Sea) -> Row:
        """The same of vehicle i with numbers, lags and faults of its own, which the water carries along.

        Args:
            w: index of the world.
            i: index of the vehicle.
            now: pose, and velocity through the water.
            tau: thrust [N] and torque [N m] as asked of it.
            sea: the forces that reach the water are written.
        """
        numbers, hull, tick = sea.actuation, sea.hull, int(self.state.tick[w])
        thrust, torque = tau[0] * float(hull.thrust[w, i]), tau[1] * numbers.yaw_authority
        for f, kind in enumerate(numbers.kind):
            if hull.broken[w, i, f, 0] <= tick < hull.broken[w, i, f, 1]:
                thrust *= float(numbers.efficiency[f]) if kind == THRUSTER else 1.0
                torque *= float(numbers.efficiency[f]) if kind == YAW else 1.0
        plant, flow = Plant(*hull.plants[w, i].tolist()), sea.flow.flow[w, i].tolist()
        for _ in range(self.rules.steps):
            given = hull.tau[w, i].tolist()
            thrusts = lagging(thrust, given[0], numbers.thrust_half, numbers.thrust_whole)
            torques = lagging(torque, given[1], numbers.yaw_half, numbers.yaw_whole)
            now = advance(now, list(zip(thrusts, torques, strict=True)), flow, self.rules.step_s, plant)
            hull.tau[w, i] = thrusts[2], torques[2]
        return now

    # --- What becomes true by it ---

    def apply_losses(self, w: int) -> None:
        """Vehicles whose scheduled time has come fall silent and stop."""
        for tick, i in zip(self.rules.loss_ticks, self.course.losses[w], strict=True):
            if tick == self.state.tick[w]:
                self.lose_vehicle(w, i)
        if self.sea is not None:
            for i in self.living(w):
                if interpreted(is_lost)(w, i, self.state.tick[w], self.sea.actuation, self.sea.hull):
                    self.lose_vehicle(w, i)

    def lose_vehicle(self, w: int, i: int) -> None:
        """Lose vehicle i."""
        if self.state.alive[w, i]:
            self.state.alive[w, i], self.state.nu[w, i], self.facts.lost[w, i] = False, 0.0, True

    def measure(self, w: int) -> None:
        """Smallest distances so far, the largest one now, and the contacts that begin now."""
        facts, alive, hull = self.facts, self.state.alive[w].tolist(), self.rules.hull
        now, before, discs = self.state.eta[w, :, :2].tolist(), self.state.before[w].tolist(), self.discs(w)
        spacing, largest, met = between_vehicles(now, before, alive, hull)
        clearance, reached, touched = to_obstacles(now, before, alive, hull, discs)
        facts.spacing[w] = np.minimum(facts.spacing[w], spacing)
        facts.min_spacing[w], facts.max_spacing[w] = facts.spacing[w].min(), largest
        facts.clearance[w] = np.minimum(facts.clearance[w], clearance)
        facts.obstacle_clearance[w, : len(discs)] = np.minimum(facts.obstacle_clearance[w, : len(discs)], reached)
        facts.contacts[w] += np.add(met, touched)
        facts.collisions[w] += sum(met) // 2 + sum(touched)  # two vehicles have one collision

    def lose_touching(self, w: int) -> None:
        """Lose whom a contact ends."""
        for i in self.living(w):
            if self.rules.contact_ends and self.facts.contacts[w, i] > 0:
                self.lose_vehicle(w, i)

    def check_arrival(self, w: int) -> None:
        """Where l(t) is and where the swarm's centre; the swarm arrives once it has rested at the end long enough."""
        state, facts, rules, last = self.state, self.facts, self.rules, int(self.course.last[w])
        t = int(state.tick[w]) * rules.hold_s
        times = self.course.times[w, : last + 1].tolist()
        l_x, l_y, *_ = facts.reference[w] = reference(t, self.course.waypoints[w, : last + 1].tolist(), times)
        facts.time_s[w], facts.centre[w] = t, math.nan
        places = [(x, y) for x, y, _ in state.eta[w, self.living(w)].tolist()]
        if not places:
            return
        c_x, c_y = facts.centre[w] = middle(places)
        rests = t >= times[last] and max(hypot(x - l_x, y - l_y) for x, y in places) <= rules.spread
        for k, radius in enumerate(rules.arrival_radii):
            if not (rests and hypot(c_x - l_x, c_y - l_y) <= radius):
                state.dwell[w, k] = 0
                continue
            if state.dwell[w, k] == rules.dwell_ticks and math.isnan(facts.arrival_s[w, k]):
                facts.arrival_s[w, k] = t - rules.dwell_ticks * rules.hold_s
            state.dwell[w, k] += 1

    # --- What is perceived ---

    def perceive(self, w: int) -> None:
        """What every living vehicle hears, and the percept made of all that it knows."""
        senses, discs, alive = self.senses, self.discs(w), self.state.alive[w].tolist()
        eta, nu = self.state.eta[w].tolist(), self.state.nu[w].tolist()
        heading = [cos_sin(psi) for _, _, psi in eta]
        senses.heading[w], senses.heard[w], senses.percept[w] = heading, -1, 0.0
        for i in self.living(w):
            heard = hear(i, eta, heading, alive, self.sectors, discs if self.sonar.obstacles_hide_vehicles else [])
            senses.heard[w, i] = heard
            see = {name: self.percept[name][w, i] for name in self.percept.names}
            self.know_oneself(w, i, heading[i], see)
            for k, j in enumerate(heard):
                if j >= 0:
                    know_neighbour(k, i, j, eta, nu, heading, see)
            for a, k in enumerate(self.sectors.active):
                self.know_obstacles(a, k, eta[i], heading[i], discs, see)

    def know_oneself(self, w: int, i: int, heading: Row, see: dict[str, Any]) -> None:
        """Write one's own velocity, where l(t) is and how it moves.

        Args:
            w: index of the world.
            i: index of the vehicle.
            heading: cosine and sine of its heading.
            see: its percept by name, which is written.
        """
        x, y, _ = self.state.eta[w, i].tolist()
        u, v, r = self.state.nu[w, i].tolist()
        l_x, l_y, v_x, v_y = self.facts.reference[w].tolist()
        see["velocity"][:], see["yaw_rate"][:] = cut(MAX_SPEED, u, v), cut(MAX_SPEED, r)
        far = max(math.sqrt((l_x - x) * (l_x - x) + (l_y - y) * (l_y - y)) / MAX_RANGE_M, 1.0)
        ahead, abeam = to_body(l_x - x, l_y - y, heading)
        see["reference"][:] = cut(MAX_RANGE_M, ahead / far, abeam / far)
        see["reference_velocity"][:] = cut(MAX_SPEED, *to_body(v_x, v_y, heading))
        if "compass" in see:
            see["compass"][:] = heading

    def know_obstacles(self, a: int, k: int, eta: Row, heading: Row, discs: Rows, see: dict[str, Any]) -> None:
        """Write the nearest surface in one sub-sector. Eq. 11, 16-17.

        Args:
            a: index of the sub-sector among the active ones.
            k: its index among all.
            eta: the vehicle's pose: north and east [m], heading [rad].
            heading: cosine and sine of its heading.
            discs: the obstacles: centre north and east, radius [m], a row each.
            see: its percept by name, which is written.
        """
        nearest = self.sectors.range_m[k]
        for x, y, radius in discs:
            centre = to_body(x - eta[0], y - eta[1], heading)
            away, point = echo(centre, radius, self.sectors.lower[k], self.sectors.upper[k])
            if away < nearest:
                see["echo"][a], see["echo_range"][a], nearest = 1.0, away, away
                reported = point if self.sonar.echo_reports == "surface" else centre
                see["echo_position"][a] = cut(MAX_RANGE_M, *reported)


def know_neighbour(k: int, i: int, j: int, eta: Rows, nu: Rows, heading: Rows, see: dict[str, Any]) -> None:
    """Write where vehicle j is, whom vehicle i hears in sub-sector k; by the link also who it is and its velocity.

    Args:
        k: index of the sub-sector.
        i: index of the vehicle that hears.
        j: index of the vehicle that is heard.
        eta: poses: north and east [m], heading [rad], a row for each vehicle.
        nu: velocities in the body frame: surge, sway [m/s], yaw rate [rad/s], a row for each vehicle.
        heading: cosine and sine of the heading, a row for each vehicle.
        see: percept of vehicle i by name, which is written.
    """
    see["heard"][k] = 1.0
    see["neighbour"][k] = to_body(eta[j][0] - eta[i][0], eta[j][1] - eta[i][1], heading[i])
    if "link_identity" in see:
        see["link_identity"][k] = j + 1
        see["link_velocity"][k] = cut(MAX_SPEED, *to_body(*to_world(nu[j][0], nu[j][1], heading[j]), heading[i]))


# --- Formulas: frames ---


def cos_sin(angle: float) -> Pair:
    """Cosine and sine [rad]: the package's own (``uuv_marl.sim.trigonometry``), whose bits no C library decides."""
    return _cos_sin(angle) if math.isfinite(angle) else (math.nan, math.nan)


def wrap(angle: float) -> float:
    """The same angle [rad] in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


def to_world(ahead: float, abeam: float, heading: Row) -> Pair:
    """R(psi): a vector's north and east from the body frame. ``heading`` holds cos psi and sin psi. Eq. 1."""
    return heading[0] * ahead - heading[1] * abeam, heading[1] * ahead + heading[0] * abeam


def to_body(north: float, east: float, heading: Row) -> Pair:
    """R(psi) transposed: how far a vector points ahead and abeam, from the world frame."""
    return heading[0] * north + heading[1] * east, heading[0] * east - heading[1] * north


def cross(a: Row, b: Row) -> float:
    """Positive where b is clockwise of a, by less than half a turn."""
    return a[0] * b[1] - a[1] * b[0]


def hypot(x: float, y: float) -> float:
    """Length of a vector, by the C library's function, as in compiled code; Python's own rounds otherwise."""
    return float(np.hypot(x, y))


def cut(limit: float, *values: float) -> list[float]:
    """The nearest values within [-limit, limit]."""
    return [min(max(value, -limit), limit) for value in values]


# --- Formulas: motion ---


def project(a_x: float, a_y: float) -> Pair:
    """The nearest action on the unit disc, direction kept."""
    norm = math.sqrt(a_x * a_x + a_y * a_y)
    return (a_x / norm, a_y / norm) if norm > 1.0 else (a_x, a_y)


def turned(a: Row, angle: float, p: Plant) -> Pair:
    """The action that keeps the same horizontal force in the world after the vehicle has turned by an angle [rad]."""
    f_x, f_y = to_body(a[0] * p.max_force, a[1] * p.max_torque / p.lever_arm, cos_sin(angle))
    return project(f_x / p.max_force, f_y * p.lever_arm / p.max_torque)


def actuators(a: Row, r: float, p: Plant) -> Pair:
    """Thrust [N] and torque [N m] of an action; an inner loop damps the yaw rate. Eq. 22."""
    return p.max_force * a[0], cut(p.max_torque, p.max_torque * a[1] - p.yaw_damping * r)[0]


def lagging(asked: float, given: float, half: float, whole: float) -> tuple[float, float, float]:
    """A force now, half a step and a step later: asked + (given - asked) e^(-t / lag), whose shares are given.

    Args:
        asked: thrust [N] or torque [N m] that is asked for.
        given: what reaches the water now, in the same unit.
        half: e^(-t / lag) after half a step.
        whole: e^(-t / lag) after a step; 0 without a lag.
    """
    if whole == 0.0:
        return asked, asked, asked
    return given, asked + (given - asked) * half, asked + (given - asked) * whole


def derivative(now: Row, tau: Row, flow: Row, p: Plant) -> Row:
    """Rates of (x, y, psi, u, v, r): eta' = R(psi) nu + flow, nu' = M^-1 (tau - C(nu) nu - D(nu) nu). Eq. 1-2, 4.

    Args:
        now: (x, y, psi, u, v, r), velocities relative to the water.
        tau: thrust [N] and torque [N m].
        flow: velocity of the water, north and east [m/s].
        p: the vehicle.
    """
    _, _, psi, u, v, r = now
    a = p.m * (p.x_G * r + v) - p.Y_vdot * v - p.Y_rdot * r
    b = p.m * u - p.X_udot * u
    f_u = tau[0] - -a * r - (p.X_u + p.X_uu * abs(u)) * u
    f_v = -b * r - ((p.Y_v + p.Y_vv * abs(v)) * v - (p.Y_r + p.Y_rr * abs(r)) * r)
    f_r = tau[1] - (a * u - b * v) - (-(p.N_v + p.N_rv * abs(r)) * v + (p.N_r + p.N_rr * abs(r)) * r)
    north, east = to_world(u, v, cos_sin(psi))
    return (
        north + flow[0],
        east + flow[1],
        r,
        p.inverse_11 * f_u,
        p.inverse_22 * f_v + p.inverse_23 * f_r,
        p.inverse_23 * f_v + p.inverse_33 * f_r,
    )


def advance(now: Row, tau: Rows, flow: Row, h: float, p: Plant) -> Row:
    """The state one step of h [s] later: the classical fourth-order Runge-Kutta method. Eq. 23-24.

    Args:
        now: the state, velocities relative to the water.
        tau: thrust [N] and torque [N m] now, half a step and a step later.
        flow: velocity of the water, north and east [m/s].
        h: the step [s].
        p: the vehicle.
    """

    def after(rate: Row, seconds: float) -> Row:
        return [value + seconds * change for value, change in zip(now, rate, strict=True)]

    k_1 = derivative(now, tau[0], flow, p)
    k_2 = derivative(after(k_1, 0.5 * h), tau[1], flow, p)
    k_3 = derivative(after(k_2, 0.5 * h), tau[1], flow, p)
    k_4 = derivative(after(k_3, h), tau[2], flow, p)
    return after([a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k_1, k_2, k_3, k_4, strict=True)], h / 6.0)


def reference(t: float, waypoints: Rows, times: Row) -> tuple[float, float, float, float]:
    """Position and velocity of l(t): constant speed from waypoint to waypoint, then at rest at the last. Eq. 5."""
    for k, (start, end) in enumerate(itertools.pairwise(waypoints)):
        if t < times[k + 1]:
            v_x, v_y = ((end[axis] - start[axis]) / (times[k + 1] - times[k]) for axis in range(2))
            return start[0] + v_x * (t - times[k]), start[1] + v_y * (t - times[k]), v_x, v_y
    return waypoints[-1][0], waypoints[-1][1], 0.0, 0.0


# --- Formulas: distances and contacts ---


def middle(places: Sequence[Pair]) -> Pair:
    """The mean place, summed in order: Python's own ``sum`` rounds otherwise."""
    x, y = 0.0, 0.0
    for north, east in places:
        x, y = x + north, y + east
    return x / len(places), y / len(places)


def squared_distance(a: Row, b: Row) -> float:
    """Of two points [m2]."""
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])


def between_vehicles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float
) -> tuple[list[float], float, list[int]]:
    """Each vehicle's distance to the nearest other [m], the largest distance [m], and each one's contacts that begin.

    A contact begins where two hulls overlap and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
    """
    n, touch, largest = len(now), 2.0 * hull, -math.inf
    spacing, contacts = [math.inf] * n, [0] * n
    for i in range(n):
        for j in range(n):
            if i == j or not alive[i] or not alive[j]:
                continue
            squared = squared_distance(now[i], now[j])
            spacing[i] = min(spacing[i], math.sqrt(squared))
            largest = max(largest, math.sqrt(squared))
            if squared < touch * touch and squared_distance(before[i], before[j]) >= touch * touch:
                contacts[i] += 1
    return spacing, largest if largest >= 0.0 else math.inf, contacts


def to_obstacles(
    now: Rows, before: Rows, alive: Sequence[bool], hull: float, discs: Rows
) -> tuple[list[float], list[float], list[int]]:
    """Each vehicle's distance to the nearest surface, each obstacle's to the nearest vehicle, and contacts that begin.

    Distances are in m. A contact begins where a hull meets an obstacle and did not one control hold before.

    Args:
        now: positions, north and east [m], a row for each vehicle.
        before: the same one control hold ago.
        alive: False for lost vehicles.
        hull: radius of a hull [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
    """
    clearance, reached, contacts = [math.inf] * len(now), [math.inf] * len(discs), [0] * len(now)
    for i in range(len(now)):
        for k in range(len(discs)):
            if not alive[i]:
                continue
            gap = math.sqrt(squared_distance(discs[k], now[i])) - discs[k][2]
            clearance[i], reached[k] = min(clearance[i], gap), min(reached[k], gap)
            if gap < hull and math.sqrt(squared_distance(discs[k], before[i])) - discs[k][2] >= hull:
                contacts[i] += 1
    return clearance, reached, contacts


# --- Formulas: sonar ---


class Sectors(NamedTuple):
    """Sub-sectors: the directions clockwise of the lower edge, up to and including the upper one."""

    lower: Rows
    """Unit vectors, body frame."""
    upper: Rows
    range_m: Row
    active: Sequence[int]
    """Those that hear obstacles."""


def sub_sectors(arrays: Sequence[SonarArray]) -> Sectors:
    """The sub-sectors of all arrays in order, those of an array of equal width. Eq. 12."""

    def unit(degrees: float) -> Pair:
        radians = math.radians((degrees + 180.0) % 360.0 - 180.0)
        return math.cos(radians), math.sin(radians)

    parts = [(array, k) for array in arrays for k in range(array.sub_sectors)]
    edges = [
        [unit(array.mounting_deg + array.aperture_deg * ((k + side) / array.sub_sectors - 0.5)) for side in (0, 1)]
        for array, k in parts
    ]
    return Sectors(
        lower=[lower for lower, _ in edges],
        upper=[upper for _, upper in edges],
        range_m=[array.range_m for array, _ in parts],
        active=[k for k, (array, _) in enumerate(parts) if array.kind == "active"],
    )


def hear(i: int, eta: Rows, heading: Rows, alive: Sequence[bool], sectors: Sectors, discs: Rows) -> list[int]:
    """Whom a vehicle hears in each sub-sector: the nearest, the lower index of equals, -1 for nobody. Eq. 8-9, 13-15.

    Args:
        i: index of the vehicle.
        eta: poses: north and east [m], heading [rad], a row for each vehicle.
        heading: cosine and sine of the heading, a row for each vehicle.
        alive: False for lost vehicles.
        sectors: the sonar's sub-sectors.
        discs: obstacles that silence whom they hide: centre north and east, radius [m], a row each.
    """
    nearest = [range_m * range_m for range_m in sectors.range_m]
    heard = [-1] * len(nearest)
    for j in range(len(eta)):
        if j == i or not alive[j]:
            continue
        dx, dy = eta[j][0] - eta[i][0], eta[j][1] - eta[i][1]
        squared, there = dx * dx + dy * dy, to_body(dx, dy, heading[i])
        for k in range(len(nearest)):
            inside = cross(sectors.lower[k], there) > 0.0 and cross(sectors.upper[k], there) <= 0.0
            if squared < nearest[k] and inside and not hidden(eta[i][0], eta[i][1], dx, dy, discs):
                nearest[k], heard[k] = squared, j
    return heard


def hidden(x: float, y: float, dx: float, dy: float, discs: Rows) -> bool:
    """Whether a disc meets the segment from (x, y) to (x + dx, y + dy).

    Args:
        x: start of the segment, north [m].
        y: start of the segment, east [m].
        dx: how far north of it the segment ends [m].
        dy: how far east of it the segment ends [m].
        discs: the obstacles: centre north and east, radius [m], a row each.
    """
    length2 = dx * dx + dy * dy
    for k in range(len(discs)):
        o_x, o_y = discs[k][0] - x, discs[k][1] - y
        share = min(max((o_x * dx + o_y * dy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        if hypot(o_x - share * dx, o_y - share * dy) < discs[k][2]:
            return True
    return False


def echo(centre: Pair, radius: float, lower: Row, upper: Row) -> tuple[float, Pair]:
    """Range [m] and place, body frame, of the point of a disc within a sub-sector that is nearest. Eq. 11, 16-17.

    That lies towards the centre, or on an edge where the centre is outside; at range 0 for a vehicle inside the disc.

    Args:
        centre: of the disc, ahead and to starboard [m].
        radius: of the disc [m].
        lower: lower edge of the sub-sector, a unit vector in the body frame.
        upper: upper edge, likewise.
    """
    distance = hypot(*centre)
    if distance <= radius:
        return 0.0, (0.0, 0.0)
    if cross(lower, centre) > 0.0 and cross(upper, centre) <= 0.0:
        share = 1.0 - radius / distance
        return distance - radius, (share * centre[0], share * centre[1])
    nearest, point = math.inf, (0.0, 0.0)
    for edge in (lower, upper):
        along, off = edge[0] * centre[0] + edge[1] * centre[1], cross(edge, centre)
        if along > 0.0 and abs(off) <= radius:
            reach = along - math.sqrt(radius * radius - off * off)
            if reach < nearest:
                nearest, point = reach, (reach * edge[0], reach * edge[1])
    return nearest, point
