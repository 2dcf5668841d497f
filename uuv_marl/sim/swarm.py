"""Swarm: any number of worlds, reset singly and stepped in one call; it seeds, samples and checks."""

import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.percept import Clock, Percept, PerceptLayout, task_fields
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import SeedLike, action_array, whole_number, world_seeds
from uuv_marl.sim.arrays import Facts, Senses, State, World, WorldMap
from uuv_marl.sim.disturbances.current import Flow, FlowField
from uuv_marl.sim.disturbances.disturbances import disturbance_tables, make_disturbances, sample_disturbances
from uuv_marl.sim.engine import Engine
from uuv_marl.sim.episode_setup import EpisodeSetup
from uuv_marl.sim.model import ARRIVAL_RADII_M
from uuv_marl.sim.random import episode_key, packed, unpacked
from uuv_marl.sim.spacing import NOWHERE
from uuv_marl.sim.tables import allocate, check
from uuv_marl.sim.traffic import sample_traffic
from uuv_marl.types import Bool, Float64

_log = logging.getLogger("uuv_marl")


class Swarm:
    """Worlds of one scenario, each with its own random generator.

    ``state``, ``world_map`` and ``facts`` hold arrays whose first axis is the world. They and the returned percepts
    are buffers that the next ``step`` or ``reset`` overwrites. A world's run depends only on its seed and actions.

    Args:
        scenario: scenario to simulate.
        num_worlds: number of worlds that a call steps.
    """

    def __init__(self, scenario: Scenario, num_worlds: int = 1) -> None:
        self.num_worlds = num_worlds = whole_number("num_worlds", num_worlds, 1)
        self.scenario = scenario
        self.num_vehicles = scenario.swarm.num_vehicles
        self.layout = PerceptLayout.of(scenario)
        self.task_fields = task_fields(scenario)
        """Fields of the percept that the task writes."""
        self._rngs: list[np.random.Generator | None] = [None] * num_worlds
        self._ready, self._warned = np.zeros(num_worlds, np.bool_), np.zeros(num_worlds, np.bool_)
        self.duration_s = np.zeros(num_worlds)
        """Duration of l(t) up to its end [s], the least task time; shape (world,)."""
        self.keys = np.zeros(num_worlds, np.uint64)
        """Key of each world's episode, for ``uuv_marl.sim.random``, shape (world,)."""
        self._seeds = np.zeros(num_worlds, np.uint64)
        kind = scenario.task_class
        self._sizes = _sizes(scenario, num_worlds, self.layout.size) | kind.sizes(scenario)
        self.state, self.world_map = allocate(State, self._sizes), allocate(WorldMap, self._sizes)
        self.facts, self._senses = allocate(Facts, self._sizes), allocate(Senses, self._sizes)
        self.detected_index, self.heading = self._senses.detected_index, self._senses.heading
        """Index of the vehicle detected in each sub-sector, -1 for none, shape (world, vehicle, sector); cosine and
        sine of every vehicle's heading psi, shape (world, vehicle, 2)."""
        self._world = World(self.state, self.world_map, self.facts, self._senses)
        self.facts.arrival_s[:], self.facts.diverged[:] = np.nan, -1
        self._disturbances = make_disturbances(scenario, self.keys, self._sizes)
        self._engine = Engine(scenario, self._world, self._disturbances)
        self.task: Any = kind(self)
        """The ``uuv_marl.tasks.Task``, which samples episodes and writes its own fields of percepts."""
        self._task_memory: dict[str, NDArray[Any]] = {} if kind.Memory is None else self.task.memory._asdict()

    @property
    def percept(self) -> Percept:
        """Present percepts of all vehicles, shape (world, vehicle, ...)."""
        clock = Clock(self.facts.time_s, self.keys, self._seeds)
        return Percept(self._senses.percept, self.layout, clock, self.state.alive)

    @property
    def own_reference(self) -> Float64:
        """Position and velocity of every vehicle's l(t), north and east [m, m/s], shape (world, vehicle, 4)."""
        return np.take_along_axis(self.facts.reference, self.world_map.group[:, :, None], axis=1)

    @property
    def mean_reference(self) -> Float64:
        """Mean of the groups' l(t): position [m] and velocity [m/s], shape (world, 4)."""
        return self.facts.reference.mean(axis=1)

    @property
    def flow(self) -> Float64:
        """Velocity of the water at each vehicle, north and east [m/s], shape (world, vehicle, 2)."""
        return np.zeros_like(self.state.before) if self._disturbances is None else self._disturbances.flow.flow

    @property
    def currents(self) -> Flow | None:
        """Current of each world; None without disturbances.

        ``mean``, ``gust`` and ``eddies`` may be written between steps, for a current of your own: the flow at the
        vehicles is computed from them at the end of each control step. A reset samples them again.
        """
        return None if self._disturbances is None else self._disturbances.flow

    def flow_field(self, world: int = 0) -> FlowField:
        """Present velocity field of a world's water, as in ``swarm.flow_field().at([[100.0, 200.0]])``."""
        flow, core_m = self.currents, self.scenario.current.eddy_core_m
        if flow is None:
            return FlowField(np.zeros(2), np.zeros((0, 3)), core_m)
        eddies = flow.eddies[world]
        return FlowField(flow.mean[world] + flow.gust[world], eddies[eddies[:, 2] != 0.0], core_m)

    @property
    def velocity(self) -> Float64:
        """Every vehicle's velocity over ground, surge and sway in its body frame [m/s], shape (world, vehicle, 2)."""
        if self._disturbances is None:
            return self.state.nu[:, :, :2]
        (c, s), (x, y) = np.moveaxis(self.heading, -1, 0), np.moveaxis(self._disturbances.flow.flow, -1, 0)
        drift = np.stack([c * x + s * y, c * y - s * x], axis=-1)
        return self.state.nu[:, :, :2] + drift * self.state.alive[:, :, None]

    @property
    def compass(self) -> Float64:
        """Cosine and sine of every vehicle's heading by its own compass, shape (world, vehicle, 2)."""
        if self._disturbances is None:
            return self.heading
        (c, s), (x, y) = np.moveaxis(self._disturbances.navigation_errors.bias, -1, 0), np.moveaxis(self.heading, -1, 0)
        return np.stack([c * x - s * y, c * y + s * x], axis=-1)

    @property
    def sends(self) -> Bool:
        """Vehicles whose next slot begins during the next decision, which sends its message, shape (world, vehicle)."""
        end_s = self.facts.time_s + self.scenario.timing.decision_period_s
        return self.state.alive & (self._slot_starts("next_slot") < end_s[:, None] - 1e-9)

    @property
    def sent(self) -> Bool:
        """Vehicles that began to send a message during the latest decision, shape (world, vehicle)."""
        begin_s = self.facts.time_s - self.scenario.timing.decision_period_s
        return self._slot_starts("packet_slot") > begin_s[:, None] - 1e-9

    def _slot_starts(self, which: str) -> Float64:
        """Start of every vehicle's next or latest slot [s], NaN for none, shape (world, vehicle)."""
        disturbances = self._disturbances
        if disturbances is None or self.scenario.modem.message_entries == 0:
            return np.full(self.state.alive.shape, np.nan)
        slots = getattr(disturbances.packets, which)
        return np.where(slots >= 0, slots * disturbances.packet_model.slot_s, np.nan)

    @property
    def time_limit_s(self) -> Float64:
        """Time at which an episode is truncated [s], shape (world,)."""
        return self.scenario.time_limit.of(self.duration_s)

    @property
    def faulty(self) -> Bool:
        """Vehicles that a fault of the scenario has affected since the reset, shape (world, vehicle)."""
        if self._disturbances is None:
            return np.zeros_like(self.state.alive)
        first, end = np.moveaxis(self._disturbances.hull.broken, -1, 0)
        return ((first < end) & (first < self.state.tick[:, None, None])).any(axis=2)

    @property
    def arrived(self) -> Bool:
        """Worlds whose swarm has arrived, shape (world,)."""
        return ~np.isnan(self.facts.arrival_s[:, 0])

    def endings(self) -> tuple[Bool, Bool]:
        """Whether episodes are terminated and truncated, shape (world,) each.

        Returns:
            Terminated: the task is done (the swarm has arrived, say), or all vehicles are lost.
            Truncated: the time limit is reached, or the world diverged.
        """
        terminated = self.task.done() | ~self.state.alive.any(axis=1)
        late = self.facts.time_s >= self.time_limit_s - 1e-9
        return terminated, (late | (self.facts.diverged >= 0)) & ~terminated

    @property
    def ended(self) -> Bool:
        """Worlds whose episode is over, shape (world,)."""
        terminated, truncated = self.endings()
        return terminated | truncated

    def divergence(self, world: int) -> str:
        """Message about a world that diverged, with the remedy."""
        timing = self.scenario.timing
        return (
            f"vehicle {self.facts.diverged[world]} of world {world} diverged before {self.facts.time_s[world]:g} s: "
            f"its speed grew without limit: timing.integration_step_s = {timing.integration_step_s:g} is too long for "
            "this vehicle; use a smaller step, or weaker actuators"
        )

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> Percept:
        """Reset worlds.

        Args:
            seed: world w starts from ``seed + w``; or a sequence with a seed or None for each of ``worlds``. Without a
                seed a world's own generator continues, or starts from fresh entropy.
            worlds: indices of the worlds to reset, default all.
        """
        chosen = range(self.num_worlds) if worlds is None else worlds
        for w, own in zip(chosen, world_seeds(seed, chosen), strict=True):
            stream = self._rngs[w] if own is None else np.random.default_rng(own)
            self._reset_world(w, stream or np.random.default_rng())
            self._seeds[w] = self.keys[w] if own is None or own >= 2**64 else own
        self._write_task_fields(np.isin(np.arange(self.num_worlds), list(chosen)))
        return self.percept

    def _reset_world(self, w: int, rng: np.random.Generator) -> None:
        self._rngs[w], self.keys[w] = rng, episode_key(rng)
        for array in self._task_memory.values():
            array[w] = 0
        setup: EpisodeSetup = self.task.draw(w, rng)
        if setup.duration_s > (longest := self.task.longest_s(self.scenario)) + 1e-9:
            raise ValueError(
                f"task {self.scenario.task.name!r} drew duration_s = {setup.duration_s:g}, and its longest_s gives "
                f"{longest:g}; override longest_s, so that every episode ends in time"
            )
        state, world_map, m = self.state, self.world_map, len(setup.obstacles)
        for g, (waypoints, times) in enumerate(zip(setup.waypoints, setup.times, strict=True)):
            points = len(waypoints)
            world_map.waypoints[w, g, :points], world_map.waypoints[w, g, points:] = waypoints, waypoints[-1]
            world_map.times[w, g, :points], world_map.times[w, g, points:] = times, times[-1]
            world_map.last[w, g] = points - 1
        world_map.group[w], world_map.informed[w] = setup.group, setup.informed
        self.duration_s[w] = setup.duration_s
        world_map.obstacles[w, :m], world_map.obstacles[w, m:] = setup.obstacles, 0.0
        world_map.num_obstacles[w] = m
        sample_traffic(w, self.keys[w], self.scenario, world_map)
        state.eta[w], state.nu[w] = setup.eta, setup.nu
        state.before[w] = state.eta[w, :, :2]
        state.obstacles_before[w], state.obstacles_before[w, :m] = NOWHERE, setup.obstacles
        world_map.losses[w] = rng.permutation(self.num_vehicles)[: world_map.losses.shape[1]]
        state.alive[w], state.tick[w] = True, 0
        self._ready[w], self._warned[w] = True, False
        if self._disturbances is not None:
            sample_disturbances(w, self.scenario, world_map, setup.duration_s, self._disturbances)
        self._engine.observe(w)
        self.task.begin(w)

    def observe(self) -> Percept:
        """Compute facts and percepts again, as after a reset, once ``state`` or ``world_map`` was changed by hand.

        With disturbances, drift and delayed readings are cleared; current, forces, faults and messages continue.
        """
        self._check_indices(self._arrays())
        for w in range(self.num_worlds):
            self._engine.observe(w)
        self._write_task_fields(self._ready)
        return self.percept

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """A copy of all that a later run depends on, random generators included, for ``restore``."""
        return {name: array.copy() for name, array in self._arrays().items()} | {"streams": packed(self._rngs)}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> Percept:
        """Continue from a snapshot of a swarm of the same scenario and number of worlds.

        Raises:
            ValueError: an array is missing, has another shape or type, or holds an index beyond its array.
        """
        arrays = self._arrays()
        for name, array in arrays.items():
            saved = snapshot.get(name)
            if saved is None or saved.shape != array.shape or saved.dtype != array.dtype:
                got = "nothing" if saved is None else f"{saved.dtype} of shape {saved.shape}"
                raise ValueError(f"the snapshot's {name} must be {array.dtype} of shape {array.shape}, got {got}")
        self._check_indices(snapshot)
        self._rngs = unpacked(snapshot.get("streams", np.zeros(0)), self.num_worlds)
        for name, array in arrays.items():
            array[...] = snapshot[name]
        self._ready[:] = True
        return self.percept

    def _check_indices(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Raise ValueError where an index that compiled code uses unchecked is out of its array."""
        for table in self._tables():
            check(cast(type[Any], type(table)), arrays, self._sizes)

    def _tables(self) -> tuple[Any, ...]:
        return (*self._world, *disturbance_tables(self._disturbances))

    def _arrays(self) -> dict[str, NDArray[Any]]:
        return {
            "duration_s": self.duration_s,
            "keys": self.keys,
            "seeds": self._seeds,
            **{name: array for table in self._tables() for name, array in table._asdict().items()},
            **{f"task.{name}": array for name, array in self._task_memory.items()},
        }

    def step(
        self, action: ArrayLike, active: Bool | None = None, on_stepped: Callable[[int, int], None] | None = None
    ) -> Percept:
        """Advance by one decision period.

        Args:
            action: shape (world, vehicle, 2 + ``modem.message_entries``), rounded to float32: shares of full surge
                force and yaw torque, projected onto the unit disc, and the message. Those of lost vehicles are ignored.
            active: worlds to step, shape (world,); the others stay unchanged. Default all.
            on_stepped: called with start and end of each range of worlds that was stepped, by its thread.
        """
        action = action_array(action, (self.num_worlds, self.num_vehicles, self.scenario.action_size), "action")
        if not np.isfinite(action).all() and not np.isfinite(action[self.state.alive]).all():
            w, i, k = (int(index) for index in np.argwhere(~np.isfinite(action) & self.state.alive[:, :, None])[0])
            raise ValueError(f"action must be finite, got {action[w, i, k]} for vehicle {i} of world {w}")
        if active is not None and (active.shape != (self.num_worlds,) or active.dtype != np.bool_):
            raise ValueError(
                f"active must be bool of shape ({self.num_worlds},), got {active.dtype} of shape {active.shape}"
            )
        if not (self._ready if active is None else self._ready | ~active).all():
            raise RuntimeError(f"world {int(np.argmin(self._ready))} was stepped before reset; call reset() first")
        running = self._ready if active is None else active
        self.task.move(running)
        diverged = self._engine.step(np.ascontiguousarray(action), active, on_stepped)
        self.task.update(running)
        self._write_task_fields(running)
        if diverged:
            for w in np.flatnonzero((self.facts.diverged >= 0) & ~self._warned):
                _log.warning(self.divergence(int(w)))
                self._warned[w] = True
        return self.percept

    def _write_task_fields(self, worlds: Bool) -> None:
        """Write the task's fields into the percepts of the living of these worlds, shape (world,)."""
        if not self.task_fields:
            return
        rows, percept, observing = self.task.fields(worlds), self.percept, worlds[:, None] & self.state.alive
        for field in self.task_fields:
            percept[field.name][observing] = np.clip(
                rows[field.name][observing], field.quantity.low, field.quantity.high
            )


def _sizes(scenario: Scenario, worlds: int, entries: int) -> dict[str, int]:
    """Lengths of the axes of all tables."""
    field = scenario.random_field
    return {
        "world": worlds,
        "vehicle": scenario.swarm.num_vehicles,
        "group": 1,
        "point": field.legs[1] + 1 if field else len(scenario.trajectory.waypoints_m or ()),
        "obstacle": max(scenario.max_obstacles, 1),
        "loss": len(scenario.losses.times_s),
        "sector": scenario.sonar.num_sectors,
        "radius": 1 + len(ARRIVAL_RADII_M),
        "entry": entries,
    }
