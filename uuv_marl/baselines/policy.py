"""What a policy is: percepts in, actions out, memory behind ``reset``; and the channels that it needs beyond them."""

import abc
import json
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.errors import PolicyError
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike, world_seeds
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.vehicle import project

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


class Limits(NamedTuple):
    """What a vehicle knows of itself: actuators' limits and surge resistance. SI units."""

    max_force: float
    max_torque: float
    lever_arm: float
    X_u: float
    X_uu: float

    @staticmethod
    def of(scenario: Scenario) -> "Limits":
        """Those of a scenario's vehicle."""
        actuators, vehicle = scenario.actuators, scenario.vehicle
        return Limits(
            actuators.max_force_n, actuators.max_torque_nm, actuators.lever_arm_m, vehicle.X_u, vehicle.X_uu
        )  # fmt: skip


class Policy(abc.ABC):
    """Maps the percepts of any number of worlds to actions.

    Args:
        scenario: gives the vehicle's limits, the decision period and the percept's layout.
        num_worlds: first axis of the percepts.

    Raises:
        PolicyError: the scenario does not grant the channels or the inner loop that the policy declares.
    """

    channels: ClassVar[tuple[str, ...]] = ()
    """Channels needed beyond the percept: ``compass``, ``link``."""
    yaw_damping_nms: ClassVar[float] = 0.0
    """Inner loop that the policy was designed with [N m s]."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        self.name: str = getattr(self, "name", type(self).__name__)
        """By which messages call it."""
        missing = [channel for channel in self.channels if channel not in scenario.sonar.channels]
        needs: list[str] = []
        if missing:
            needs.append(f"the channel{'s' if len(missing) > 1 else ''} {' and '.join(missing)} (sonar.channels)")
        if scenario.actuators.yaw_damping_nms != self.yaw_damping_nms:
            needs.append(f"a yaw damping of {self.yaw_damping_nms:g} N m s (actuators.yaw_damping_nms)")
        if needs:
            raise PolicyError(
                f"{self.name} needs {' and '.join(needs)}, which scenario {scenario.name!r} does not have; "
                "use uuv_marl.baselines.granted(policy, scenario), or override these fields"
            )
        if num_worlds < 1:
            raise PolicyError(f"num_worlds must be at least 1, got {num_worlds}")
        self.scenario = scenario
        self.num_worlds = num_worlds
        self.layout = PerceptLayout.of(scenario)
        self.limits = Limits.of(scenario)
        self.clamps: Int64 = np.zeros(num_worlds, np.int64)
        """How often a numerical clamp bound since the reset, shape (world,)."""
        self.active: Bool = np.ones(num_worlds, np.bool_)
        """Worlds whose actions count, shape (world,), all unless a caller says otherwise; ``act`` may leave the others'
        zero, to save time."""

    def reset(self, seed: SeedLike = 0, worlds: Sequence[int] | None = None) -> None:
        """Forget the past of these worlds (default all); world w draws from ``seed + w``, or one seed for each."""
        chosen = list(range(self.num_worlds) if worlds is None else worlds)
        seeds = [own or 0 for own in world_seeds(seed, chosen)]
        self.clamps[chosen] = 0
        self.forget(chosen, seeds)

    def forget(self, worlds: Sequence[int], seeds: Sequence[int]) -> None:
        """Hook: clear the memory of these worlds."""

    @abc.abstractmethod
    def act(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2), float32, within the unit disc, from percepts (world, vehicle, ...)."""

    def flat(self, percept: Percept) -> Float32:
        """The percept's rows for compiled code, shape (world, vehicle, entry), float32.

        Raises:
            PolicyError: they are of other worlds, vehicles or fields than the policy was made for. Compiled code has no
                bounds checks, so that they would be read, and memory be written, beyond their ends.
        """
        rows, expected = percept.flat, (self.num_worlds, self.scenario.swarm.num_vehicles, self.layout.size)
        if rows.shape != expected or rows.dtype != np.float32:
            raise PolicyError(
                f"{self.name} was made for float32 percepts of shape {expected} (world, vehicle, entry), and "
                f"got {rows.dtype} of shape {rows.shape}; make one for this swarm: make(name, scenario, num_worlds)"
            )
        if percept.layout != self.layout:
            raise PolicyError(
                f"{self.name} was made for other fields of a percept than it got; make it from the scenario "
                "that the swarm was made from"
            )
        return np.ascontiguousarray(rows)


@compiled
def write_action(f_x: float, f_y: float, limits: Limits, out: Float32) -> None:
    """The action for a desired body-frame force [N]: thrust along x, torque by the lever arm along y. Eq. 22."""
    a_x, a_y = project(f_x / limits.max_force, f_y * limits.lever_arm / limits.max_torque)
    out[0], out[1] = a_x, a_y


def tuned(name: str) -> Mapping[str, float]:
    """The best parameters that tuning found for a policy; all its trials are in the CSV file beside it."""
    text = resources.files("uuv_marl.baselines").joinpath("tuned", f"{name}.json").read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads(text)
    return data["best"]
