"""The base class of policies: from percepts to actions, with a memory."""

import json
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any, ClassVar, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.requirements import check_requirements
from uuv_marl.baselines.rudder import Rudder, steer_by_rudder
from uuv_marl.errors import PolicyError
from uuv_marl.percept import Clock, Percept, PerceptLayout
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike, world_seeds
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.tables import allocate
from uuv_marl.sim.vehicle import project
from uuv_marl.types import Bool, Float32, Float64, Int64

FULL_RUDDER = 0.5
"""Sine of the angle between bow and wished velocity that asks for the whole rudder at cruise speed [1]. Assumed: 30
degrees, for which the catalogue's torpedoes need a second or two."""


class Limits(NamedTuple):
    """What a vehicle knows of itself: actuators' limits and surge resistance. SI units."""

    max_force: float
    max_torque: float
    lever_arm: float
    X_u: float
    X_uu: float
    helm: float
    """Sideways force over the sine of the angle to a wished velocity [N] that a rudder makes good; 0 without one."""
    yaw_damping: float
    """The inner loop's torque, as a share of the full one, over the yaw rate [s]."""

    @staticmethod
    def of(scenario: Scenario) -> "Limits":
        """Those of a scenario's vehicle."""
        actuators, vehicle = scenario.actuators, scenario.vehicle
        helm = actuators.max_torque_nm / actuators.lever_arm_m / FULL_RUDDER
        return Limits(
            actuators.max_force_n, actuators.max_torque_nm, actuators.lever_arm_m, vehicle.X_u, vehicle.X_uu,
            helm if actuators.kind == "rudder" else 0.0, actuators.yaw_damping_nms / actuators.max_torque_nm,
        )  # fmt: skip


class Policy:
    """Maps the percepts of any number of worlds to actions.

    - A policy defines ``decide(percept)``, which returns actions. Who runs it calls ``act`` once for every decision.
    - A policy with a memory also declares its arrays in ``Memory`` and defines ``remember(percept, worlds)``, which
      changes them; ``decide`` reads ``self.memory``. They are made, cleared, saved and restored here.
    - ``act`` is ``hear`` (remember, once for each time), ``decide``, ``drive`` (to the actuators), in this order.
    - A filter is a policy with a policy inside: its ``decide`` calls the other's ``hear`` and ``decide`` and changes
      what comes of it. A teacher that is not obeyed is told so (``taken``).

    Args:
        scenario: gives the vehicle's limits, the decision period and the percept's layout.
        num_worlds: first axis of the percepts.

    Raises:
        PolicyError: the scenario does not grant the channels, the inner loop or the clock that the policy declares.
    """

    Memory: ClassVar[type[Any] | None] = None
    """Table of what is remembered (``uuv_marl.sim.tables``): a NamedTuple of arrays over world, vehicle, sector and
    active sub-sector. Zero is nothing: so it starts, and so it is forgotten. An array ``action``, of shape (world,
    vehicle, 2), is filled with the actions that were taken."""
    axes: Mapping[str, int] = {}
    """Lengths of further axes of ``Memory``."""
    channels: ClassVar[tuple[str, ...]] = ()
    """Channels needed beyond the percept, of ``uuv_marl.percept.CHANNELS``. ``modem`` can stand in for ``link``: then
    the link's fields lie where ``at`` says, and ``percept["link_velocity"]`` is not there."""
    yaw_damping_nms: ClassVar[float] = 0.0
    """Inner loop that the policy was designed with [N m s], on a vehicle of ``full_torque_nm``: ``inner_loop_nms``."""
    identity: ClassVar[bool | str] = False
    """Whether it acts by a vehicle's index, which no vehicle perceives; or the parameter that makes it do so."""
    decision_period_s: ClassVar[float | None] = None
    """Period between decisions that the policy needs [s]; None if it is made for any."""
    full_torque_nm: ClassVar[float] = 3000.0
    """Full torque of that vehicle [N m], ``literature_185`` where nothing else is said."""
    outputs_force: ClassVar[bool] = False
    """Whether ``decide`` gives a wished force in the body frame, as shares of full thrust and torque
    (``write_action``). Where the vehicle has a rudder ``drive`` then gives thrust and rudder (``steer_by_rudder``);
    else what ``decide`` gives goes to the actuators as it is."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        self.name: str = getattr(self, "name", type(self).__name__)
        """The policy's name in messages."""
        if type(self).act is not Policy.act or type(self).decide is Policy.decide:
            raise PolicyError(f"policy {self.name!r} must define decide(percept), and leave act, which calls it, alone")
        check_requirements(self.name, self, scenario)
        if num_worlds < 1:
            raise PolicyError(f"num_worlds must be at least 1, got {num_worlds}")
        self.scenario = scenario
        self.num_worlds = num_worlds
        self.layout = PerceptLayout.of(scenario)
        has_link = "link" in scenario.sonar.channels
        self.at = self.layout.offsets if has_link else self.layout.message_offsets
        """Where each field starts in a flat percept; the link's fields are the modem's where only that is granted."""
        self.limits = Limits.of(scenario)
        self.rudder = Rudder.of(scenario) if self.outputs_force else None
        """Turns wished forces into actions; None where the policy gives actions itself."""
        self.clamps: Int64 = np.zeros(num_worlds, np.int64)
        """How often a numerical clamp bound since the reset, shape (world,)."""
        self.active: Bool = np.ones(num_worlds, np.bool_)
        """Worlds whose actions count, shape (world,), all unless a caller says otherwise. Nothing of the others is
        remembered, and ``decide`` may leave their actions zero, to save time."""
        self._time_s: Float64 = np.full(num_worlds, np.nan)
        self._episode = np.zeros(num_worlds, np.uint64)
        sonar = scenario.sonar
        sizes = {
            "world": num_worlds,
            "vehicle": scenario.swarm.num_vehicles,
            "sector": sonar.num_sectors,
            "active": sonar.num_active_sectors,
            **self.axes,
        }
        self.memory: Any = allocate(self.Memory, sizes) if self.Memory else ()
        """What is remembered, the arrays of ``Memory``."""

    def copy_requirements(self, other: Any) -> None:
        """Declare what another does: a policy inside, or the card of a training. To be called before ``__init__``."""
        for name in ("channels", "yaw_damping_nms", "full_torque_nm", "decision_period_s", "outputs_force"):
            setattr(self, name, getattr(other, name))

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> None:
        """Forget the past of these worlds, default all. Not needed where percepts have a clock, as a swarm's have.

        Args:
            seed: of the policy's own random numbers in the next episode, for world w ``seed + w``, or one seed for
                each of ``worlds``; None for that of the episode.
            worlds: indices of the worlds.
        """
        chosen = list(range(self.num_worlds) if worlds is None else worlds)
        world_seeds(seed, chosen)  # refuses what is no seed
        self.clamps[chosen] = 0
        self._forget(chosen)

    def _forget(self, worlds: list[int] | Bool) -> None:
        """Clear what is remembered of these worlds."""
        self._time_s[worlds] = np.nan
        for array in self.memory:
            array[worlds] = 0

    @final
    def act(self, percept: Percept) -> Float32:
        """Remember the percept, then decide. Call this method once for every decision.

        If the percept has a time, the memory of a world that has been reset is cleared by itself, and a second call at
        the same time gives the same actions and changes no memory.

        Args:
            percept: percepts of shape (world, vehicle, ...).

        Returns:
            Actions of shape (world, vehicle, 2), float32, within the unit disc, or with a rudder within the square.

        Raises:
            PolicyError: the percept is of another swarm; or the policy has a memory and a decision was left out.
        """
        self.update_memory(percept)
        return self.drive(percept, self.decide(percept))

    @final
    def update_memory(self, percept: Percept) -> None:
        """Remember what is perceived, where it is new: before ``decide``."""
        if self.Memory is not None:
            self.flat(percept)
            self.remember(percept, self._advance(percept.clock))

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Hook: take what these worlds perceive, shape (world,), into ``memory``."""

    def decide(self, percept: Percept) -> Float32:
        """Actions, or wished forces (``wishes_force``), from the percept and ``memory``, which stay as they are."""
        raise NotImplementedError

    @final
    def drive(self, percept: Percept, output: Float32) -> Float32:
        """The actions for what ``decide`` gave, shape (world, vehicle, 2), which may be overwritten; after it."""
        if self.rudder is not None:
            steer_by_rudder(self.flat(percept), self.layout.offsets, self.rudder, output)
        self.record_action(output)
        return output

    def record_action(self, action: Float32) -> None:
        """Remember the actions taken, if ``Memory`` has a place for them; again if others than ``act`` gave."""
        if "action" in getattr(self.Memory, "_fields", ()):
            self.memory.action[self.active] = action[self.active]

    def _advance(self, clock: Clock | None) -> Bool:
        """Forget worlds that were reset, and give those that have gone on since the latest call, shape (world,)."""
        if clock is None:
            return self.active.copy()
        now, then, period = clock.time_s, self._time_s, self.scenario.timing.decision_period_s
        fresh = self.active & ((clock.episode != self._episode) | (now == 0.0) & (then > 0.0))
        if fresh.any():
            self._forget(fresh)
            self._episode[fresh] = clock.episode[fresh]
        passed = now - then
        late = self.active & ((passed > 1.5 * period) | (passed < 0.0))
        if late.any():
            w = int(np.flatnonzero(late)[0])
            raise PolicyError(
                f"{self.name} was called at {then[w]:g} s and then at {now[w]:g} s in world {w}, but its memory needs "
                f"a call every {period:g} s; call act once for every step, or reset or restore the policy too"
            )
        new = self.active & ~(passed == 0.0)
        then[new] = now[new]
        return new

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """A copy of all that later decisions depend on, for ``restore``."""
        return {name: array.copy() for name, array in self._arrays().items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Continue from a snapshot of the same policy, for the same scenario and number of worlds.

        Raises:
            PolicyError: an array is missing, or has another shape or type.
        """
        for name, array in self._arrays().items():
            saved = snapshot.get(name)
            if saved is None or saved.shape != array.shape or saved.dtype != array.dtype:
                got = "nothing" if saved is None else f"{saved.dtype} of shape {saved.shape}"
                raise PolicyError(f"the snapshot's {name} must be {array.dtype} of shape {array.shape}, got {got}")
        for name, array in self._arrays().items():
            array[...] = snapshot[name]

    def _arrays(self) -> dict[str, NDArray[Any]]:
        memory: dict[str, NDArray[Any]] = self.memory._asdict() if self.Memory else {}
        return {**memory, "clamps": self.clamps, "time_s": self._time_s, "episode": self._episode}

    def flat(self, percept: Percept) -> Float32:
        """The percept's rows for compiled code, shape (world, vehicle, entry), float32.

        Raises:
            PolicyError: they are of other worlds, vehicles or fields than the policy was made for. Compiled code has no
                bounds checks, so that they would be read, and memory be written, beyond their ends.
        """
        rows, expected = percept.flat, (self.num_worlds, self.scenario.swarm.num_vehicles, self.layout.size)
        if rows.shape != expected or rows.dtype != np.float32:
            raise PolicyError(
                f"{self.name} was made for float32 percepts of shape {expected} (world, vehicle, entry), and got "
                f"{rows.dtype} of shape {rows.shape}; make a policy for this swarm: make_policy(name, scenario, num_worlds)"
            )
        if percept.layout != self.layout:
            raise PolicyError(
                f"{self.name} was made for percepts with other fields; make it from the scenario that the swarm was "
                "made from"
            )
        return np.ascontiguousarray(rows)


def parts_of(**policies: Policy) -> dict[str, NDArray[Any]]:
    """The snapshots of policies that are parts of another, in one."""
    return {f"{part}.{name}": array for part, one in policies.items() for name, array in one.snapshot().items()}


def part_of(snapshot: Mapping[str, NDArray[Any]], part: str) -> dict[str, NDArray[Any]]:
    """The snapshot of one of them."""
    begin = f"{part}."
    return {name.removeprefix(begin): array for name, array in snapshot.items() if name.startswith(begin)}


@compiled
def surge_resistance(speed: float, limits: Limits) -> float:
    """Surge resistance per velocity [N s/m] at a speed [m/s] of at least 0. Eq. 4."""
    return limits.X_u + limits.X_uu * speed


@compiled
def write_action(f_x: float, f_y: float, limits: Limits, out: Float32) -> None:
    """The action for a desired body-frame force [N]: thrust along x, torque by the lever arm along y. Eq. 22.

    Args:
        f_x: forward [N].
        f_y: to starboard [N].
        limits: of the actuators, and the surge resistance.
        out: filled with the shares of full surge force and yaw torque, shape (2,).
    """
    a_x, a_y = f_x / limits.max_force, f_y * limits.lever_arm / limits.max_torque
    if limits.helm > 0.0:  # thrust takes nothing from a rudder
        out[0], out[1] = min(max(a_x, -1.0), 1.0), min(max(a_y, -1.0), 1.0)
    else:
        a_x, a_y = project(a_x, a_y)
        out[0], out[1] = a_x, a_y


def tuned(name: str, what: str = "") -> Mapping[str, float]:
    """The best parameters that tuning found for a policy.

    Args:
        name: the policy's name.
        what: the task for which they were found; "" for the paper's, or the one that the policy is made for.

    Raises:
        PolicyError: the policy was not tuned.
    """
    folder = resources.files("uuv_marl.baselines").joinpath("tuned")
    name = f"{name}.{what}" if what else name
    file = folder.joinpath(f"{name}.json")
    if not file.is_file():
        known = sorted(each.name.removesuffix(".json") for each in folder.iterdir() if each.name.endswith(".json"))
        raise PolicyError(f"{name!r} has no tuned gains; there are gains of {', '.join(known)}; see uuv-marl tune")
    data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return data["best"]
