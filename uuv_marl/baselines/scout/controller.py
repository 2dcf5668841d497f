"""``Scout``: the strongest hand-made controller, with a memory, early avoidance and the safety filter.

A vehicle's desired velocity is l(t)'s velocity, a pull to l(t), and pushes from near neighbours. It is bent around
remembered obstacles and made safe; the vehicle then steers to it.
"""

import math

from uuv_marl.baselines.memory.actuators import lead
from uuv_marl.baselines.memory.discs import CONFIRMED
from uuv_marl.baselines.memory.neighbours import middle
from uuv_marl.baselines.memory.surroundings import uncertainty
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.policy import Limits, PolicyError
from uuv_marl.baselines.safety.barrier import Barrier, Steering, margin, planes_of, steer_safely
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.scout.gains import DEFAULT_PRESET, PRESETS, ScoutGains
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.sections import growth
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.vehicle import project
from uuv_marl.types import Bool, Float32


class Scout(Filtered):
    """Feed-forward and pull, pushes among near neighbours, a flow around remembered obstacles, and the safety filter.

    ``preset`` is a name of ``PRESETS``, else PolicyError is raised; ``gains`` and ``barrier`` replace the preset's.
    """

    Gains = ScoutGains

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, preset: str = DEFAULT_PRESET, gains: ScoutGains | None = None,
        barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        if preset not in PRESETS:
            raise PolicyError(f"preset of scout must be one of {', '.join(PRESETS)}, got {preset!r}")
        numbers = PRESETS[preset]
        super().__init__(scenario, num_worlds, gains=gains or numbers.gains, barrier=barrier or numbers.barrier)
        self._growth = growth(scenario.swarm.num_vehicles)

    def _write(self, percept: Percept, action: Float32) -> None:  # noqa: ARG002 - it is in the memory
        gains, g = self.float_gains, self._growth
        gains = gains._replace(
            pull=gains.pull / g, pull_at_rest=gains.pull_at_rest * math.sqrt(g), push_at_rest=gains.push_at_rest * g,
            together=gains.together / g**3,
        )  # fmt: skip
        safe = self.safe._replace(gain=self._gain * gains.steering)
        decide_all(self.active, gains, safe, self.surroundings, action)


@compiled
def desired_velocity(w: int, i: int, g: ScoutGains, memory: Surroundings) -> tuple[float, float]:
    """Desired velocity without regard to obstacles, in the vehicle's map [m/s]."""
    pose, reference, speed = memory.pose[w, i], memory.reference[w, i], memory.reference_speed[w, i]
    pull, push, together = g.pull, g.push, g.together
    if speed > 0.0 and (g.pull_if_uncertain != 0.0 or g.push_if_uncertain != 0.0):
        share = uncertainty(w, i, memory)
        pull, push = pull * math.exp(share * g.pull_if_uncertain), push * math.exp(share * g.push_if_uncertain)
    if reference[2] == 0.0 and reference[3] == 0.0:
        pull, push, together = pull * g.pull_at_rest, push * g.push_at_rest, 0.0
    to_x = reference[0] - g.behind_m * reference[2] - pose[0]
    to_y = reference[1] - g.behind_m * reference[3] - pose[1]
    w_x, w_y = speed * reference[2] + pull * to_x, speed * reference[3] + pull * to_y
    if together > 0.0:
        m_x, m_y, _ = middle(w, i, memory)
        w_x, w_y = w_x + together * (to_x - m_x), w_y + together * (to_y - m_y)
    return pushed(w_x, w_y, w, i, push, g.push_range, memory)


@compiled
def pushed(
    w_x: float, w_y: float, w: int, i: int, push: float, push_range: float, memory: Surroundings
) -> tuple[float, float]:
    """A desired velocity [m/s] with pushes away from near neighbours, as ``ScoutGains`` defines them."""
    for k in range(memory.known.shape[2]):
        away = max(memory.away[w, i, k], 1e-6)
        if away < push_range:
            d_x, d_y = memory.pose[w, i, 0] - memory.place[w, i, k, 0], memory.pose[w, i, 1] - memory.place[w, i, k, 1]
            share = push * (1.0 / away - 1.0 / push_range)
            w_x, w_y = w_x + share * d_x, w_y + share * d_y
    return w_x, w_y


@compiled
def modulated(w_x: float, w_y: float, w: int, i: int, barrier: Barrier, memory: Surroundings) -> tuple[float, float]:
    """A desired velocity [m/s] bent around obstacles ahead, as an ideal fluid flows around cylinders.

    The modulation of Khansari-Zadeh and Billard, A dynamical system approach to realtime obstacle avoidance, Autonomous
    Robots 32 (2012), for discs: with (R / r)^2, R the radius and the margin, r the distance of the centre, the velocity
    towards a disc shrinks by that share, and that past it grows. Each disc bends the result of the previous one.
    """
    for d in range(memory.score.shape[2]):
        if memory.score[w, i, d] < CONFIRMED:
            continue
        n_x, n_y = memory.pose[w, i, 0] - memory.disc[w, i, d, 0], memory.pose[w, i, 1] - memory.disc[w, i, d, 1]
        away = max(memory.disc_away[w, i, d], 1e-6)
        n_x, n_y = n_x / away, n_y / away
        outwards, past = n_x * w_x + n_y * w_y, n_x * w_y - n_y * w_x
        if outwards < 0.0:
            near = (memory.disc[w, i, d, 2] + margin(w, i, d, barrier, memory)) / away
            near = min(near * near, 1.0)
            outwards, past = (1.0 - near) * outwards, (1.0 + near) * past
            w_x, w_y = n_x * outwards - n_y * past, n_y * outwards + n_x * past
    return w_x, w_y


@compiled
def _lead(w: int, i: int, share: float, limits: Limits, memory: Surroundings, action: Float32) -> None:
    """Change an action so that it compensates a ``share`` of actuator lag and weakness."""
    damping = limits.yaw_damping * memory.motion[w, i, 2]
    torque = lead(w, i, 1, min(max(action[w, i, 1] - damping, -1.0), 1.0), share, memory) + damping
    thrust = lead(w, i, 0, float(action[w, i, 0]), share, memory)
    a_x, a_y = project(thrust, min(max(torque, -1.0), 1.0))
    action[w, i, 0], action[w, i, 1] = a_x, a_y


@compiled
def decide_all(worlds: Bool, g: ScoutGains, safe: Steering, memory: Surroundings, action: Float32) -> None:
    """Write every vehicle's action."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if worlds[w] and memory.begun[w, i] > 0.0:
                w_x, w_y = desired_velocity(w, i, g, memory)
                w_x, w_y = modulated(w_x, w_y, w, i, safe.barrier, memory)
                num = planes_of(w, i, safe, memory)
                steer_safely(w, i, w_x, w_y, num, safe, memory, action)
                if g.lead > 0.0 and safe.limits.helm == 0.0:
                    _lead(w, i, g.lead, safe.limits, memory, action)
