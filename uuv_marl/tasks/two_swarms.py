"""``two_swarms``: two groups swap sides through the single gap of a wall, sampled by seed."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.errors import ScenarioError
from uuv_marl.percept import FLAG, FieldTable, PerceptField
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.fields import NonNegative, Positive
from uuv_marl.scenario.vehicle_checks import top_speed
from uuv_marl.sim.episode_setup import EpisodeSetup, start_state
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.tasks.maps.guidance import AHEAD_M, PATH_FIELDS, in_axes, path_terms
from uuv_marl.tasks.maps.walls import INTO_BANK_M, Range, banks, between, joined, wall
from uuv_marl.tasks.reach import Reach, ReachNumbers
from uuv_marl.tasks.reward import Terms
from uuv_marl.types import Bool, Float64, Int64

_BEFORE_M = 5.0
"""Distance from the wall's surface at which a path turns to the gap [m]."""
_RIGHT_OF_WAY = PerceptField(
    "right_of_way", (1,), FLAG, "1 if the group that goes first has passed, or for its vehicles; else 0"
)


def _through(place: Float64, goal: Float64, at: Float64 | float) -> Float64:
    """Length of the path through the gap [m] in the map's frame; places and goals (..., 2)."""
    return sum((np.hypot(end[..., 0], end[..., 1] - at) for end in (place, goal)), np.zeros(place.shape[:-1]))


class TwoSwarmsNumbers(ReachNumbers):
    """Numbers of ``two_swarms``; the scenario's file has their sources."""

    apart_m: Positive
    """Distance from the middle of each group to the wall."""
    aside_m: NonNegative
    """Largest offset of each group along the wall."""
    gap_m: Range
    """Width of the gap."""
    gap_aside_m: NonNegative
    """Largest offset of the gap from the middle of the wall."""
    radius_m: Positive
    """Radius of the wall's discs."""
    half_width_m: Positive
    """Distance from the middle to the bank at each side."""
    behind_m: Positive
    """Distance from the middle of each group to the bank behind it."""
    bank_radius_m: Positive
    """Radius of the banks' discs."""

    def _check(self) -> None:
        if (least := self.gap_aside_m + self.gap_m[1] / 2 + self.radius_m) > self.half_width_m:
            raise ValueError(
                "task.gap_m and task.gap_aside_m must leave a wall on both sides within task.half_width_m = "
                f"{self.half_width_m:g}, got {least:g} for it"
            )

    def discs(self, gap: float, at: float) -> Float64:
        """Wall and banks around the wall's middle: x ahead, y along the wall and radius [m], shape (disc, 3)."""
        end, beyond, radius = self.half_width_m + INTO_BANK_M, self.apart_m + self.behind_m, self.radius_m
        left, right = at - gap / 2 - radius, at + gap / 2 + radius
        sides = (wall((0.0, left), (0.0, -end), radius), wall((0.0, right), (0.0, end), radius))
        return joined(*sides, banks(0.0, self.half_width_m, beyond, beyond, self.bank_radius_m))


class TwoSwarmsMemory(NamedTuple):
    """Memory of ``two_swarms``."""

    first_at_goal_s: Annotated[Float64, "world vehicle", "When the vehicle was first at its goal [s]; 0 before."]
    best_s: Annotated[Float64, "world vehicle", "Its path through the gap's middle over full speed [s]."]
    side: Annotated[Float64, "world vehicle", "1 for vehicles that go along the frame's x, -1 for the others."]
    turn: Annotated[Float64, "world 2", "Cosine and sine of the angle by which the map is turned."]
    gap: Annotated[Float64, "world", "Position of the gap's middle along the wall [m]."]


class TwoSwarms(Reach):
    """Two groups swap sides through the single gap of a wall, each vehicle to its own goal, without a collision.

    Every vehicle has a group of its own for its goal: its start, moved across the wall.
    """

    Numbers = TwoSwarmsNumbers
    Memory: ClassVar[type[Any] | None] = TwoSwarmsMemory
    channels: ClassVar[Mapping[str, FieldTable]] = {"path": (*PATH_FIELDS, _RIGHT_OF_WAY)}
    columns: ClassVar[Mapping[str, str]] = {
        "time_ratio": "mean over vehicles that reached their goals: time over that of the path at full speed [1]",
        "swarm_time_ratio": "the same of the last vehicle, if all reached their goals [1]",
    }
    traffic: ClassVar[bool] = False
    mark_label: ClassVar[str] = "goal tolerance"
    reference_policy: ClassVar[str] = "tangent_bug"

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        numbers, (length, width) = self.numbers, swarm.scenario.start.sides(swarm.num_vehicles)
        hull = swarm.scenario.collision.hull_radius_m
        if numbers.gap_m[0] <= 2.0 * hull:
            raise ScenarioError(
                f"task.gap_m must be above {2.0 * hull:g}, twice collision.hull_radius_m, got {list(numbers.gap_m)}; "
                "widen it"
            )
        if numbers.apart_m < (least := 0.5 * length + numbers.radius_m + hull):
            raise ScenarioError(
                f"task.apart_m must be at least {least:g}, so that groups {length:g} m long start before the wall, "
                f"got {numbers.apart_m:g}; raise it, or shrink start"
            )
        if length / 2 > numbers.behind_m or width / 2 + numbers.aside_m > numbers.half_width_m:
            raise ScenarioError(
                f"the groups must start within the banks of task 'two_swarms': {length:g} x {width:g} m each, moved by "
                f"task.aside_m = {numbers.aside_m:g}; raise task.half_width_m and task.behind_m, or shrink start"
            )

    @classmethod
    def sizes(cls, scenario: Scenario) -> Mapping[str, int]:
        """A group per vehicle, and the discs of a map."""
        numbers = scenario.task_numbers
        most = len(numbers.discs(numbers.gap_m[0], 0.0)) + 2
        return {"group": scenario.swarm.num_vehicles, "point": 2, "obstacle": most}

    @classmethod
    def longest_s(cls, scenario: Scenario) -> float:
        """The time between the groups' middles at full speed, for all maps."""
        return 2.0 * scenario.task_numbers.apart_m / top_speed(scenario.vehicle, scenario.actuators)

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        """A wall with a gap and a group of the scenario's start on each side, turned at random."""
        numbers, scenario, memory = self.numbers, self.swarm.scenario, self.memory
        gap, at = between(rng, numbers.gap_m), numbers.gap_aside_m * rng.uniform(-1.0, 1.0)
        c, s = cos_sin(rng.uniform(-math.pi, math.pi))
        back, discs = np.array([c, -s]), numbers.discs(gap, at)
        place, eta, nu = self._start(rng, side := memory.side[world])
        goal = place + 2.0 * numbers.apart_m * side[:, None] * [1.0, 0.0]
        memory.best_s[world] = _through(place, goal, at) / top_speed(scenario.vehicle, scenario.actuators)
        memory.turn[world], memory.gap[world] = (c, s), at
        discs[:, :2], eta[:, :2], n = in_axes(discs[:, :2], back), in_axes(place, back), len(eta)
        return EpisodeSetup(
            tuple(np.stack([eta[:, :2], in_axes(goal, back)], axis=1)), (np.zeros(2),) * n, discs, eta, nu,
            group=np.arange(n), informed=np.ones(n, np.bool_), duration_s=self.longest_s(scenario),
        )  # fmt: skip

    def _start(self, rng: np.random.Generator, side: Float64) -> tuple[Float64, Float64, Float64]:
        """Positions in the map's own frame [m], shape (vehicle, 2), poses and velocities; ``side`` is filled.

        In the scenario's start both groups are side by side; the one to starboard is moved across the wall.
        """
        numbers, scenario = self.numbers, self.swarm.scenario
        eta, nu = start_state(scenario, np.array([[0.0, 0.0], [1.0, 0.0]]), rng)
        length, width = scenario.start.sides(len(eta))
        side[:] = np.where(np.arange(len(eta)) < (len(eta) + 1) // 2, 1.0, -1.0)
        aside = np.where(side > 0.0, *rng.uniform(-numbers.aside_m, numbers.aside_m, 2))
        along = side * (eta[:, 0] + length / 2 - numbers.apart_m)
        return np.stack([along, eta[:, 1] + side * (scenario.start.gap_m + width) / 2 + aside], axis=1), eta, nu

    def observe(self, running: Bool) -> Terms:  # noqa: ARG002
        """The fields of the channel ``path``: through the gap's middle, the port group first."""
        swarm, side = self.swarm, self.memory.side
        if "path" not in swarm.scenario.sonar.channels:
            return {}
        turn, at = self.memory.turn[:, None], self.memory.gap[:, None]
        place, goal = in_axes(swarm.state.eta[:, :, :2], turn), in_axes(swarm.world_map.waypoints[:, :, 1], turn)
        along, edge = place[:, :, 0] * side, self.numbers.radius_m + _BEFORE_M
        point = np.stack([side * np.maximum(along + AHEAD_M, -edge), np.broadcast_to(at, side.shape)], axis=2)
        point = np.where((along + AHEAD_M > edge)[:, :, None], goal, point)
        to_come = (side > 0.0) & swarm.state.alive & ~swarm.state.collided & (along < edge)
        first = (side > 0.0) | ~to_come.any(axis=1, keepdims=True)
        length = np.where(along < 0.0, _through(place, goal, at), swarm.facts.away)
        terms = path_terms(swarm, in_axes(point - place, turn * [1.0, -1.0]), length)
        return {**terms, "right_of_way": first[:, :, None].astype(np.float64)}

    def metrics(self, world: int) -> dict[str, float | None]:
        """Also the columns."""
        took, best = self.memory.first_at_goal_s[world], self.memory.best_s[world]
        arrived = took > 0.0
        ratio = float((took / best)[arrived].mean()) if arrived.any() else None
        return {
            **super().metrics(world), "time_ratio": ratio,
            "swarm_time_ratio": float(took.max() / best.max()) if arrived.all() else None,
        }  # fmt: skip

    def teams(self, world: int) -> Int64:
        """The two groups."""
        return (self.memory.side[world] < 0.0).astype(np.int64)

    def marks(self, world: int) -> NDArray[np.floating[Any]]:
        """The goals."""
        goals = self.swarm.world_map.waypoints[world, :, 1]
        return np.column_stack([goals, np.full(len(goals), self.numbers.near_m)])
