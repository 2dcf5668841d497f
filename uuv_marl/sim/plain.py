"""The physics in plain Python, in the order of a step: ``PlainEngine.decide`` is one decision of a swarm.

Its parts follow in that order; the formulas that they use are in ``formulas.py`` and ``formulas_sonar.py``. Nothing is
sorted, tabulated or skipped, so it is slow. The compiled engine gives the same bits: tests/test_engines.py. Who changes
the physics changes both.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.percept import MAX_SPEED, Percept, PerceptLayout
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import interpreted
from uuv_marl.sim.formulas import (
    Row,
    Rows,
    actuators,
    advance,
    cos_sin,
    cut,
    effort,
    held,
    hypot,
    lagging,
    limited,
    passed,
    reference,
    to_body,
    to_world,
    wrap,
)  # fmt: skip
from uuv_marl.sim.formulas_sonar import between_vehicles, echo, hear, middle, sub_sectors, to_obstacles
from uuv_marl.sim.model import model
from uuv_marl.sim.sea.actuation import THRUSTER, YAW, is_lost
from uuv_marl.sim.sea.sea import Sea, begin, drift, know, reads, take_readings
from uuv_marl.sim.spacing import NOWHERE
from uuv_marl.sim.vehicle import STILL, Plant
from uuv_marl.sim.views import Fields, SeaFields
from uuv_marl.sim.world import RUNAWAY


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
        action = [limited(a, self.plant) for a in action]
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
        """One control hold. Forces keep their direction in the world, from the headings [rad] at the decision.

        A rudder keeps its angle.
        """
        state, facts = self.state, self.facts
        state.before[w] = state.eta[w, :, :2]
        for i in self.living(w):
            now: Row = [*state.eta[w, i].tolist(), *state.nu[w, i].tolist()]
            a = action[i] if decided_at is None else held(action[i], now[2] - decided_at[i], self.plant)
            tau = actuators(a, now[5], self.plant)
            now = self.swim(now, tau) if self.sea is None else self.swim_at_sea(w, i, now, tau, self.sea)
            x, y, psi, u, v, r = now
            if not abs(u) + abs(v) + abs(r) < RUNAWAY:  # or not a number: the vehicle stays where it was
                facts.diverged[w] = i if facts.diverged[w] < 0 else facts.diverged[w]
                continue
            state.eta[w, i], state.nu[w, i] = (x, y, wrap(psi)), (u, v, r)
            demand = effort(a, self.plant)
            facts.effort[w, i] += demand / self.rules.holds
            facts.saturated[w] += demand >= 1.0 - 1e-6

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
        discs_before = self.state.obstacles_before[w]
        clearance, reached, touched = to_obstacles(now, before, alive, hull, discs, discs_before.tolist())
        discs_before[:], discs_before[: len(discs)] = NOWHERE, self.course.obstacles[w, : len(discs)]
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
        """Where l(t) is and where the swarm's centre; the swarm arrives once it has rested long enough, or passed."""
        state, facts, rules, last = self.state, self.facts, self.rules, int(self.course.last[w])
        t = int(state.tick[w]) * rules.hold_s
        times = self.course.times[w, : last + 1].tolist()
        corners = self.course.waypoints[w, : last + 1].tolist()
        l_x, l_y, *_ = facts.reference[w] = reference(t, corners, times, rules.passes)
        facts.time_s[w], facts.centre[w] = t, math.nan
        places = [(x, y) for x, y, _ in state.eta[w, self.living(w)].tolist()]
        if not places:
            return
        c_x, c_y = facts.centre[w] = middle(places)
        at_x, at_y, beyond = passed(c_x, c_y, corners) if rules.passes else (l_x, l_y, True)
        there = beyond and t >= times[last]
        whole = max(hypot(x - at_x, y - at_y) for x, y in places) <= rules.spread
        for k, radius in enumerate(rules.arrival_radii):
            if not (there and whole and hypot(c_x - at_x, c_y - at_y) <= radius):
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
