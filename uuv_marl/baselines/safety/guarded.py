"""``NAME,safety_filter=true``: the safety filter around any policy.

If the velocity that follows from the policy's action would bring the vehicle too near to a remembered obstacle or
neighbour, the filter replaces it by the safe velocity nearest to the one at which resistance equals the action's force.
Otherwise actions stay as they are, bit for bit.

With a rudder the action is the desired force; its torque is close to the rudder's at cruise speed.
"""

from uuv_marl.baselines.memory.pose import DeadReckoning, reckoned, to_map_axes
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.policy import Policy
from uuv_marl.baselines.safety.barrier import GUARD, Barrier, Steering, keeps, planes_of, steer_safely
from uuv_marl.baselines.safety.filtered import Filtered
from uuv_marl.baselines.steering import steady_velocity
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float32


class Guarded(Filtered):
    """An inner policy, made for the same scenario and worlds, inside the safety filter."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, inner: Policy, barrier: Barrier = GUARD) -> None:
        self.parts = {"inner": inner}
        self.name = inner.name
        self.requirements = inner.requirements
        super().__init__(scenario, num_worlds, barrier=barrier)

    def decide(self, percept: Percept) -> Float32:
        """Actions of the inner policy, shape (world, vehicle, 2), changed where they are not safe."""
        action = self.decide_part("inner", percept)
        guard_all(self.active, self.model, self.safe, self.surroundings, action)
        self.clamps[...] = self.parts["inner"].clamps
        return action


@compiled
def coming_velocity(w: int, i: int, action: Float32, own: DeadReckoning, memory: Surroundings) -> tuple[float, float]:
    """Velocity in the map [m/s] that an action leads to at the next decision, in still water."""
    _, _, psi, u, v, _ = reckoned(memory.motion[w, i], action, own)
    c, s = cos_sin(psi)
    return to_map_axes(c * u - s * v, s * u + c * v, memory.pose[w, i])


@compiled
def guard_all(worlds: Bool, own: DeadReckoning, safe: Steering, memory: Surroundings, action: Float32) -> None:
    """Replace unsafe actions in place."""
    for w in range(action.shape[0]):
        for i in range(action.shape[1]):
            if not worlds[w] or memory.begun[w, i] == 0.0:
                continue
            num = planes_of(w, i, safe, memory)
            v_x, v_y = coming_velocity(w, i, action[w, i], own, memory)
            if not keeps(v_x, v_y, safe.planes, num):
                a_x, a_y = steady_velocity(action[w, i, 0], action[w, i, 1], safe.limits)
                w_x, w_y = to_map_axes(a_x, a_y, memory.pose[w, i])
                steer_safely(w, i, w_x, w_y, num, safe, memory, action)
