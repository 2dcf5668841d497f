"""``Policy``: base class of policies, from percepts to actions, with a memory."""

import json
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any, ClassVar, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.requirements import PolicyRequirements, check_requirements
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
"""Sine of the angle between bow and desired velocity that demands full rudder at cruise speed [1]. Assumed: 30 degrees,
for which the catalogue's torpedoes need a second or two."""


class Limits(NamedTuple):
    """Actuator limits and surge resistance of a vehicle, in SI units."""

    max_force: float
    max_torque: float
    lever_arm: float
    X_u: float
    X_uu: float
    helm: float
    """Sideways force over the sine of the angle to a desired velocity [N], for a rudder; 0 without one."""
    yaw_damping: float
    """The inner loop's torque, as a share of full torque, over the yaw rate [s]."""

    @staticmethod
    def of(scenario: Scenario) -> "Limits":
        """Limits of a scenario's vehicle."""
        actuators, vehicle = scenario.actuators, scenario.vehicle
        helm = actuators.max_torque_nm / actuators.lever_arm_m / FULL_RUDDER
        return Limits(
            actuators.max_force_n, actuators.max_torque_nm, actuators.lever_arm_m, vehicle.X_u, vehicle.X_uu,
            helm if actuators.kind == "rudder" else 0.0, actuators.yaw_damping_nms / actuators.max_torque_nm,
        )  # fmt: skip


class Policy:
    """Maps the percepts of any number of worlds to actions.

    - A policy defines ``decide(percept)``, which returns actions. Callers use ``act``, once for every decision.
    - A policy with a memory declares its arrays in ``Memory`` and updates them in ``remember(percept, worlds)``;
      ``decide`` reads ``self.memory``. The base class allocates, clears, saves and restores them.
    - ``act`` runs ``update_memory``, ``decide`` and ``drive`` (to the actuators), in this order.
    - A safety filter is a policy with an inner policy, one of its ``parts``: its ``decide`` changes what
      ``decide_part`` returns. ``record_action`` reports actions that replace those of ``act``.

    Args:
        scenario: gives the vehicle's limits, the decision period and the percept's layout.
        num_worlds: first axis of the percepts.

    Raises:
        PolicyError: the scenario does not meet the policy's ``requirements``.
    """

    Memory: ClassVar[type[Any] | None] = None
    """Table of the memory (``uuv_marl.sim.tables``): a NamedTuple of arrays over world, vehicle, sector and active
    sub-sector, zero after a reset. An array ``action``, shape (world, vehicle, 2), receives the actions taken."""
    axes: Mapping[str, int] = {}
    """Lengths of further axes of ``Memory``."""
    requirements: PolicyRequirements = PolicyRequirements()
    """Requirements beyond the percept: channels, inner loop, decision period."""
    parts: Mapping[str, "Policy"] = {}
    """Policies within this one, by name: reset, saved and restored with it."""

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        self.name: str = getattr(self, "name", type(self).__name__)
        """The policy's name in messages."""
        if type(self).act is not Policy.act or type(self).decide is Policy.decide:
            raise PolicyError(f"policy {self.name!r} must define decide(percept), and leave act, which calls it, alone")
        check_requirements(self.name, self.requirements, scenario)
        if num_worlds < 1:
            raise PolicyError(f"num_worlds must be at least 1, got {num_worlds}")
        self.scenario, self.num_worlds = scenario, num_worlds
        self.layout = PerceptLayout.of(scenario)
        has_link = "link" in scenario.sonar.channels
        self.at = self.layout.offsets if has_link else self.layout.message_offsets
        """Start of each field in a flat percept; the link's fields are the modem's where the scenario has no link."""
        self.limits = Limits.of(scenario)
        self.rudder = Rudder.of(scenario) if self.requirements.outputs_force else None
        """Turns desired forces into actions; None where ``decide`` returns actions."""
        self.clamps: Int64 = np.zeros(num_worlds, np.int64)
        """Numerical bounds that were active since the reset, counted per world, shape (world,)."""
        self.active: Bool = np.ones(num_worlds, np.bool_)
        """Worlds whose actions count, shape (world,), all by default. The memory of the others does not change, and
        ``decide`` may leave their actions zero, to save time."""
        self._time_s: Float64 = np.full(num_worlds, np.nan)
        self._episode = np.zeros(num_worlds, np.uint64)
        sonar = scenario.sonar
        sizes = {
            "world": num_worlds, "vehicle": scenario.swarm.num_vehicles, "sector": sonar.num_sectors,
            "active": sonar.num_active_sectors, **self.axes,
        }  # fmt: skip
        self.memory: Any = allocate(self.Memory, sizes) if self.Memory else ()
        """The arrays of ``Memory``."""

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> None:
        """Clear the memory of some worlds. Not needed for percepts with a clock, such as those of a ``Swarm``.

        Args:
            seed: seed of the policy's random numbers in the next episode, ``seed + w`` for world w, or one seed for
                each of ``worlds``; None for the episode's.
            worlds: indices of the worlds; None for all.
        """
        chosen = list(range(self.num_worlds) if worlds is None else worlds)
        world_seeds(seed, chosen)  # raises for an invalid seed
        self.clamps[chosen] = 0
        self._forget(chosen)
        for part in self.parts.values():
            part.reset(seed, worlds)

    def _forget(self, worlds: list[int] | Bool) -> None:
        """Clear the memory of these worlds."""
        self._time_s[worlds] = np.nan
        for array in self.memory:
            array[worlds] = 0

    @final
    def act(self, percept: Percept) -> Float32:
        """Update the memory and return actions. Call this method once for every decision.

        If the percept has a clock, the memory of a world is cleared after its reset, and a second call at the same time
        returns the same actions and changes no memory.

        Args:
            percept: percepts of shape (world, vehicle, ...).

        Returns:
            Actions of shape (world, vehicle, ``scenario.action_size``), float32: forces within the unit disc, or with a
            rudder within the square, and messages, zeros from a policy that sends none.

        Raises:
            PolicyError: the percept is of another swarm; or the policy has a memory and a decision was skipped.
        """
        self.update_memory(percept)
        return self.drive(percept, self.decide(percept))

    @final
    def update_memory(self, percept: Percept) -> None:
        """Update the memory in the worlds whose time has advanced. Call it before ``decide``."""
        if self.Memory is not None:
            self.flat(percept)
            self.remember(percept, self._advance(percept.clock))

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Hook: update ``memory`` from the percepts of these worlds, a mask of shape (world,)."""

    def decide(self, percept: Percept) -> Float32:
        """Actions, or desired forces as shares of full thrust and torque (``outputs_force``), (world, vehicle, 2).

        The entries of its messages may follow, shape (world, vehicle, ``scenario.action_size``).
        """
        raise NotImplementedError

    @final
    def drive(self, percept: Percept, output: Float32) -> Float32:
        """Actions for the output of ``decide``, which may be overwritten. Raises PolicyError for another shape."""
        shape, wide = percept.flat.shape[:2], {2, self.scenario.action_size}
        if np.shape(output) not in {(*shape, entries) for entries in wide}:
            raise PolicyError(f"decide must return an array of shape {(*shape, min(wide))}, got {np.shape(output)}")
        if self.rudder is not None:
            steer_by_rudder(self.flat(percept), self.layout.offsets, self.rudder, output)
        self.record_action(output)
        silent = self.scenario.action_size - output.shape[2]
        return np.pad(output, ((0, 0), (0, 0), (0, silent))) if silent else output

    def record_action(self, action: Float32) -> None:
        """Store the actions taken, if ``Memory`` has an array for them; for actions that replace those of ``act``."""
        if "action" in getattr(self.Memory, "_fields", ()):
            self.memory.action[self.active] = action[self.active, :, :2]
        for part in self.parts.values():
            part.record_action(action)

    @final
    def decide_part(self, name: str, percept: Percept) -> Float32:
        """Output of a part's ``decide``, after an update of its memory."""
        part = self.parts[name]
        part.active = self.active
        part.update_memory(percept)
        return part.decide(percept)

    def _advance(self, clock: Clock | None) -> Bool:
        """Clear the memory of worlds that were reset; a mask of the worlds whose time has advanced, shape (world,)."""
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
        """A copy of all state that later decisions depend on, for ``restore``."""
        return {name: array.copy() for name, array in self._arrays().items()} | parts_of(**self.parts)

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Continue from a snapshot of the same policy. Raises PolicyError for missing or differently shaped arrays."""
        for name, array in self._arrays().items():
            saved = snapshot.get(name)
            if saved is None or saved.shape != array.shape or saved.dtype != array.dtype:
                got = "nothing" if saved is None else f"{saved.dtype} of shape {saved.shape}"
                raise PolicyError(f"the snapshot's {name} must be {array.dtype} of shape {array.shape}, got {got}")
        for name, array in self._arrays().items():
            array[...] = snapshot[name]
        for name, part in self.parts.items():
            part.restore(part_of(snapshot, name))

    def _arrays(self) -> dict[str, NDArray[Any]]:
        memory: dict[str, NDArray[Any]] = self.memory._asdict() if self.Memory else {}
        return {**memory, "clamps": self.clamps, "time_s": self._time_s, "episode": self._episode}

    def flat(self, percept: Percept) -> Float32:
        """The percept's rows for compiled code, which has no bounds checks, shape (world, vehicle, entry), float32.

        Raises:
            PolicyError: the percept is of other worlds, vehicles or fields than the policy was made for.
        """
        rows, expected = percept.flat, (self.num_worlds, self.scenario.swarm.num_vehicles, self.layout.size)
        if rows.shape != expected or rows.dtype != np.float32 or percept.layout != self.layout:
            raise PolicyError(
                f"{self.name} was made for float32 percepts of shape {expected} (world, vehicle, entry) and of its "
                f"scenario's fields, and got {rows.dtype} of shape {rows.shape}; make one from the scenario and the "
                "number of worlds of this swarm: make_policy(name, scenario, num_worlds)"
            )
        return np.ascontiguousarray(rows)


def parts_of(**policies: Policy) -> dict[str, NDArray[Any]]:
    """One snapshot of several inner policies."""
    return {f"{part}.{name}": array for part, one in policies.items() for name, array in one.snapshot().items()}


def part_of(snapshot: Mapping[str, NDArray[Any]], part: str) -> dict[str, NDArray[Any]]:
    """The snapshot of one inner policy."""
    begin = f"{part}."
    return {name.removeprefix(begin): array for name, array in snapshot.items() if name.startswith(begin)}


@compiled
def surge_resistance(speed: float, limits: Limits) -> float:
    """Surge resistance over velocity [N s/m] at a speed [m/s] of at least 0. Eq. 4."""
    return limits.X_u + limits.X_uu * speed


@compiled
def write_action(f_x: float, f_y: float, limits: Limits, out: Float32) -> None:
    """Write the action for a desired body-frame force [N], f_x forward and f_y to starboard. Eq. 22.

    ``out``, shape (2,), receives shares of full surge force and yaw torque, which acts by the lever arm.
    """
    a_x, a_y = f_x / limits.max_force, f_y * limits.lever_arm / limits.max_torque
    if limits.helm > 0.0:  # thrust does not limit a rudder
        out[0], out[1] = min(max(a_x, -1.0), 1.0), min(max(a_y, -1.0), 1.0)
    else:
        a_x, a_y = project(a_x, a_y)
        out[0], out[1] = a_x, a_y


def tuned(name: str, what: str = "") -> Mapping[str, float]:
    """Tuned parameters of a policy, for a task, or for the policy's default task. Raises PolicyError if none exist."""
    folder = resources.files("uuv_marl.baselines").joinpath("tuned")
    name = f"{name}.{what}" if what else name
    file = folder.joinpath(f"{name}.json")
    if not file.is_file():
        known = sorted(each.name.removesuffix(".json") for each in folder.iterdir() if each.name.endswith(".json"))
        raise PolicyError(f"{name!r} has no tuned gains; there are gains of {', '.join(known)}; see uuv-marl tune")
    data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return data["best"]
