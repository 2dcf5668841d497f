"""``hard_water``: closed water with walls, sampled by seed, with a collision-free path for every vehicle."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from uuv_marl.percept import LENGTH, FieldTable, PerceptField
from uuv_marl.scenario import Scenario, ScenarioError
from uuv_marl.scenario.fields import Positive
from uuv_marl.scenario.vehicle_checks import top_speed
from uuv_marl.sim.episode_setup import EpisodeSetup, start_state
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trigonometry import cos_sin, rotated
from uuv_marl.tasks.maps.grid_paths import CELL_M, MapGrid, distances, free_cells, reached
from uuv_marl.tasks.maps.guidance import PATH_FIELDS, in_axes, move_ahead, path_terms
from uuv_marl.tasks.maps.kinds import KINDS, Bar, Forest, Gate, Harbour, Maze, Piles, Pocket
from uuv_marl.tasks.maps.walls import Basin, MapKind, Range, banks, between, joined
from uuv_marl.tasks.reach import Reach, ReachNumbers
from uuv_marl.tasks.reward import Terms
from uuv_marl.types import Bool, Float64, Int64

MOST_DISCS = 320
"""Most discs of a map."""
MOST_TRIES = 1000
"""Maps that are sampled before the numbers are refused."""
FAR_M = 5000.0
"""Length of a path where there is none [m]."""
QUEUE_S = 0.8
"""Time [s] that each vehicle adds to the time limit, since vehicles pass a gap one by one. Assumed: they follow each
other at s_u, 4 m, and 5 m/s."""
_DEAR_M, _DEAR, _NARROW = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0), 0.5, 20.0
"""Distances to a surface [m], each of which adds the next number to a path's cost per length; what the map's own
clearance adds. Tried by hand."""
_AROUND = np.indices((3, 3)).reshape(2, 9, 1) - 1
"""Rows and columns from a cell to itself and to its eight neighbours."""


class HardWaterNumbers(ReachNumbers):
    """Numbers of ``hard_water``; the scenario's file has their sources."""

    kinds: tuple[str, ...]
    """Kinds of maps, equally likely."""
    length_m: Range
    """Distance from the start to the goal."""
    half_width_m: Range
    """Distance from the middle to the bank at each side."""
    behind_m: Positive
    """Distance from the start to the bank behind it."""
    beyond_m: Positive
    """Distance from the goal to the bank beyond it."""
    bank_radius_m: Positive
    """Radius of the banks' discs."""
    first_wall_m: Positive
    """Least distance of a wall ahead of the start."""
    start_clear_m: Positive
    """Least distance of a wall from the start's box."""
    goal_clear_m: Positive
    """Least distance of a wall from the goal, less for separate discs."""
    clearance_m: Positive
    """Least clearance of a path through the map from all surfaces."""
    pocket: Pocket
    bar: Bar
    gate: Gate
    forest: Forest
    maze: Maze
    harbour: Harbour
    piles: Piles

    def _check(self) -> None:
        if not self.kinds or not {*self.kinds} <= KINDS.keys():
            raise ValueError(f"task.kinds must name some of {', '.join(KINDS)}, got {list(self.kinds)}")
        if self.length_m[0] - self.goal_clear_m < self.first_wall_m:
            raise ValueError(
                f"task.length_m must be at least {self.first_wall_m + self.goal_clear_m:g}, task.first_wall_m and "
                f"task.goal_clear_m, got {list(self.length_m)}; raise it"
            )

    def grid(self) -> MapGrid:
        """Cells that cover the largest map."""
        rows = int((self.behind_m + self.length_m[1] + self.beyond_m) / CELL_M) + 1
        return MapGrid(-self.behind_m, -self.half_width_m[1], rows, int(2.0 * self.half_width_m[1] / CELL_M) + 1)


class Map(NamedTuple):
    """A map in its own frame (``maps/walls.py``)."""

    kind: str
    length: float
    """Distance from the start to the goal [m]."""
    discs: Float64
    """Walls and banks: x, y and radius [m], shape (disc, 3)."""


class HardWaterMemory(NamedTuple):
    """Memory of ``hard_water``."""

    first_at_goal_s: Annotated[Float64, "world vehicle", "When the vehicle was first at the goal [s]; 0 before."]
    best_s: Annotated[Float64, "world vehicle", "Length of its collision-free path at the start over full speed [s]."]
    turn: Annotated[Float64, "world 2", "Cosine and sine of the angle by which the map is turned."]
    path_length: Annotated[Float64, "world row column", "Length of the path to the goal from each cell [m]."]
    path_cost: Annotated[Float64, "world cost_row column", "Cost of the path from each cell; empty without ``path``."]
    kind: Annotated[Float64, "world", "Index of the map's kind in ``KINDS``."]


class HardWater(Reach):
    """Reach a goal at rest through closed water with walls, sampled by seed, without a collision.

    Vehicles perceive the vector to the goal, and must find the path by sonar and memory.
    """

    Numbers = HardWaterNumbers
    Memory: ClassVar[type[Any] | None] = HardWaterMemory
    channels: ClassVar[Mapping[str, FieldTable]] = {"path": PATH_FIELDS}
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {
        **Reach.rewards,
        "geodesic": {**Reach.rewards["dense"], "progress": "as in dense; d: length of the collision-free path"},
    }
    traffic: ClassVar[bool] = False  # a wall whose discs move has gaps, and a gate may close
    columns: ClassVar[Mapping[str, str]] = {
        "time_ratio": "mean over vehicles that reached the goal: time over that of the shortest path at full speed [1]"
    }

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        self._grid: MapGrid = self.numbers.grid()
        self._remaining_before_m = np.zeros(swarm.state.alive.shape)

    @classmethod
    def sizes(cls, scenario: Scenario) -> Mapping[str, int]:
        """The discs and the cells of a map."""
        grid = scenario.task_numbers.grid()
        cost_rows = grid.rows if "path" in scenario.sonar.channels else 0
        return {"point": 2, "obstacle": MOST_DISCS, "row": grid.rows, "column": grid.columns, "cost_row": cost_rows}

    @classmethod
    def longest_s(cls, scenario: Scenario) -> float:
        """Three times the longest straight path at full speed, and the queue."""
        numbers, n = scenario.task_numbers, scenario.swarm.num_vehicles
        longest = numbers.length_m[1] + scenario.start.sides(n)[0]
        return 3.0 * longest / top_speed(scenario.vehicle, scenario.actuators) + QUEUE_S * n

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        """A map with a path, turned at random, and the scenario's start."""
        scenario, memory, sampled = self.swarm.scenario, self.memory, self.sample_map(rng)
        c, s = memory.turn[world] = cos_sin(rng.uniform(-np.pi, np.pi))
        discs, goal = sampled.discs.copy(), rotated(np.array([[0.0, 0.0], [sampled.length, 0.0]]), c, s)
        discs[:, :2] = rotated(sampled.discs[:, :2], c, s)
        eta, nu = start_state(scenario, goal, rng)
        free = free_cells(sampled.discs, self._grid, scenario.collision.hull_radius_m)
        goal_cell = self._grid.cell(sampled.length, 0.0)
        memory.path_length[world] = np.minimum(distances(free, *goal_cell), FAR_M)
        if memory.path_cost.size:
            dear = np.sum([~free_cells(sampled.discs, self._grid, near) for near in _DEAR_M], axis=0)
            price = 1.0 + _DEAR * dear + _NARROW * ~free_cells(sampled.discs, self._grid, self.numbers.clearance_m)
            memory.path_cost[world] = distances(free, *goal_cell, price)
        memory.kind[world] = list(KINDS).index(sampled.kind)
        n = len(eta)
        path_lengths = self._path_lengths(np.full(n, world), eta[:, :2], goal[1])
        memory.best_s[world] = path_lengths / top_speed(scenario.vehicle, scenario.actuators)
        return EpisodeSetup(
            (goal,), (np.zeros(2),), discs, eta, nu, group=np.zeros(n, np.int64), informed=np.ones(n, np.bool_),
            duration_s=min(float(memory.best_s[world].max()) + QUEUE_S * n, self.longest_s(scenario)),
        )  # fmt: skip

    def sample_map(self, rng: np.random.Generator) -> Map:
        """A map in its own frame with a path to the goal.

        Raises:
            ScenarioError: none of a thousand maps has one.
        """
        numbers = self.numbers
        for _ in range(MOST_TRIES):
            kind = numbers.kinds[int(rng.integers(len(numbers.kinds)))]
            length, half = between(rng, numbers.length_m), between(rng, numbers.half_width_m)
            water = Basin(length, half, numbers.first_wall_m, length - numbers.goal_clear_m)
            own: MapKind = getattr(numbers, kind)
            walls = own.walls(rng, water)
            shore = banks(length, half, numbers.behind_m, numbers.beyond_m, numbers.bank_radius_m)
            sampled = Map(kind, length, joined(walls, shore))
            if len(sampled.discs) <= MOST_DISCS and self._passable(sampled, walls, own.blocks):
                return sampled
        raise ScenarioError(
            f"task {self.swarm.scenario.task.name!r} sampled {MOST_TRIES} maps of {', '.join(numbers.kinds)}, none of "
            f"them with a path at task.clearance_m = {numbers.clearance_m:g}; widen the gaps, or lower the clearance"
        )

    def _passable(self, sampled: Map, walls: Float64, blocks: bool) -> bool:
        """Whether the start's whole box has a path to the goal, and where walls should block, no straight one."""
        numbers, scenario = self.numbers, self.swarm.scenario
        if blocks and not (np.abs(walls[:, 1]) < walls[:, 2] + numbers.clearance_m).any():
            return False
        length, width = scenario.start.sides(scenario.swarm.num_vehicles)
        side = width + scenario.start.gap_m / 2.0 + numbers.start_clear_m
        free = free_cells(sampled.discs, self._grid, numbers.clearance_m)
        reachable = reached(free, *self._grid.cell(sampled.length, 0.0))
        top, left = self._grid.cell(-length - numbers.start_clear_m, -side)
        bottom, right = self._grid.cell(numbers.start_clear_m, side)
        return bool(reachable[top : bottom + 1, left : right + 1].all())

    def _path_lengths(self, world: Int64, place: Float64, goal: Float64) -> Float64:
        """Length of the shortest path [m] from places to a goal each, north and east, shape (place, 2) both.

        ``world`` is the world of each place, shape (place,).
        """
        x, y = in_axes(place, self.memory.turn[world]).T
        row, column = self._grid.cell(x, y)
        r = np.clip(row + _AROUND[0], 0, self._grid.rows - 1)
        k = np.clip(column + _AROUND[1], 0, self._grid.columns - 1)
        off = np.hypot(x - (self._grid.x + r * CELL_M), y - (self._grid.y + k * CELL_M))
        best = np.minimum((self.memory.path_length[world, r, k] + off).min(axis=0), FAR_M)
        return np.maximum(best, np.hypot(*(place - goal).T))

    def _lengths_of(self, chosen: Bool) -> Float64:
        """Length of the paths of chosen vehicles (world, vehicle) to their goals [m], shape (vehicle,)."""
        world, goals = np.nonzero(chosen)[0], self.swarm.world_map.waypoints[:, 0, 1]
        return self._path_lengths(world, self.swarm.state.eta[chosen][:, :2], goals[world])

    def path_length_m(self) -> Float64:
        """Length of the shortest collision-free path of each vehicle to its goal [m], shape (world, vehicle)."""
        everyone = np.ones_like(self.swarm.state.alive)
        return self._lengths_of(everyone).reshape(everyone.shape)

    def observe(self, running: Bool) -> Terms:  # noqa: ARG002
        """The fields of the channel ``path``."""
        grid, path_cost, turn = self._grid, self.memory.path_cost, self.memory.turn[:, None]
        if not path_cost.size:
            return {}
        place = in_axes(self.swarm.state.eta[:, :, :2], turn)
        row, column = grid.cell(place[:, :, 0], place[:, :, 1])
        move_ahead(path_cost, row, column)
        ahead = np.stack([grid.x + row * CELL_M, grid.y + column * CELL_M], axis=2) - place
        return path_terms(self.swarm, in_axes(ahead, turn * [1.0, -1.0]), self.path_length_m())

    @classmethod
    def state_fields(cls, scenario: Scenario) -> FieldTable:
        """Also the length of each vehicle's path."""
        meaning = "per vehicle: length of the collision-free path to the goal"
        return *super().state_fields(scenario), PerceptField(
            "path_length", (scenario.swarm.num_vehicles,), LENGTH, meaning
        )

    def state(self) -> Terms:
        """The values of ``state_fields``."""
        return {**super().state(), "path_length": self.path_length_m()}

    def move(self, running: Bool) -> None:  # noqa: ARG002
        """Note the lengths of paths, from which the reward ``geodesic`` takes progress."""
        if self.reward_name == "geodesic":
            self._remaining_before_m = self.path_length_m()

    def remaining_m(self) -> tuple[Float64, Float64]:
        """With the reward ``geodesic`` the path's length, else the distance."""
        geodesic = self.reward_name == "geodesic"
        return (self.path_length_m(), self._remaining_before_m) if geodesic else super().remaining_m()

    def at_goal(self) -> Bool:
        """Vehicles within ``near_m`` of the goal, along the collision-free path."""
        near = self.swarm.facts.away <= self.numbers.near_m
        if near.any():
            near[near] = self._lengths_of(near) <= self.numbers.near_m
        return near

    def metrics(self, world: int) -> dict[str, float | None]:
        """Also the time ratio, and the index of the map's kind in ``KINDS``."""
        memory = self.memory
        took = memory.first_at_goal_s[world] > 0.0
        ratio = float((memory.first_at_goal_s[world] / memory.best_s[world])[took].mean()) if took.any() else None
        return {**super().metrics(world), "time_ratio": ratio, "kind": float(memory.kind[world])}
