"""What goes wrong: vehicles that fall silent. Everything is off in the paper's scenarios."""

import numpy as np

from uuv_marl.scenario import Scenario
from uuv_marl.types import Int64


def draw_losses(scenario: Scenario, rng: np.random.Generator) -> Int64:
    """Index of the vehicle lost at each of ``disturbance.loss_times_s``, all different, shape (loss,)."""
    return rng.permutation(scenario.swarm.num_vehicles)[: len(scenario.disturbance.loss_times_s)].astype(np.int64)


def loss_ticks(scenario: Scenario) -> Int64:
    """The control hold at whose end each loss happens, shape (loss,)."""
    times = np.array(scenario.disturbance.loss_times_s, np.float64)
    return np.maximum(np.ceil(times / scenario.timing.control_hold_s - 1e-9), 1).astype(np.int64)
