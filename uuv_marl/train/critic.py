"""Privileged input of the critic: the true state of the whole world, which no vehicle observes."""

import numpy as np

from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32, Float64

PRIVILEGED_SIZE = 21
"""Entries of the privileged input of one vehicle."""


def privileged(swarm: Swarm) -> Float32:
    """Input of the critic beyond an observation, shape (world, vehicle, ``PRIVILEGED_SIZE``), in the body frame.

    Means and extremes over a world's vehicles, for any number of them: position and motion of the centre, spread of
    the swarm, its smallest distances, the vehicle's own distances, its path to the goal, whether it has had its reward
    for arriving (without this a policy learns to leave the goal, as if the reward were still to come), and how long
    l(t) still moves. The time limit is left out: actors do not observe it, and truncated episodes are bootstrapped.
    """
    state, facts = swarm.state, swarm.facts
    c, s = np.moveaxis(swarm.heading, -1, 0)
    u, v = np.moveaxis(swarm.velocity, -1, 0)
    velocity = np.stack([c * u - s * v, s * u + c * v], axis=-1)
    drift = velocity.mean(axis=1) - swarm.mean_reference[:, 2:]
    error = facts.centre - swarm.mean_reference[:, :2]
    size = np.hypot(*error.T)[:, None]
    path_length, away = swarm.task.path_length_m(), facts.away
    arrived_before = swarm.task.arrived_before().astype(np.float64)
    moves = np.abs(swarm.mean_reference[:, 2:]).max(axis=1) > 0.0
    left = np.where(moves, swarm.duration_s - facts.time_s, 0.0)
    columns = [
        *_turned(np.clip(facts.centre[:, None] - state.eta[:, :, :2], -256.0, 256.0) / 64.0, c, s),
        *_turned((error * np.minimum(1.0, 64.0 / np.maximum(size, 1e-6)) / 16.0)[:, None], c, s),
        *_turned((error / (size + 2.0))[:, None], c, s),
        *_turned((drift / 4.0)[:, None], c, s),
        np.minimum(away.mean(axis=1, keepdims=True), 256.0) / 64.0,
        np.minimum(away.max(axis=1, keepdims=True), 512.0) / 128.0,
        np.minimum(path_length, 512.0) / 128.0,
        np.minimum(path_length.mean(axis=1, keepdims=True), 512.0) / 128.0,
        arrived_before,
        arrived_before.mean(axis=1, keepdims=True),
        8.0 / (facts.spacing + 4.0),
        20.0 / (np.maximum(facts.clearance, -5.0) + 10.0),
        8.0 / (facts.min_spacing[:, None] + 4.0),
        20.0 / (np.maximum(facts.clearance.min(axis=1, keepdims=True), -5.0) + 10.0),
        np.clip(left, 0.0, 200.0)[:, None] / 100.0,
        moves[:, None].astype(np.float64),
        (state.dwell[:, :1] > 0) * (0.5 + 0.1 * state.dwell[:, :1] * swarm.scenario.timing.control_step_s),
    ]
    out = np.empty((*state.alive.shape, PRIVILEGED_SIZE), np.float32)
    for k, column in enumerate(columns):
        out[:, :, k] = column
    return out


def _turned(vector: Float64, c: Float64, s: Float64) -> tuple[Float64, Float64]:
    """A north-east vector (world, vehicle or 1, 2) in the body frame, for cosine ``c`` and sine ``s`` of headings."""
    x, y = vector[..., 0], vector[..., 1]
    return c * x + s * y, c * y - s * x
