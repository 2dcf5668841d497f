"""A policy of your own, with a memory.

In this folder: ``uuv-marl benchmark --scenario starter --policy policy:Smooth``.
"""

from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl import baselines, load_scenario
from uuv_marl.percept import Percept
from uuv_marl.sim.swarm import Swarm

Float32 = NDArray[np.float32]


class Memory(NamedTuple):
    """The memory of each vehicle."""

    desired: Annotated[Float32, "world vehicle 2", "Smoothed direction to the reference point, in the body frame [1]."]


class Smooth(baselines.Policy):
    """The full force in the smoothed direction of the reference point, and away from near neighbours."""

    requirements = baselines.PolicyRequirements(decision_period_s=0.5, yaw_damping_nms=600.0)
    Memory: ClassVar[type[Any] | None] = Memory

    def remember(self, percept: Percept, worlds: NDArray[np.bool_]) -> None:
        """Update the mean direction in the worlds that were stepped, shape (world,)."""
        to_reference = percept["reference"]
        length = np.maximum(np.linalg.norm(to_reference, axis=-1, keepdims=True), 1e-3)
        self.memory.desired[worlds] += 0.2 * ((to_reference / length) - self.memory.desired)[worlds]

    def decide(self, percept: Percept) -> Float32:
        """Force ahead and to starboard, as shares of the full force, shape (world, vehicle, 2)."""
        neighbour, detected = percept["neighbour"], percept["detected"][..., None]
        squared = np.maximum((neighbour**2).sum(axis=-1, keepdims=True), 1.0)
        away = -(detected * neighbour / squared).sum(axis=-2)
        desired = self.memory.desired + 30.0 * away
        length = np.maximum(np.linalg.norm(desired, axis=-1, keepdims=True), 1.0)
        return (desired / length).astype(np.float32)


if __name__ == "__main__":
    scenario = baselines.with_policy_requirements(Smooth, load_scenario("starter"))
    swarm, policy = Swarm(scenario), Smooth(scenario)
    percept, collisions = swarm.reset(seed=0), 0
    while swarm.facts.time_s[0] < 30.0:
        percept = swarm.step(policy.act(percept))
        collisions += swarm.facts.collisions[0]
    away = np.hypot(*(swarm.facts.centre - swarm.facts.reference[:, 0, :2])[0])
    print(f"after 30 s the swarm is {away:.0f} m from the reference point, with {collisions} collisions")
