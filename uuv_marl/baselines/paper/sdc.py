"""Single-informed distributed consensus (SDC): a reconstruction, since the paper only names it.

Every vehicle holds a slot of a hexagonal lattice relative to its predecessors: the detected neighbours whose slots are
nearer to the informed vehicle's. The informed vehicle's knowledge of l(t) thus spreads outwards along a directed graph.
The error is kept within a shrinking funnel (prescribed performance), and a velocity coordination term, a short-range
repulsion and an obstacle term are added.
"""

import math
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from uuv_marl.baselines.avoidance import bump, pass_obstacle
from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.policy import Limits, surge_resistance, write_action
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.errors import PolicyError
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.tables import described
from uuv_marl.sim.views import fields
from uuv_marl.types import Bool, Float32, Float64, Int64

SLOT_PITCH_M = 12.0  # distance between neighbouring slots
_MAX_XI = 0.99
_MOST_VEHICLES = 2000
"""Slot assignment takes time cubic in the swarm's size: 1.5 s here, a quarter of an hour for 16,384 vehicles."""


class SdcGains(NamedTuple):
    """Free parameters, found by tuning."""

    consensus: float  # force per unit of transformed error [N]
    rho_0: float  # half width of the funnel at the start [m]
    rho_inf: float  # half width of the funnel in the end [m]
    kappa: float  # decay rate of the funnel [1/s]
    reference: float  # weight of l(t) in the informed vehicle's error, all predecessors together weighing 1 [1]
    velocity: float  # velocity coordination [N s/m]
    short: float  # largest short-range repulsion per neighbour [N]
    short_range: float  # distance at which the short-range repulsion ends [m]
    repulsion: float  # largest repulsion from an obstacle [N]
    repulsion_range: float  # distance to the surface at which the repulsion ends [m]
    tangential: float  # largest sideways push [N]
    tangential_range: float  # distance to the surface at which the sideways push ends [m]
    drag: float  # share of the vehicle's drag that is compensated [1]
    reference_velocity: float  # damping of the informed vehicle towards the reference's velocity [N s/m]


@described
class SdcMemory(NamedTuple):
    """Slots of the lattice, and the time for which they have been held."""

    slots: Annotated[Float64, "world vehicle 2", "Each vehicle's slot, north and east of the lattice's centre [m]."]
    depth: Annotated[Float64, "world vehicle", "Its distance from the informed vehicle's slot [m]."]
    decisions: Annotated[Int64, "world", "Decisions since the slots were assigned, this one included."]


class Sdc(Controller):
    """Distributed consensus with prescribed performance; a single vehicle perceives the reference.

    Slots are assigned centrally from the first percepts of a world; from then on every vehicle acts on its own percept.
    The informed vehicle is the one whose slot is nearest to the lattice's centre.
    """

    # Without yaw damping, in the settings tried by hand, the informed vehicle left the others behind: none arrived.
    requirements = PolicyRequirements(("compass", "link", "identity"), yaw_damping_nms=600.0, outputs_force=True)
    Memory: ClassVar[type[Any] | None] = SdcMemory
    Gains = SdcGains
    tuned_as = "sdc"

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, gains: SdcGains | None = None) -> None:
        super().__init__(scenario, num_worlds, gains=gains)
        n = scenario.swarm.num_vehicles
        if n > _MOST_VEHICLES:
            raise PolicyError(
                f"{self.name} assigns slots to at most {_MOST_VEHICLES} vehicles, since more would take minutes; "
                f"scenario {scenario.name!r} has {n}; use fewer, or another policy"
            )
        self._lattice = hexagonal_slots(n)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Assign slots at a world's first decision; then count decisions, with which the funnel shrinks."""
        for w in np.flatnonzero(worlds & (self.memory.decisions == 0)):
            self._assign(int(w), Percept(percept.flat[w], percept.layout))
        self.memory.decisions[worlds] += 1

    def _write(self, percept: Percept, action: Float32) -> None:
        g, memory = self.gains, self.memory
        rho = (g.rho_0 - g.rho_inf) * np.exp(
            -g.kappa * self.scenario.timing.decision_period_s * (memory.decisions - 1)
        ) + g.rho_inf
        _act(
            self.flat(percept), self.at, g, self.limits, memory.slots, memory.depth, rho, action, self.clamps
        )  # fmt: skip

    def _assign(self, w: int, percept: Percept) -> None:
        """Assign slots with the smallest sum of squared distances from the start."""
        compass, to_reference = percept["compass"].astype(np.float64), percept["reference"].astype(np.float64)
        c, s = compass[:, 0], compass[:, 1]
        places = -np.stack(
            [c * to_reference[:, 0] - s * to_reference[:, 1], s * to_reference[:, 0] + c * to_reference[:, 1]], axis=1
        )
        places -= places.mean(axis=0)
        cost = ((places[:, None, :] - self._lattice[None, :, :]) ** 2).sum(axis=-1)
        _, slot = linear_sum_assignment(cost)
        slots = self.memory.slots[w] = self._lattice[slot]
        root = slots[np.argmin((slots**2).sum(axis=-1))]
        # Rounded, so that slots equally far from the informed one are peers, not predecessors of each other.
        self.memory.depth[w] = np.round(np.hypot(*(slots - root).T), 6)


def hexagonal_slots(n: int) -> Float64:
    """The n points of a hexagonal lattice nearest to its centre, mean zero [m], shape (vehicle, 2)."""
    reach = math.ceil(math.sqrt(n)) + 2
    row, column = (axis.ravel() - reach for axis in np.indices((2 * reach + 1, 2 * reach + 1)))
    points: Float64 = SLOT_PITCH_M * np.stack([row * math.sqrt(3) / 2, column + 0.5 * (row % 2)], axis=1)
    # Rounded, so that points at equal distances keep their order on every machine.
    squared: Float64 = np.round((points[:, 0] ** 2 + points[:, 1] ** 2), 6)
    nearest = points[np.argsort(squared, kind="stable")[:n]]
    return nearest - nearest.mean(axis=0)


@compiled
def _act(
    flat: Float32, at: Starts, g: SdcGains, limits: Limits, slots: Float64, depth: Float64, rho: Float64,
    action: Float32, clamps: Int64,
) -> None:  # fmt: skip
    """Write every vehicle's action.

    ``slots`` holds positions in the formation, north and east [m], shape (world, vehicle, 2); ``depth`` their distances
    from the informed vehicle's [m], shape (world, vehicle); ``rho`` the funnel's half width [m], shape (world,).
    """
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            f_x, f_y, clamped = _force(w, i, see, g, limits, slots[w], depth[w], rho[w])
            clamps[w] += clamped
            write_action(f_x, f_y, limits, action[w, i])


@compiled
def _index(identity: float, num: int) -> int:
    """Index of the vehicle with this identity, -1 if no vehicle has it."""
    return int(identity) - 1 if 1.0 <= identity < num + 1.0 else -1


@compiled
def _force(
    w: int, i: int, see: Fields, g: SdcGains, limits: Limits, slots: Float64, depth: Float64, rho: float
) -> tuple[float, float, int]:
    """Body-frame force on one vehicle [N], forward and to starboard, and 1 if the funnel's bound is active.

    ``slots`` (vehicle, 2) and ``depth`` (vehicle,) are those of the world, ``rho`` the half width of the funnel [m].
    The vehicle at depth 0 is informed and uses the reference.
    """
    own = max(_index(float(see.identity[w, i, 0]) * depth.shape[0] + 1.0, depth.shape[0]), 0)
    informed = depth[own] == 0.0
    u, v = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
    c, s = float(see.compass[w, i, 0]), float(see.compass[w, i, 1])
    # A vehicle without detected predecessors, such as the informed one, coordinates with all its neighbours.
    follows = False
    for k in range(see.detected.shape[2]):
        j = _index(see.link_identity[w, i, k], depth.shape[0])
        follows = follows or (see.detected[w, i, k] > 0.0 and j >= 0 and depth[j] < depth[own])
    z_x, z_y, w_x, w_y, near_x, near_y, num = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for k in range(see.detected.shape[2]):
        if see.detected[w, i, k] == 0.0:
            continue
        p_x, p_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        distance = max(math.hypot(p_x, p_y), 0.1)
        away = g.short * bump(distance / g.short_range) / distance
        near_x, near_y = near_x - away * p_x, near_y - away * p_y
        j = _index(see.link_identity[w, i, k], depth.shape[0])
        if j >= 0 and (depth[j] < depth[own] or not follows):
            d_x, d_y = slots[j, 0] - slots[own, 0], slots[j, 1] - slots[own, 1]
            z_x, z_y = z_x + c * d_x + s * d_y - p_x, z_y + c * d_y - s * d_x - p_y
            w_x, w_y = w_x + see.link_velocity[w, i, k, 0] - u, w_y + see.link_velocity[w, i, k, 1] - v
            num += 1
    weight = 0.0
    if num > 0:
        z_x, z_y, w_x, w_y, weight = z_x / num, z_y / num, w_x / num, w_y / num, 1.0
    if informed:
        e_x = -c * slots[own, 0] - s * slots[own, 1] - see.reference[w, i, 0]
        e_y = -c * slots[own, 1] + s * slots[own, 0] - see.reference[w, i, 1]
        z_x, z_y, weight = z_x + g.reference * e_x, z_y + g.reference * e_y, weight + g.reference
    f_x, f_y, clamped = g.drag * (surge_resistance(abs(u), limits) * u), 0.0, 0
    if weight > 0.0:
        size = math.hypot(z_x, z_y) / weight
        xi = size / rho
        if xi > _MAX_XI:
            xi, clamped = _MAX_XI, 1
        # 0.5 ln((1 + xi) / (1 - xi)) against the error's direction.
        strength = g.consensus * math.atanh(xi) / max(size * weight, 1e-9)
        f_x, f_y = f_x - strength * z_x, f_y - strength * z_y
    f_x += g.velocity * w_x + near_x
    f_y += g.velocity * w_y + near_y
    if informed:
        f_x += g.reference_velocity * (see.reference_velocity[w, i, 0] - u)
        f_y += g.reference_velocity * (see.reference_velocity[w, i, 1] - v)
    o_x, o_y = pass_obstacle(w, i, see, g.repulsion, g.repulsion_range, g.tangential, g.tangential_range)
    return f_x + o_x, f_y + o_y, clamped
