"""Success of ``follow`` in disturbed water: the share of collision-free vehicles that reach the goal.

Success of other tasks is in ``tasks/task.py``.

The paper's arrival requires all vehicles to rest within metres of the goal, which a current or one failed thruster
prevents even for a safe policy. Here a vehicle is ``safe`` if it has no collision in the whole episode, and ``done`` if
it is within the arrival's spread of l(t)'s end, ``GRACE_S`` after l(t) stops. Shares are over healthy vehicles: those
without a fault that were not lost, except by a collision.
"""

import numpy as np

from uuv_marl.sim.model import rules
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.measures import Success
from uuv_marl.types import Bool

GRACE_S = 60.0
"""Time from l(t)'s end to the evaluation [s]. Assumed: the extra time of ``base.toml``."""
CENTRE_M = 20.0
"""Largest distance of the healthy vehicles' centre from l(t)'s end [m]. Assumed: the offset of a controller without
integral action in a current of 1 m/s is smaller."""
TOGETHER = 0.95
"""Smallest share of healthy vehicles that are done for swarm success. Assumed: all but one of twenty."""


class SuccessRecorder:
    """Records a batch of worlds, and evaluates each world at the end of its episode."""

    def __init__(self, swarm: Swarm) -> None:
        shape = swarm.num_worlds, swarm.num_vehicles
        self._swarm, self._spread = swarm, rules(swarm.scenario).spread
        self._failed = np.zeros(shape, np.bool_)
        self._judged = np.zeros(swarm.num_worlds, np.bool_)
        self._offset = np.full((*shape, 2), np.inf)

    def update(self, active: Bool) -> None:
        """Record the swarm after a reset or step of the ``active`` worlds."""
        swarm, facts = self._swarm, self._swarm.facts
        self._failed |= active[:, None] & facts.lost & (facts.vehicle_collisions == 0)
        now = active & ~self._judged & (facts.time_s >= swarm.duration_s + GRACE_S - 1e-9)
        judged = now[:, None] & swarm.state.alive
        self._offset[judged] = (swarm.state.eta[:, :, :2] - swarm.own_reference[:, :, :2])[judged]
        self._judged |= now

    def metrics(self, world: int) -> Success:
        """Shares of a world's healthy vehicles that are safe and done, safe, and done; and swarm success (1 or 0)."""
        healthy = ~(self._failed | self._swarm.faulty)[world]
        faulty = int((~healthy).sum())
        if not healthy.any() or not (self._judged[world] or not self._swarm.state.alive[world].any()):
            return Success(
                success_share=None, safe_share=None, done_share=None, swarm_success=None, vehicles_faulty=faulty
            )
        safe, offset = ~self._swarm.state.collided[world, healthy], self._offset[world, healthy]
        done = np.hypot(*offset.T) <= self._spread
        centred = bool(np.hypot(*offset.mean(axis=0)) <= CENTRE_M)
        return Success(
            success_share=float((safe & done).mean()),
            safe_share=float(safe.mean()),
            done_share=float(done.mean()),
            swarm_success=int(safe.all() and centred and done.mean() >= TOGETHER),
            vehicles_faulty=faulty,
        )
