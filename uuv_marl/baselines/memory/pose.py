"""Pose of a vehicle in its map: position from the reference point, heading from its velocity, else dead reckoning.

Dead reckoning integrates the vehicle's model under its latest action, and corrects half of the measured difference at
the end.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.memory.actuators import identify
from uuv_marl.baselines.memory.response import follow
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.percept import Fields
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import STILL, Plant, State6, actuators, advance, held, plant
from uuv_marl.types import Float32, Float64

_MOVES_MPS = 0.005  # speed above which l(t) counts as moving; scenarios allow no speed below 0.01 m/s
_PROBE = 0.1
"""Share of full thrust and torque for the model's gains: small, so that the direction hardly changes in a turn."""
FARTHEST_FIX_M = MAX_RANGE_M * (1.0 - 1e-6)  # a longer vector to l(t) is clipped and gives no fix [m]
_TURN_TOLERANCE = 0.001
"""Difference of compass and dead reckoning on a leg, beside the effect of the yaw rate's error [rad]."""


class DeadReckoning(NamedTuple):
    """A vehicle's model of its own motion between two decisions."""

    plant: Plant
    control_steps: int  # control steps in a decision
    steps: int  # integration steps in a control step
    step_s: float  # integration step [s]
    period_s: float  # decision period [s]
    surge: float  # velocity from rest after a period, over the share of full thrust [m/s]
    yaw: float  # yaw rate after a period, over the share of full torque, or of a rudder at l(t)'s speed [rad/s]

    @staticmethod
    def of(scenario: Scenario) -> "DeadReckoning":
        """Model of a scenario's vehicle, undisturbed."""
        timing, still, going = scenario.timing, np.zeros(3), np.zeros(3)
        if scenario.actuators.kind == "rudder":  # has no effect at rest
            going[0] = scenario.trajectory.speed_mps
        own = DeadReckoning(
            plant(scenario), timing.control_steps_per_decision, timing.integration_steps_per_control_step,
            timing.integration_step_s, timing.decision_period_s, 1.0, 1.0,
        )  # fmt: skip
        surge = reckoned(still, np.array([_PROBE, 0.0]), own)[3] / _PROBE
        return own._replace(surge=surge, yaw=reckoned(going, np.array([0.0, _PROBE]), own)[5] / _PROBE)


@compiled
def reckoned(motion: Float64, action: Float64 | Float32, own: DeadReckoning) -> State6:
    """State after one decision [m, rad, m/s, rad/s], from the origin, heading ahead, in still water.

    ``motion``, shape (3,): surge and sway velocity [m/s] and yaw rate [rad/s] at the decision.
    """
    state = (0.0, 0.0, 0.0, motion[0], motion[1], motion[2])
    for _ in range(own.control_steps):
        a_x, a_y = held(action[0], action[1], state[2], own.plant)
        tau = actuators(a_x, a_y, state[5], own.plant)
        for _ in range(own.steps):
            state = advance(state, tau, STILL, own.step_s, own.plant)
    return state


@compiled
def to_map_axes(x: float, y: float, pose: Float64) -> tuple[float, float]:
    """Rotate a vector from the body frame to the map's axes; ``pose`` as in ``Surroundings``, shape (4,)."""
    return pose[2] * x - pose[3] * y, pose[3] * x + pose[2] * y


@compiled
def to_body_axes(x: float, y: float, pose: Float64) -> tuple[float, float]:
    """Rotate a vector from the map's axes to the body frame; ``pose`` as in ``Surroundings``, shape (4,)."""
    return pose[2] * x + pose[3] * y, pose[2] * y - pose[3] * x


@compiled
def to_map(x: float, y: float, pose: Float64) -> tuple[float, float]:
    """Transform a point from the body frame [m] to the map [m]; ``pose`` as in ``Surroundings``, shape (4,)."""
    x, y = to_map_axes(x, y, pose)
    return pose[0] + x, pose[1] + y


@compiled
def begin_map(w: int, i: int, see: Fields, memory: Surroundings) -> None:
    """First percept: the map's origin is at l(t), its first axis along l(t)'s velocity, or along the bow."""
    v_x, v_y = float(see.reference_velocity[w, i, 0]), float(see.reference_velocity[w, i, 1])
    speed = math.hypot(v_x, v_y)
    c, s, moving = 1.0, 0.0, 0.0
    if speed > _MOVES_MPS:
        c, s, moving = v_x / speed, -v_y / speed, 1.0
    r_x, r_y = float(see.reference[w, i, 0]), float(see.reference[w, i, 1])
    memory.pose[w, i, 0], memory.pose[w, i, 1] = -(c * r_x - s * r_y), -(s * r_x + c * r_y)
    memory.pose[w, i, 2], memory.pose[w, i, 3] = c, s
    memory.reference[w, i, 0] = memory.reference[w, i, 1] = memory.reference[w, i, 3] = 0.0
    memory.reference[w, i, 2] = moving
    memory.begun[w, i] = 1.0


@compiled
def move(w: int, i: int, see: Fields, own: DeadReckoning, memory: Surroundings) -> None:
    """Later percept: pose from l(t) while it stays on its leg or at rest, else from dead reckoning.

    Where l(t) is not perceived, its position and velocity read zero, and the pose is always from dead reckoning.
    """
    pose, at, motion = memory.pose[w, i], memory.reference[w, i], memory.motion[w, i]
    v_x, v_y = float(see.reference_velocity[w, i, 0]), float(see.reference_velocity[w, i, 1])
    speed, half = math.hypot(v_x, v_y), 0.5 * own.period_s
    x, y, psi, u, v, r = reckoned(motion, memory.action[w, i], own)
    wrong = see.yaw_rate[w, i, 0] - r
    surge_off, yaw_off = (see.velocity[w, i, 0] - u) / own.surge, wrong / own.yaw
    follow(w, i, 0, memory.action[w, i, 0], surge_off, own.period_s, memory)
    follow(w, i, 1, memory.action[w, i, 1], yaw_off, own.period_s, memory)
    torque = memory.action[w, i, 1] - own.plant.yaw_damping / own.plant.max_torque * motion[2]
    identify(w, i, 0, memory.action[w, i, 0], surge_off, own.period_s, memory)
    identify(w, i, 1, min(max(torque, -1.0), 1.0), yaw_off, own.period_s, memory)
    turn_c, turn_s = cos_sin(psi + half * wrong)
    c, s = to_map_axes(turn_c, turn_s, pose)
    moves, moved = speed > _MOVES_MPS, math.hypot(at[2], at[3]) > 0.0
    r_x, r_y = float(see.reference[w, i, 0]), float(see.reference[w, i, 1])
    perceived = moves or r_x != 0.0 or r_y != 0.0
    steady = perceived and moves == moved and math.hypot(r_x, r_y) < FARTHEST_FIX_M
    if moves:
        b_x, b_y = v_x / speed, v_y / speed
        leg_c, leg_s = b_x * at[2] + b_y * at[3], b_x * at[3] - b_y * at[2]
        tolerance = _TURN_TOLERANCE + half * abs(wrong)
        if steady and abs(leg_s * c - leg_c * s) <= tolerance and leg_c * c + leg_s * s > 0.0:
            c, s = leg_c, leg_s
        else:
            steady = False
            at[2], at[3] = c * b_x - s * b_y, s * b_x + c * b_y
    else:
        at[2] = at[3] = 0.0
    if steady:
        at[0], at[1] = at[0] + own.period_s * speed * at[2], at[1] + own.period_s * speed * at[3]
        pose[0], pose[1] = at[0] - (c * r_x - s * r_y), at[1] - (s * r_x + c * r_y)
    else:
        x, y = to_map_axes(x, y, pose)
        u, v = see.velocity[w, i, 0] - u, see.velocity[w, i, 1] - v
        pose[0] += x + half * (c * u - s * v)
        pose[1] += y + half * (s * u + c * v)
        at[0], at[1] = pose[0] + c * r_x - s * r_y, pose[1] + s * r_x + c * r_y
    norm = math.hypot(c, s)
    pose[2], pose[3] = c / norm, s / norm


@compiled
def store_motion(w: int, i: int, see: Fields, memory: Surroundings) -> None:
    """Store own velocity and l(t)'s speed for the next percept."""
    memory.motion[w, i, 0], memory.motion[w, i, 1] = see.velocity[w, i, 0], see.velocity[w, i, 1]
    memory.motion[w, i, 2] = see.yaw_rate[w, i, 0]
    v_x, v_y = float(see.reference_velocity[w, i, 0]), float(see.reference_velocity[w, i, 1])
    memory.reference_speed[w, i] = math.hypot(v_x, v_y)
