"""Proportional tracking of the reference; ``safety_filter=true`` shows the effect of the safety filter alone."""

from typing import NamedTuple

from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.steering import steer
from uuv_marl.percept import Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32


class ProportionalGains(NamedTuple):
    """Gains of the desired velocity."""

    pull: float = 0.05  # to l(t) [1/s]; as that of ``scout``


class ProportionalTracking(Controller):
    """The velocity of l(t) and a pull to l(t), without regard to neighbours and obstacles."""

    Gains = ProportionalGains

    def _write(self, percept: Percept, action: Float32) -> None:
        _act(self.flat(percept), self.layout.offsets, self.gains, self.limits, self._gain, action)


@compiled
def _act(flat: Float32, at: Starts, g: ProportionalGains, limits: Limits, gain: float, action: Float32) -> None:
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            w_x = see.reference_velocity[w, i, 0] + g.pull * see.reference[w, i, 0]
            w_y = see.reference_velocity[w, i, 1] + g.pull * see.reference[w, i, 1]
            steer(w_x, w_y, see.velocity[w, i, 0], see.velocity[w, i, 1], gain, limits, action[w, i])
