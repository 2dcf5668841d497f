"""What the critic sees beyond the actor's observation: the truth about the whole world, which no vehicle knows."""

import numpy as np

from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32, Float64

PRIVILEGED_SIZE = 21
"""Entries of it."""


def privileged(swarm: Swarm) -> Float32:
    """What the critic sees beyond an observation, shape (world, vehicle, ``PRIVILEGED_SIZE``), body frame.

    Means and extremes over the world's vehicles, however many: where the centre is and how it moves, how far the swarm
    spreads, its smallest distances, the vehicle's own in all directions, its way to go, whether it has been paid for
    its arrival (else leaving the goal looks as if that were still to come, and a policy learns to leave), and for how
    long l(t) still moves. Not how long until the limit: who does not see it acts as if there were none, and no sample
    from beyond holds such a value.
    """
    state, facts = swarm.state, swarm.facts
    c, s = np.moveaxis(swarm.heading, -1, 0)
    u, v = np.moveaxis(swarm.velocity, -1, 0)
    velocity = np.stack([c * u - s * v, s * u + c * v], axis=-1)
    drift = velocity.mean(axis=1) - swarm.mean_reference[:, 2:]
    error = facts.centre - swarm.mean_reference[:, :2]
    size = np.hypot(*error.T)[:, None]
    path_length, away, arrived_before = (
        swarm.task.path_length_m(),
        facts.away,
        swarm.task.arrived_before().astype(np.float64),
    )
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
    """A north-east vector (world, vehicle or 1, 2) in the frame of bodies whose headings have cosine c and sine s."""
    x, y = vector[..., 0], vector[..., 1]
    return c * x + s * y, c * y - s * x
