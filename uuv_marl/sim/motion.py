"""Motion of all vehicles of a world: their states as columns, so that loops over them are vectorised."""

import numpy as np

from uuv_marl.sim.arrays import State
from uuv_marl.sim.compiled import compiled, compiled_inline, compiled_inner
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.sim.vehicle import STILL, Plant, actuators, advance, effort, held, limited, wrap
from uuv_marl.sim.workspace import Columns
from uuv_marl.types import Float32


@compiled_inner
def load_state(w: int, state: State, now: Columns) -> None:
    """Load the columns of world w from its state."""
    for i in range(state.eta.shape[1]):
        load_one(w, i, state, now)
        now.psi_0[i] = state.eta[w, i, 2]


@compiled_inline
def load_one(w: int, i: int, state: State, now: Columns) -> None:
    """Load the columns of one vehicle, which discards its latest motion."""
    eta, nu = state.eta, state.nu
    now.x[i], now.y[i], now.psi[i] = eta[w, i, 0], eta[w, i, 1], eta[w, i, 2]
    now.u[i], now.v[i], now.r[i] = nu[w, i, 0], nu[w, i, 1], nu[w, i, 2]
    now.cos[i], now.sin[i] = cos_sin(now.psi[i])


@compiled
def load_action(w: int, action: Float32, now: Columns, plant: Plant) -> None:
    """Load the forces of the actions of world w, shape (world, vehicle, entry), projected onto the actuators' range."""
    for i in range(action.shape[1]):
        now.a_x[i], now.a_y[i] = limited(np.float64(action[w, i, 0]), np.float64(action[w, i, 1]), plant)


@compiled
def apply_actuators(first: bool, now: Columns, plant: Plant) -> None:
    """Set the forces of one control step; after the first they keep their direction in the world. Eq. 22."""
    for i in range(now.x.shape[0]):
        a_x, a_y = now.a_x[i], now.a_y[i]
        if not first:
            a_x, a_y = held(a_x, a_y, now.psi[i] - now.psi_0[i], plant)
        now.tau_u[i], now.tau_r[i] = actuators(a_x, a_y, now.r[i], plant)
        now.effort[i] = effort(a_x, a_y, plant)


@compiled
def integrate(steps: int, step_s: float, now: Columns, plant: Plant) -> None:
    """Integrate one control step under constant thrust and torque. Eq. 1-4, 23-24. Poses and velocities are written."""
    for _ in range(steps):
        for i in range(now.x.shape[0]):
            state = now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i]
            tau = now.tau_u[i], now.tau_r[i]
            now.x[i], now.y[i], now.psi[i], now.u[i], now.v[i], now.r[i] = advance(state, tau, STILL, step_s, plant)
    for i in range(now.x.shape[0]):
        now.psi[i] = wrap(now.psi[i])
        now.cos[i], now.sin[i] = cos_sin(now.psi[i])
