"""A world's vehicles moved together: their states as columns, over which loops pass on vector registers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import Plant, actuators, advance, project, turned, wrap

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


class Columns(NamedTuple):
    """Scratch, shape (vehicle,) each; the symbols are those of ``uuv_marl.sim.vehicle``."""

    x: Float64
    y: Float64
    psi: Float64
    u: Float64
    v: Float64
    r: Float64
    cos: Float64
    sin: Float64
    tau_u: Float64
    tau_r: Float64
    a_x: Float64
    a_y: Float64
    """The decided action, on the unit disc."""
    psi_0: Float64
    """Heading at which it was decided."""
    effort: Float64
    """Squared length of the action as pushed."""


@compiled
def load(w: int, eta: Float64, nu: Float64, now: Columns) -> None:
    """The columns of world w from its states eta and nu, shape (world, vehicle, 3)."""
    for i in range(eta.shape[1]):
        now.x[i], now.y[i], now.psi[i] = eta[w, i, 0], eta[w, i, 1], eta[w, i, 2]
        now.u[i], now.v[i], now.r[i] = nu[w, i, 0], nu[w, i, 1], nu[w, i, 2]
        now.psi_0[i] = eta[w, i, 2]
    for i in range(eta.shape[1]):
        now.cos[i], now.sin[i] = cos_sin(now.psi[i])


@compiled
def load_one(w: int, i: int, eta: Float64, nu: Float64, now: Columns) -> None:
    """The same for vehicle i alone, whose latest motion is thrown away."""
    now.x[i], now.y[i], now.psi[i] = eta[w, i, 0], eta[w, i, 1], eta[w, i, 2]
    now.u[i], now.v[i], now.r[i] = nu[w, i, 0], nu[w, i, 1], nu[w, i, 2]
    now.cos[i], now.sin[i] = cos_sin(now.psi[i])


@compiled
def aim(w: int, action: Float32, now: Columns) -> None:
    """Project the actions of world w, shape (world, vehicle, 2), onto the unit disc."""
    for i in range(action.shape[1]):
        now.a_x[i], now.a_y[i] = project(np.float64(action[w, i, 0]), np.float64(action[w, i, 1]))


@compiled
def push(first: bool, now: Columns, plant: Plant) -> None:
    """Thrust and torque of one control hold. After the first, the force keeps its direction in the world. Eq. 22."""
    for i in range(now.x.shape[0]):
        a_x, a_y = now.a_x[i], now.a_y[i]
        if not first:
            a_x, a_y = turned(a_x, a_y, now.psi[i] - now.psi_0[i], plant)
            a_x, a_y = project(a_x, a_y)
        now.tau_u[i], now.tau_r[i] = actuators(a_x, a_y, now.r[i], plant)
        now.effort[i] = a_x * a_x + a_y * a_y


@compiled
def move(steps: int, step_s: float, now: Columns, plant: Plant) -> None:
    """One control hold. Eq. 1-4, 23-24."""
    for _ in range(steps):
        for i in range(now.x.shape[0]):
            now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i] = advance(
                now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i], now.tau_u[i], now.tau_r[i], step_s, plant
            )
    for i in range(now.x.shape[0]):
        now.psi[i] = wrap(now.psi[i])
        now.cos[i], now.sin[i] = cos_sin(now.psi[i])
