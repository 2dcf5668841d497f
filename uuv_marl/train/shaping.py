"""What training is paid, and what its critic sees: both from the truth, which the actor never knows.

The reward is dense and steeper than the environment's own (``uuv_marl.envs.reward``), which is made to be sound and to
compare. All numbers here are our own.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.policy import Policy, inner_loop_nms
from uuv_marl.errors import ScenarioError
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.scale import Scale
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32, Float64

_LOOP = "actuators.yaw_damping_nms"
_LOOP_NMS = 600.0
OVERRIDES: Mapping[str, object] = {"timing.decision_period_s": 0.5, _LOOP: _LOOP_NMS}
"""What training changes in a scenario of the paper's vehicle: a fifth of the decisions, and an inner loop, as our tuned
policies have it, so that noise on the torque does not spin a vehicle."""
PRIVILEGED_SIZE = 18
"""Entries that the critic sees beyond the actor's features."""


def overrides_for(scenario: str, own: Mapping[str, object]) -> dict[str, object]:
    """What training changes in a scenario: ``OVERRIDES``, with the inner loop of its vehicle, and fields of one's own.

    Args:
        scenario: name or TOML file.
        own: go before the others; they may name another vehicle.

    Raises:
        ScenarioError: the scenario can't be loaded with them, or is in another scale.
    """
    # Before the decision period, which is no multiple of a hold in another scale, so that the scale is what is named.
    clock = OVERRIDES if "timing.control_hold_s" in own else {}
    bare = in_si_units(load_scenario(scenario, overrides={**clock, **own, _LOOP: own.get(_LOOP, 0.0)}))
    return {**OVERRIDES, _LOOP: inner_loop_nms(_LOOP_NMS, Policy.full_torque_nm, bare), **own}


def in_si_units(scenario: Scenario) -> Scenario:
    """The scenario. Raises ScenarioError for one in a vehicle's scale, in whose units learners do not read percepts."""
    if scenario.scale == Scale():
        return scenario
    raise ScenarioError(
        f"scale = 'vehicle' puts scenario {scenario.name!r} into the scale of {scenario.vehicle.name}, which training "
        "does not know; leave scale out, and set trajectory.speed_mps and start.speed_max_mps"
    )


class Weights(NamedTuple):
    """Weights of the terms of one decision of 0.5 s; shorter ones are paid in proportion, collisions whole."""

    distance_m: float = 35.0
    """A vehicle pays its distance to l(t) over this [m]; 1e9: nothing."""
    centre: float = 0.4
    """Pay per metre of a vehicle's ``lead``."""
    obstacle: float = 28.0
    obstacle_m: float = 30.0
    """Clearance c below ``obstacle_m`` costs obstacle x (1 - c / obstacle_m)^2."""
    spacing: float = 28.0
    spacing_m: float = 12.0
    """Distance to the nearest vehicle below which it costs so, too: a linear term's mean would hide rare close ones."""
    collision: float = 8.0
    """Cost of each contact that begins."""
    effort: float = 0.02
    """Cost of the squared action."""
    team: float = 0.0
    """All vehicles pay this for each metre from the swarm's centre to l(t), up to 60 m."""
    team_s: float = 1e9
    """The cost ``team`` is the less, the longer l(t) still moves: by exp(-time left / team_s) [s]."""
    astray_m: float = 1e9
    """A vehicle pays 1 where it is twice as far from l(t), nothing up to here, and at most 3 [m]."""
    late: float = 0.0
    """All vehicles pay this while l(t) rests and the swarm has not arrived; less, by up to two thirds, where the
    swarm's centre is within about 4 m of the end."""

    def __call__(self, swarm: Swarm) -> Float64:
        """The reward of the latest decision, shape (world, vehicle)."""
        return shaped_reward(swarm, self)


def shaped_reward(swarm: Swarm, by: Weights) -> Float64:
    """The reward of the latest decision, shape (world, vehicle)."""
    facts, share = swarm.facts, swarm.scenario.timing.decision_period_s / 0.5
    away = np.hypot(*np.moveaxis(swarm.state.eta[:, :, :2] - facts.reference[:, None, :2], -1, 0))
    near = np.clip(1.0 - facts.clearance / by.obstacle_m, 0.0, 1.5)
    close = np.clip(1.0 - facts.spacing / by.spacing_m, 0.0, 1.0)
    rate = (
        -np.minimum(away, 300.0) / by.distance_m
        + (by.centre * np.clip(lead(swarm), -100.0, 100.0) if by.centre else 0.0)
        - by.obstacle * near * near
        - by.spacing * close * close
        - by.effort * facts.effort
        - np.clip(away / by.astray_m - 1.0, 0.0, 3.0)
    )
    if by.team or by.late:
        rate = rate - _shared(swarm, by)[:, None]
    return share * rate - by.collision * facts.contacts


def _shared(swarm: Swarm, by: Weights) -> Float64:
    """What all vehicles of a world pay for where their centre is, shape (world,)."""
    facts = swarm.facts
    error = np.hypot(*(facts.centre - facts.reference[:, :2]).T)
    left = np.maximum(swarm.duration_s - facts.time_s, 0.0)
    far, astray = np.minimum(error, 60.0), 1.0 - 2.0 / 3.0 * np.exp(-error / 4.0)
    return by.team * np.exp(-left / by.team_s) * far + by.late * (left == 0.0) * astray


def lead(swarm: Swarm) -> Float64:
    """How far a vehicle is ahead of the swarm's centre, on the way that the centre has to go [m], (world, vehicle).

    To first order a difference reward (Wolpert and Tumer 2002): n times what the vehicle does for the centre. From a
    shared centre error each would get 1/n of that, which its own noise hides. The whole difference also pays for being
    far from the centre, whatever the direction, and so spreads the swarm; this one sums to zero. Fades within 2 m.
    """
    error = swarm.facts.centre - swarm.facts.reference[:, :2]
    way = -error / np.sqrt(np.sum(error * error, axis=-1, keepdims=True) + 4.0)
    return np.sum((swarm.state.eta[:, :, :2] - swarm.facts.centre[:, None]) * way[:, None], axis=-1)


def privileged_observation(swarm: Swarm, out: Float32) -> None:
    """Fill what the critic sees beyond the actor's features, shape (world, vehicle, ``PRIVILEGED_SIZE``), body frame.

    Means and extremes over the world's vehicles, however many: where the centre is and how it moves, how far the
    swarm spreads, its smallest distances, the vehicle's own in all directions, and how much time is left.
    """
    state, facts = swarm.state, swarm.facts
    c, s = np.moveaxis(swarm.heading, -1, 0)
    to_reference = facts.reference[:, None, :2] - state.eta[:, :, :2]
    away = np.hypot(*np.moveaxis(to_reference, -1, 0))
    u, v = np.moveaxis(swarm.velocity, -1, 0)
    velocity = np.stack([c * u - s * v, s * u + c * v], axis=-1)
    drift = velocity.mean(axis=1) - facts.reference[:, 2:]
    error = facts.centre - facts.reference[:, :2]
    size = np.hypot(*error.T)[:, None]
    left = swarm.duration_s - facts.time_s
    columns = [
        *_turned(np.clip(facts.centre[:, None] - state.eta[:, :, :2], -256.0, 256.0) / 64.0, c, s),
        *_turned((error * np.minimum(1.0, 64.0 / np.maximum(size, 1e-6)) / 16.0)[:, None], c, s),
        *_turned((error / (size + 2.0))[:, None], c, s),
        *_turned((drift / 4.0)[:, None], c, s),
        np.minimum(away.mean(axis=1, keepdims=True), 256.0) / 64.0,
        np.minimum(away.max(axis=1, keepdims=True), 512.0) / 128.0,
        np.minimum(away, 256.0) / 64.0,
        8.0 / (facts.spacing + 4.0),
        20.0 / (np.maximum(facts.clearance, -5.0) + 10.0),
        8.0 / (facts.min_spacing[:, None] + 4.0),
        20.0 / (np.maximum(facts.clearance.min(axis=1, keepdims=True), -5.0) + 10.0),
        np.clip(left, -50.0, 200.0)[:, None] / 100.0,
        (left <= 0.0)[:, None].astype(np.float64),
        (state.dwell[:, :1] > 0) * (0.5 + 0.1 * state.dwell[:, :1] * swarm.scenario.timing.control_hold_s),
    ]
    for k, column in enumerate(columns):
        out[:, :, k] = column


def _turned(vector: Float64, c: Float64, s: Float64) -> tuple[Float64, Float64]:
    """A north-east vector (world, vehicle or 1, 2) in the frame of bodies whose headings have cosine c and sine s."""
    x, y = vector[..., 0], vector[..., 1]
    return c * x + s * y, c * y - s * x
