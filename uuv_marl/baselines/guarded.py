"""``guarded:NAME``: the safety filter around any policy.

The policy decides. Where the velocity that its action leads to would come too near to something that the vehicle
remembers, the safe velocity is taken instead that is nearest to what the action asks for: the velocity at which the
resistance equals its force. Where nothing is near, actions stay as they are, bit for bit.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.filtered import Filtered
from uuv_marl.baselines.halfplanes import nearest_velocity
from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.memory.pose import Reckoning, reckoned, to_body_axes, to_map_axes
from uuv_marl.baselines.policy import Limits, Policy
from uuv_marl.baselines.safety import GUARD, Barrier, keeps, planes_of
from uuv_marl.baselines.steering import full_speed, steer, wished_velocity
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


class Guarded(Filtered):
    """A policy inside the safety filter.

    Args:
        scenario: gives the vehicle, the decision period and the percept's layout.
        num_worlds: first axis of the percepts.
        inner: the policy that decides, made for the same scenario and worlds.
        barrier: margins and rates of the filter.
    """

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, inner: Policy, barrier: Barrier = GUARD) -> None:
        self.inner = inner
        self.name = f"guarded:{inner.name}"
        self.channels, self.yaw_damping_nms = inner.channels, inner.yaw_damping_nms  # pyright: ignore[reportAttributeAccessIssue] - an instance's own
        super().__init__(scenario, num_worlds, barrier)

    def forget(self, worlds: Sequence[int], seeds: Sequence[int]) -> None:
        """Count anew in these worlds, and reset the policy inside."""
        super().forget(worlds, seeds)
        self.inner.reset(list(seeds), worlds)

    def decide(self, percept: Percept) -> Float32:
        """The policy's actions of shape (world, vehicle, 2), changed where they are not safe."""
        self.inner.active = self.active
        action = self.inner.act(percept)
        _guard(
            self.active, self._model.own, self.barrier, self.limits, self._gain, self.memory, self._planes,
            self.changed, self.infeasible, action,
        )  # fmt: skip
        self.clamps[...] = self.inner.clamps
        return action

    def acted(self, action: Float32, worlds: Bool) -> None:
        """Keep the action that is taken; the policy inside is told too."""
        super().acted(action, worlds)
        self.inner.acted(action, worlds)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that later decisions depend on, of the policy inside too."""
        return super().snapshot() | {f"inner.{name}": array for name, array in self.inner.snapshot().items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot. Raises PolicyError where it is another policy's."""
        super().restore(snapshot)
        inner = {name: array for name, array in snapshot.items() if name.startswith("inner.")}
        self.inner.restore({name.removeprefix("inner."): array for name, array in inner.items()})


@compiled
def coming_velocity(w: int, i: int, action: Float32, own: Reckoning, kept: Surroundings) -> tuple[float, float]:
    """The velocity in the vehicle's map [m/s] that an action leads to at the next decision, in still water.

    Args:
        w: index of the world.
        i: index of the vehicle.
        action: shares of full thrust and torque, shape (2,).
        own: the vehicle's model of itself.
        kept: what is remembered.
    """
    _, _, psi, u, v, _ = reckoned(kept.motion[w, i], action, own)
    c, s = cos_sin(psi)
    return to_map_axes(c * u - s * v, s * u + c * v, kept.pose[w, i])


@compiled
def _guard(
    worlds: Bool, own: Reckoning, barrier: Barrier, limits: Limits, gain: float, kept: Surroundings, planes: Float64,
    changed: Int64, infeasible: Int64, action: Float32,
) -> None:  # fmt: skip
    """Replace actions that are not safe.

    Args:
        worlds: those that run, shape (world,).
        own: the vehicle's model of itself.
        barrier: margins and rates of the filter.
        limits: of the actuators, and the surge resistance.
        gain: force per velocity error [N s/m].
        kept: what vehicles remember.
        planes: room for half-planes, shape (disc + sector, 3).
        changed: counted per world, shape (world,); added to.
        infeasible: counted per world, shape (world,); added to.
        action: shares of full force, shape (world, vehicle, 2); changed.
    """
    limit = full_speed(limits)
    for w in range(action.shape[0]):
        for i in range(action.shape[1] if worlds[w] else 0):
            num = planes_of(w, i, own.period_s, barrier, kept, planes)
            v_x, v_y = coming_velocity(w, i, action[w, i], own, kept)
            if keeps(v_x, v_y, planes, num):
                continue
            a_x, a_y = wished_velocity(action[w, i, 0], action[w, i, 1], limits)
            w_x, w_y = to_map_axes(a_x, a_y, kept.pose[w, i])
            w_x, w_y, broken = nearest_velocity(w_x, w_y, planes, num, 0, limit)
            changed[w] += 1
            infeasible[w] += broken > 0.0
            w_x, w_y = to_body_axes(w_x, w_y, kept.pose[w, i])
            steer(w_x, w_y, kept.motion[w, i, 0], kept.motion[w, i, 1], gain, limits, action[w, i])
