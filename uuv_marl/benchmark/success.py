"""Success of ``follow`` in disturbed water: the share of vehicles that touched nothing and came to the goal.

A task's own success is in ``tasks/task.py``.

The paper's arrival asks a whole swarm to park within metres, which a current or one dead thruster forbids to policies
that are perfectly safe. Here a vehicle is ``safe`` if it touched no obstacle and no living vehicle in the whole
episode, and ``done`` if it is within the arrival's spread of l(t)'s end, ``GRACE_S`` after l(t) came to rest there.
Shares are over healthy vehicles: those that no fault has hit and that were not lost, except by touching something.
"""

import numpy as np

from uuv_marl.sim.model import rules
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.measures import Success
from uuv_marl.types import Bool

GRACE_S = 60.0
"""When vehicles are judged, after l(t)'s end [s]. Assumed: the time beyond l(t)'s that ``base.toml`` allows."""
CENTRE_M = 20.0
"""Of the healthy vehicles' centre from l(t)'s end in a swarm's success. Assumed: a law without integral action stands
off by less in 1 m/s of current."""
TOGETHER = 0.95
"""Share of the healthy that must be done in a swarm's success. Assumed: one straggler of twenty."""


class SuccessRecorder:
    """Watches a batch of worlds, and judges each world when its episode ends."""

    def __init__(self, swarm: Swarm) -> None:
        shape = swarm.num_worlds, swarm.num_vehicles
        self._swarm, self._spread = swarm, rules(swarm.scenario).spread
        self._failed = np.zeros(shape, np.bool_)
        self._judged = np.zeros(swarm.num_worlds, np.bool_)
        self._offset = np.full((*shape, 2), np.inf)

    def update(self, active: Bool) -> None:
        """Look at the swarm after a reset or step of the ``active`` worlds."""
        swarm, facts = self._swarm, self._swarm.facts
        self._failed |= active[:, None] & facts.lost & (facts.vehicle_collisions == 0)
        now = active & ~self._judged & (facts.time_s >= swarm.duration_s + GRACE_S - 1e-9)
        judged = now[:, None] & swarm.state.alive
        self._offset[judged] = (swarm.state.eta[:, :, :2] - swarm.own_reference[:, :, :2])[judged]
        self._judged |= now

    def metrics(self, world: int) -> Success:
        """A world's shares of healthy vehicles: safe and done, safe, done; and whether the swarm succeeded (1 or 0)."""
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
