"""Proportional tracking of the reference; ``safety_filter=true`` shows the effect of the safety filter alone."""

from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.policy import Limits, Policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.steering import steer, velocity_gain
from uuv_marl.percept import Percept, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32


class ProportionalGains(NamedTuple):
    """Gains of the desired velocity."""

    pull: float = 0.05  # to l(t) [1/s]; as that of ``scout``


class ProportionalTracking(Policy):
    """The velocity of l(t) and a pull to l(t), without regard to neighbours and obstacles."""

    requirements = PolicyRequirements(yaw_damping_nms=600.0, outputs_force=True)

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, gains: ProportionalGains | None = None) -> None:
        super().__init__(scenario, num_worlds)
        self.gains = gains or ProportionalGains()
        self._gain = velocity_gain(scenario)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        flat = self.flat(percept)
        action = np.empty((*flat.shape[:2], 2), np.float32)
        _act(flat, self.layout.offsets, self.gains, self.limits, self._gain, action)
        return action


@compiled
def _act(flat: Float32, at: Starts, g: ProportionalGains, limits: Limits, gain: float, action: Float32) -> None:
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            w_x = see.reference_velocity[w, i, 0] + g.pull * see.reference[w, i, 0]
            w_y = see.reference_velocity[w, i, 1] + g.pull * see.reference[w, i, 1]
            steer(w_x, w_y, see.velocity[w, i, 0], see.velocity[w, i, 1], gain, limits, action[w, i])
