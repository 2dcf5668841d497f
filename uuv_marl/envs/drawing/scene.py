"""A scene: the content of a picture of one world at one moment, live or recorded."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.scenario import Scenario
from uuv_marl.sim.disturbances.current import FlowField
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.groups import Groups, groups_of
from uuv_marl.types import Bool

Float = NDArray[np.floating]

TRAIL_S = 20.0
"""Duration of a trail [s]."""


class SonarView(NamedTuple):
    """The sonar percept of one vehicle."""

    vehicle: int
    neighbour: Float
    """Positions of detected vehicles in its body frame [m], shape (detected, 2)."""
    echo_range: Float
    """Range to the nearest obstacle in each active sub-sector [m], 0 for none, shape (active,)."""


class Scene(NamedTuple):
    """One world at one moment. Frame north, east [m]; the vehicle is the last axis but the coordinates."""

    scenario: Scenario
    waypoints: Float
    """Corners of the first group's trajectory, shape (point, 2)."""
    groups: Groups
    obstacles: Float
    """Centre north, east and radius, shape (obstacle, 3)."""
    marks: Float
    """Circles that the task draws: centre north, east and radius, shape (mark, 3)."""
    time_s: float
    references: Float
    """Position of each group's l(t), shape (group, 2)."""
    position: Float
    """Position of every vehicle, for a lost one its last, shape (vehicle, 2)."""
    heading: Float
    """Clockwise from north [rad], shape (vehicle,)."""
    alive: Bool
    """False for lost vehicles, shape (vehicle,)."""
    near: Bool
    """Nearer than s_u to another vehicle, or than s_o to an obstacle, shape (vehicle,)."""
    sending: Bool
    """Began to send a message in the latest decision, shape (vehicle,)."""
    trail: Sequence[Float]
    """Past positions, the oldest first, shape (vehicle, 2) each."""
    hits: Float
    """Collisions so far: north, east and time [s], shape (hit, 3)."""
    arrival_s: float | None
    """Time of the swarm's arrival, None before."""
    collisions: int
    """Collisions so far."""
    min_spacing_m: float
    """Smallest distance between two vehicles; infinite for a single one."""
    clearance_m: float
    """Smallest distance of a vehicle to an obstacle's surface; infinite without obstacles."""
    centre_error_m: float
    """Distance of the swarm's centre from l(t)."""
    sonar: SonarView | None
    water: FlowField | None
    """The current; None if the scenario has none."""

    @property
    def place(self) -> str:
        """Name of a reference, such as ``l(t)``."""
        return self.scenario.task_class.reference_label.partition(",")[0]

    @property
    def followed_paths(self) -> list[tuple[int | None, Float, Float]]:
        """Team, corners and l(t) of each group with a trajectory."""
        return [(team, path, self.references[g]) for g, (team, path) in self.groups.paths.items() if len(path) > 1]


class SceneHistory:
    """Trails and collisions of every world of a swarm, from the steps that were noted."""

    def __init__(self, swarm: Swarm) -> None:
        self._swarm, period, worlds = swarm, swarm.scenario.timing.decision_period_s, range(swarm.num_worlds)
        self._every = max(1, round(1.0 / period))
        most = max(1, round(TRAIL_S / (self._every * period)))
        self._trails: list[deque[Float]] = [deque(maxlen=most) for _ in worlds]
        self._hits: list[list[tuple[float, float, float]]] = [[] for _ in worlds]
        self._collisions = np.zeros(len(worlds), np.int64)
        self._keys, self._time_s, self._steps = swarm.keys.copy(), np.full(len(worlds), -1.0), 0

    def note(self) -> None:
        """Record the worlds after a reset or a step; a second call at the same moment changes nothing."""
        swarm, facts = self._swarm, self._swarm.facts
        if np.array_equal(facts.time_s, self._time_s) and np.array_equal(swarm.keys, self._keys):
            return
        for w in np.flatnonzero((swarm.keys != self._keys) | (facts.time_s < self._time_s)):
            self._hits[w].clear()
            self._trails[w].clear()
            self._collisions[w] = 0
        stepped = facts.time_s > self._time_s
        self._collisions += facts.collisions * stepped
        for w, i in np.argwhere((facts.vehicle_collisions > 0) & stepped[:, None]):
            self._hits[w].append((*swarm.state.eta[w, i, :2], facts.time_s[w]))
        if self._steps % self._every == 0:
            for trail, eta in zip(self._trails, swarm.state.eta, strict=True):
                trail.append(eta[:, :2].astype(np.float32))
        self._steps += 1
        self._keys, self._time_s = swarm.keys.copy(), facts.time_s.copy()

    def scene(self, sonar_of: int | None = None, world: int = 0) -> Scene:
        """The present scene of a world, with the sonar of one vehicle unless it is lost."""
        swarm, w = self._swarm, world
        world_map, state, facts, constraints = swarm.world_map, swarm.state, swarm.facts, swarm.scenario.constraints
        alive, arrival_s = state.alive[w].copy(), float(facts.arrival_s[w, 0])
        return Scene(
            scenario=swarm.scenario,
            waypoints=world_map.waypoints[w, 0, : world_map.last[w, 0] + 1].copy(),
            obstacles=world_map.obstacles[w, : world_map.num_obstacles[w]].copy(),
            groups=groups_of(swarm, w),
            marks=np.array(swarm.task.marks(w)),
            time_s=float(facts.time_s[w]),
            references=facts.reference[w, :, :2].copy(),
            position=state.eta[w, :, :2].copy(),
            heading=state.eta[w, :, 2].copy(),
            alive=alive,
            near=alive & ((facts.spacing[w] < constraints.s_u_m) | (facts.clearance[w] < constraints.s_o_m)),
            sending=swarm.sent[w],
            trail=list(self._trails[w]),
            hits=np.array(self._hits[w]).reshape(-1, 3),
            arrival_s=arrival_s if np.isfinite(arrival_s) and swarm.task.has_goal else None,
            collisions=int(self._collisions[w]),
            min_spacing_m=float(facts.min_spacing[w]),
            clearance_m=float(facts.obstacle_clearance[w].min()),
            centre_error_m=float(np.hypot(*(facts.centre[w] - swarm.mean_reference[w, :2]))),
            sonar=None if sonar_of is None or not alive[sonar_of] else _sonar(swarm, world, sonar_of),
            water=swarm.flow_field(w) if swarm.scenario.current.flows else None,
        )


def _sonar(swarm: Swarm, world: int, vehicle: int) -> SonarView:
    percept, at = swarm.percept, (world, vehicle)
    neighbour = percept["neighbour"][at][percept["detected"][at] > 0]
    return SonarView(vehicle, neighbour, percept["echo_range"][at].copy())
