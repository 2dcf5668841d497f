"""Self-organised fission and fusion (SFF): a reconstruction, since the paper only names it.

Neighbours' positions are predicted from their history; a clustering term acts on the predictions, a hybrid velocity
term follows the neighbours' mean or, while an obstacle is detected, the neighbour whose motion changed most; a
splitting term passes obstacles on either side; and the vehicle is pulled to l(t).
"""

import math
from typing import Annotated, Any, ClassVar, NamedTuple

from uuv_marl.baselines.avoidance import bump, pass_obstacle
from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.policy import Limits, surge_resistance, write_action
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.tables import described
from uuv_marl.sim.views import fields
from uuv_marl.types import Bool, Float32, Float64

HORIZON_S = 1.0  # time ahead for which neighbours are predicted [s]
_MAX_RATE_MPS = 8.0


class SffGains(NamedTuple):
    """Free parameters, found by tuning."""

    pull: float  # largest pull to l(t) [N]
    pull_length: float  # distance at which the pull is 0.7 of that [m]
    cluster: float  # largest clustering force per neighbour [N]
    cluster_distance: float  # distance at which the clustering force changes its sign [m]
    cluster_width: float  # length of its transition [m]
    cluster_range: float  # distance at which the clustering force ends [m]
    velocity: float  # velocity coordination [N s/m]
    blend: float  # weight of the neighbour whose motion changed most, while an obstacle is detected [1]
    repulsion: float  # largest repulsion from an obstacle [N]
    repulsion_range: float  # distance to the surface at which the repulsion ends [m]
    tangential: float  # largest sideways push [N]
    tangential_range: float  # distance to the surface at which the sideways push ends [m]
    drag: float  # share of the vehicle's drag that is compensated [1]


@described
class SffMemory(NamedTuple):
    """Detected neighbours and their changes since the previous decision, in the body frame."""

    identity: Annotated[Float32, "world vehicle sector", "Identity of the vehicle detected, 0 for none."]
    position: Annotated[Float64, "world vehicle sector 2", "Its position [m]."]
    velocity: Annotated[Float64, "world vehicle sector 2", "Its velocity [m/s]."]
    known: Annotated[Bool, "world vehicle sector", "Whether it was detected at the previous decision."]
    rate: Annotated[Float64, "world vehicle sector 2", "Change of its position since then, per second [m/s]."]
    turn: Annotated[Float64, "world vehicle sector 2", "Change of its velocity since then [m/s]."]


class Sff(Controller):
    """Self-organised fission and fusion, with neighbours' velocities over the link, but not the reference's."""

    requirements = PolicyRequirements(("link",), outputs_force=True)
    Memory: ClassVar[type[Any] | None] = SffMemory
    Gains = SffGains
    tuned_as = "sff"

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Compare the detected neighbours with those of the previous decision."""
        period = self.scenario.timing.decision_period_s
        _remember(self.flat(percept), self.at, period, worlds, self.memory)

    def _write(self, percept: Percept, action: Float32) -> None:
        _decide(self.flat(percept), self.at, self.gains, self.limits, self.memory, action)


@compiled
def clustering(d: float, g: SffGains) -> float:
    """Attraction [N] at distance d [m]; negative repels. Olfati-Saber's phi_alpha with a transition of set width."""
    z = (d - g.cluster_distance) / g.cluster_width
    return g.cluster * bump(d / g.cluster_range) * z / math.sqrt(1.0 + z * z)


@compiled
def _recall(identity: float, known: Float32) -> int:
    """The sub-sector in which a vehicle was detected before, -1 for none; identity 0 stands for no vehicle."""
    if not identity >= 1.0:
        return -1
    for k in range(known.shape[0]):
        if known[k] == identity:
            return k
    return -1


@compiled
def _remember(flat: Float32, at: Starts, period: float, worlds: Bool, memory: SffMemory) -> None:
    """Update the memory; since the previous decision a vehicle's frame has turned by yaw rate times period."""
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1] if worlds[w] else 0):
            identities, positions, moved = memory.identity[w, i], memory.position[w, i], memory.velocity[w, i]
            r = float(see.yaw_rate[w, i, 0])
            c, s = math.cos(r * period), math.sin(r * period)
            for k in range(see.detected.shape[2]):
                old = _recall(see.link_identity[w, i, k], identities)
                memory.known[w, i, k] = old >= 0
                if old >= 0:
                    p_x, p_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
                    v_x, v_y = float(see.link_velocity[w, i, k, 0]), float(see.link_velocity[w, i, k, 1])
                    memory.rate[w, i, k, 0] = (p_x - c * positions[old, 0] - s * positions[old, 1]) / period
                    memory.rate[w, i, k, 1] = (p_y - c * positions[old, 1] + s * positions[old, 0]) / period
                    memory.turn[w, i, k, 0] = v_x - c * moved[old, 0] - s * moved[old, 1]
                    memory.turn[w, i, k, 1] = v_y - c * moved[old, 1] + s * moved[old, 0]
            for k in range(see.detected.shape[2]):
                identities[k] = see.link_identity[w, i, k]
                positions[k, 0], positions[k, 1] = see.neighbour[w, i, k, 0], see.neighbour[w, i, k, 1]
                moved[k, 0], moved[k, 1] = see.link_velocity[w, i, k, 0], see.link_velocity[w, i, k, 1]


@compiled
def _decide(flat: Float32, at: Starts, g: SffGains, limits: Limits, memory: SffMemory, action: Float32) -> None:
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            f_x, f_y = _force(w, i, see, g, limits, memory)
            write_action(f_x, f_y, limits, action[w, i])


@compiled
def _force(w: int, i: int, see: Fields, g: SffGains, limits: Limits, memory: SffMemory) -> tuple[float, float]:
    """Body-frame force on one vehicle [N], forward and to starboard."""
    u, v = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
    l_x, l_y = float(see.reference[w, i, 0]), float(see.reference[w, i, 1])
    pull = g.pull / math.sqrt(g.pull_length * g.pull_length + l_x * l_x + l_y * l_y)
    f_x, f_y = pull * l_x + g.drag * (surge_resistance(abs(u), limits) * u), pull * l_y
    mean_x, mean_y, num = 0.0, 0.0, 0
    change, leader_x, leader_y = -1.0, 0.0, 0.0
    for k in range(see.detected.shape[2]):
        if see.detected[w, i, k] == 0.0:
            continue
        p_x, p_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        v_x, v_y = float(see.link_velocity[w, i, k, 0]), float(see.link_velocity[w, i, k, 1])
        q_x, q_y = p_x, p_y
        if memory.known[w, i, k]:
            rate_x, rate_y = memory.rate[w, i, k, 0], memory.rate[w, i, k, 1]
            slow = HORIZON_S * min(1.0, _MAX_RATE_MPS / max(math.hypot(rate_x, rate_y), 1e-9))
            q_x, q_y = p_x + slow * rate_x, p_y + slow * rate_y
            turned = math.hypot(memory.turn[w, i, k, 0], memory.turn[w, i, k, 1])
            if turned > change:
                change, leader_x, leader_y = turned, v_x, v_y
        distance = max(math.hypot(q_x, q_y), 0.1)
        attraction = clustering(distance, g)
        f_x, f_y = f_x + attraction * q_x / distance, f_y + attraction * q_y / distance
        if see.link_identity[w, i, k] >= 1.0:
            mean_x, mean_y, num = mean_x + v_x, mean_y + v_y, num + 1
    echoes = False
    for a in range(see.echo.shape[2]):
        echoes = echoes or see.echo[w, i, a] > 0.0
    if num > 0:
        share = g.blend if echoes and change >= 0.0 else 0.0
        f_x += g.velocity * ((1.0 - share) * mean_x / num + share * leader_x - u)
        f_y += g.velocity * ((1.0 - share) * mean_y / num + share * leader_y - v)
    o_x, o_y = pass_obstacle(w, i, see, g.repulsion, g.repulsion_range, g.tangential, g.tangential_range)
    return f_x + o_x, f_y + o_y
