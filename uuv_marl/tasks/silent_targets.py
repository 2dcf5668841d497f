"""``silent_targets``: find silent targets that move in a box by their echoes, and stay near them."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from uuv_marl.errors import ScenarioError
from uuv_marl.percept import ANGLE, DIRECTION, LENGTH, SPEED, FieldTable, PerceptField
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.fields import Positive, Section, within
from uuv_marl.scenario.vehicle_checks import top_speed
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.episode_setup import EpisodeSetup, start_state
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.tasks.maps.guidance import PATH_FIELDS, path_terms
from uuv_marl.tasks.maps.walls import Range, Span, between
from uuv_marl.tasks.reach import Reach
from uuv_marl.tasks.reward import Terms
from uuv_marl.tasks.search import FORGET_S, cover, fans, num_cells
from uuv_marl.tasks.unsearched import NUM_OCTANTS, RINGS_M, UNSEARCHED, num_plots, update_map
from uuv_marl.types import Bool, Float64, Int64

_SEARCH_SHARE = 0.3
"""Reward where the swarm covers the box once, over that for a target held all the time [1]. Assumed."""
LEAD_S = 2.0
"""The channel ``path`` leads to where a target will be after this time [s]. Assumed, tried by hand with ``oracle``."""


class SilentTargetsNumbers(Section):
    """Numbers of ``silent_targets``; the scenario's file has their sources."""

    targets: Annotated[int, within(1, 1024)]
    """Number of targets."""
    side_m: Positive
    """Side of the square box in which they stay."""
    speed_share: Range
    """Speed of a target, as a share of a vehicle's at full force."""
    turn_s: Span
    """Time between two of a target's turns, each by any angle."""
    turn_dps: Positive
    """Rate of their turns [deg/s]."""
    held_m: Positive
    """A target is held while a vehicle is within this distance."""
    clear_m: Positive
    """Least distance of a target's start from the middle of the box, where the vehicles start."""

    def _check(self) -> None:
        if self.speed_share[1] > 1.0:
            raise ValueError(
                "task.speed_share must be at most 1, the vehicles' full speed, so that a target can be held, got "
                f"{list(self.speed_share)}; lower it"
            )
        if self.clear_m > 0.5 * self.side_m:
            raise ValueError(
                f"task.clear_m must be at most half of task.side_m = {self.side_m:g}, got {self.clear_m:g}; "
                "lower it, or widen the box"
            )


class SilentTargetsMemory(NamedTuple):
    """Memory of ``silent_targets``."""

    first_at_goal_s: Annotated[Float64, "world vehicle", "When the vehicle first held a target [s]; 0 before."]
    remaining_m: Annotated[
        Float64, "world vehicle", "Distance to the nearest target that no nearer vehicle holds, or 0 [m]."
    ]
    remaining_before_m: Annotated[Float64, "world vehicle", "The same before the step."]
    speed: Annotated[Float64, "world target", "Speed of the target [m/s]."]
    heading: Annotated[Float64, "world target", "Its direction, clockwise from north [rad]."]
    to_turn: Annotated[Float64, "world target", "Remaining angle of its turn, clockwise [rad]."]
    turn_at: Annotated[Float64, "world target turn", "Start of the turn [s]."]
    turn_by: Annotated[Float64, "world target turn", "Angle of the turn [rad]."]
    turns: Annotated[Int64, "world target", "Turns that it has begun."]
    found_s: Annotated[Float64, "world target", "When the target was first held [s]; infinite before."]
    held: Annotated[Float64, "world target", "Decisions of the last half at which it was held."]
    judged: Annotated[Float64, "world", "Decisions of the last half."]
    covered_s: Annotated[Float64, "world cell", "When an array last covered the cell, for the reward ``search`` [s]."]
    newly_covered: Annotated[Float64, "world vehicle", "Number of cells that the vehicle covered in the latest step."]
    searched_s: Annotated[
        Float64, "world vehicle plot", "When the vehicle last noted a search there, ``unsearched`` [s]."
    ]


@compiled
def walk(
    worlds: Bool, time_s: Float64, period: float, half: float, rate: float, places: Float64,
    memory: SilentTargetsMemory, velocity: Float64,
) -> None:  # fmt: skip
    """Fill the targets' velocities for the coming step; one that would leave the box is reflected.

    ``worlds`` are stepped, ``time_s`` is since the reset, shape (world,) both; ``period`` of a step [s], ``half`` of
    the box's side [m], turn ``rate`` [rad/s]; ``places`` [m] and ``velocity`` [m/s], north and east, shape (world,
    target, at least 2); ``memory`` is changed.
    """
    for w in range(memory.speed.shape[0]):
        for k in range(memory.speed.shape[1] if worlds[w] else 0):
            begun = memory.turns[w, k]
            while begun < memory.turn_at.shape[2] and memory.turn_at[w, k, begun] <= time_s[w]:
                memory.to_turn[w, k] = memory.turn_by[w, k, begun]
                begun += 1
            memory.turns[w, k] = begun
            turn = min(max(memory.to_turn[w, k], -rate * period), rate * period)
            memory.to_turn[w, k] -= turn
            memory.heading[w, k] += turn
            c, s = cos_sin(memory.heading[w, k])
            distance = memory.speed[w, k] * period
            if abs(places[w, k, 0] + distance * c) > half:
                c, memory.heading[w, k] = -c, math.pi - memory.heading[w, k]
                memory.to_turn[w, k] = -memory.to_turn[w, k]
            if abs(places[w, k, 1] + distance * s) > half:
                s, memory.heading[w, k], memory.to_turn[w, k] = -s, -memory.heading[w, k], -memory.to_turn[w, k]
            velocity[w, k, 0], velocity[w, k, 1] = memory.speed[w, k] * c, memory.speed[w, k] * s


_DENSE = {
    **{name: formula for name, formula in Reach.rewards["dense"].items() if name != "stay"},
    "progress": "Phi now - Phi before, Phi = -min(d, D)/c; d: distance to the nearest target that no "
    "nearer vehicle holds, 0 if there is none, D: progress_far_m, c: progress_m",
    "held": "+w_arrival · dt/T for each target that is held, to the vehicle nearest to it; T: the time limit",
}


class SilentTargets(Reach):
    """Find targets that move in a box and return only echoes, and stay within ``held_m`` of them.

    All obstacles are targets, as large as a vehicle's hull, so that every echo is a target's. The reference is the
    middle of the box, at rest. A vehicle succeeds if it stays collision-free.
    """

    Numbers = SilentTargetsNumbers
    Memory: ClassVar[type[Any] | None] = SilentTargetsMemory
    observed: ClassVar[FieldTable] = (
        PerceptField("box", (2,), DIRECTION, "cosine and sine of the compass heading from the box's first axis"),
    )
    channels: ClassVar[Mapping[str, FieldTable]] = {"path": PATH_FIELDS, "unsearched": UNSEARCHED}
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {"dense": _DENSE, "search": {
        **_DENSE,
        "search": f"+{_SEARCH_SHARE:g} · w_arrival · n for the share of the box that the vehicle's arrays cover; "
        f"n: number of vehicles; what was covered t before counts min(t, {FORGET_S:g} s) / {FORGET_S:g} s",
    }}  # fmt: skip
    traffic: ClassVar[bool] = False
    has_goal: ClassVar[bool] = False
    reference_label: ClassVar[str] = "centre of the box"
    mark_label: ClassVar[str] = "range in which a target is held"
    headline: ClassVar[str] = "held_share"
    columns: ClassVar[Mapping[str, str]] = {
        "held_share": "share of the last half of the episode in which targets are held, mean over targets [1]",
        "found_share": "share of the targets that were ever held [1]",
        "found_s": "mean over targets of the time until they were held, the time limit if never [s]",
    }
    reference_policy: ClassVar[str] = "nearest_target"

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        self._fans = fans(swarm.scenario)
        length, width = swarm.scenario.start.sides(swarm.num_vehicles)
        if math.hypot(0.5 * length, width + 0.5 * swarm.scenario.start.gap_m) > self.numbers.clear_m:
            raise ScenarioError(
                f"task.clear_m must hold the start, two times {length:g} x {width:g} m, got {self.numbers.clear_m:g}; "
                "raise it, or shrink start"
            )

    @classmethod
    def sizes(cls, scenario: Scenario) -> Mapping[str, int]:
        """An obstacle per target, and all turns of an episode."""
        numbers, limit = scenario.task_numbers, scenario.time_limit.of(cls.longest_s(scenario))
        turns = math.ceil(limit / numbers.turn_s[0])
        plots = num_plots(numbers.side_m) if "unsearched" in scenario.sonar.channels else 0
        return {"point": 2, "obstacle": numbers.targets, "target": numbers.targets, "turn": turns,
                "cell": num_cells(numbers.side_m), "plot": plots}  # fmt: skip

    @classmethod
    def longest_s(cls, scenario: Scenario) -> float:
        """The time along the box's side at full speed."""
        return scenario.task_numbers.side_m / top_speed(scenario.vehicle, scenario.actuators)

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        """The scenario's start in the middle of the box, targets around it, and all their turns."""
        numbers, scenario, memory = self.numbers, self.swarm.scenario, self.memory
        length, _ = scenario.start.sides(self.swarm.num_vehicles)
        eta, nu = start_state(scenario, np.array([[0.5 * length, 0.0], [length, 0.0]]), rng)
        (m, turns), n, full = memory.turn_at.shape[1:], len(eta), top_speed(scenario.vehicle, scenario.actuators)
        discs = np.full((m, 3), scenario.collision.hull_radius_m)
        discs[:, :2] = [self._place(rng) for _ in range(m)]
        memory.speed[world] = [full * between(rng, numbers.speed_share) for _ in range(m)]
        memory.heading[world] = rng.uniform(-math.pi, math.pi, m)
        spans = np.array([[between(rng, numbers.turn_s) for _ in range(turns)] for _ in range(m)])
        memory.turn_at[world] = np.cumsum(spans, axis=1)
        memory.turn_by[world] = rng.uniform(-math.pi, math.pi, (m, turns))
        memory.found_s[world] = math.inf
        memory.covered_s[world] = -FORGET_S
        memory.searched_s[world] = -math.inf
        middle = np.array([[-1.0, 0.0], [0.0, 0.0]])
        return EpisodeSetup(
            (middle,), (np.zeros(2),), discs, eta, nu, group=np.zeros(n, np.int64), informed=np.ones(n, np.bool_),
            duration_s=self.longest_s(scenario),
        )  # fmt: skip

    def _place(self, rng: np.random.Generator) -> Float64:
        """A target's start."""
        half, clear = 0.5 * self.numbers.side_m, self.numbers.clear_m
        while True:
            place = rng.uniform(-half, half, 2)
            if place[0] * place[0] + place[1] * place[1] > clear * clear:
                return place

    def begin(self, world: int) -> None:
        """Note the distances to targets."""
        self.memory.remaining_m[world] = self._remaining_m()[world]

    def move(self, running: Bool) -> None:
        """Set the targets' velocities."""
        numbers, world_map = self.numbers, self.swarm.world_map
        walk(
            running, self.swarm.facts.time_s, self.swarm.scenario.timing.decision_period_s, 0.5 * numbers.side_m,
            math.radians(numbers.turn_dps), world_map.obstacles, self.memory, world_map.obstacle_velocity,
        )  # fmt: skip

    def away(self) -> Float64:
        """Distance of every vehicle from every target [m], infinite if lost; shape (world, vehicle, target)."""
        state, targets = self.swarm.state, self.swarm.world_map.obstacles
        x, y = np.moveaxis(targets[:, None, :, :2] - state.eta[:, :, None, :2], -1, 0)
        return np.where(state.alive[:, :, None], np.sqrt(x * x + y * y), math.inf)

    def _remaining_m(self) -> Float64:
        """Distance to the nearest target that no vehicle nearer to it holds [m], 0 where there is none."""
        away, nearest = self._nearest()
        left = np.where((nearest <= self.numbers.held_m) & (nearest < away), math.inf, away).min(axis=2)
        return np.where(np.isfinite(left), left, 0.0)

    def _nearest(self) -> tuple[Float64, Float64]:
        """``away``, and of each target the distance of the vehicle nearest to it [m], shape (world, 1, target)."""
        away = self.away()
        return away, away.min(axis=1, keepdims=True)

    def at_goal(self) -> Bool:
        """Vehicles that hold a target."""
        return self.away().min(axis=2) <= self.numbers.held_m

    def update(self, running: Bool) -> None:
        """Note which targets are held, and the distances to the others."""
        super().update(running)
        memory, time_s, held = self.memory, self.swarm.facts.time_s, self._nearest()[1][:, 0] <= self.numbers.held_m
        late = running & (time_s > 0.5 * self.swarm.time_limit_s)
        memory.held[late] += held[late]
        memory.judged[late] += 1.0
        found = running[:, None] & held
        memory.found_s[found] = np.minimum(memory.found_s, time_s[:, None])[found]
        memory.remaining_before_m[running] = memory.remaining_m[running]
        memory.remaining_m[running] = self._remaining_m()[running]
        if "search" in self.terms:
            half, state = 0.5 * self.numbers.side_m, self.swarm.state
            cover(running, time_s, half, self._fans, state.eta, state.alive, memory.covered_s, memory.newly_covered)

    def observe(self, running: Bool) -> Terms:
        """The heading in the box, and the fields of the channels.

        For ``path`` targets are assigned so that the sum of all paths is smallest; a path leads to the target's
        position soon.
        """
        swarm, fields = self.swarm, {"box": self.swarm.compass}
        if "unsearched" in swarm.scenario.sonar.channels:
            fields["unsearched"] = self._unsearched(running)
        if "path" not in swarm.scenario.sonar.channels:
            return fields
        world_map, away = swarm.world_map, self.away()
        path = np.zeros((*away.shape[:2], 2))
        soon = world_map.obstacles[:, :, :2] + LEAD_S * world_map.obstacle_velocity
        for w in range(len(away)):
            vehicle, target = linear_sum_assignment(np.minimum(away[w], 1e9))
            path[w, vehicle] = soon[w, target] - swarm.state.eta[w, vehicle, :2]
        return {**fields, **path_terms(swarm, path, np.sqrt((path * path).sum(axis=2)))}

    def _unsearched(self, running: Bool) -> Float64:
        """The field of the channel ``unsearched``, after the latest percept is in each vehicle's map."""
        see, compass = self.swarm.percept, self.swarm.compass
        shares = np.zeros((*compass.shape[:2], len(RINGS_M), NUM_OCTANTS))
        update_map(
            running, self.swarm.facts.time_s, 0.5 * self.numbers.side_m, self._fans, see["reference"], compass,
            see["detected"], see["neighbour"], self.memory.searched_s, shares,
        )  # fmt: skip
        return shares

    @classmethod
    def state_fields(cls, scenario: Scenario) -> FieldTable:
        """Also the targets' motion, and the distances from which progress is counted."""
        n, m = scenario.swarm.num_vehicles, scenario.task_numbers.targets
        return (
            *super().state_fields(scenario),
            PerceptField("remaining", (n,), LENGTH, "per vehicle: distance to a target that no nearer one holds, or 0"),
            PerceptField("target_velocity", (m, 2), SPEED, "per target: its velocity, north and east"),
            PerceptField("target_turn", (m,), ANGLE, "per target: what is left of its turn, clockwise"),
        )

    def state(self) -> Terms:
        """The values of ``state_fields``."""
        memory = self.memory
        velocity = memory.speed[:, :, None] * np.stack([np.cos(memory.heading), np.sin(memory.heading)], axis=2)
        own = {"remaining": memory.remaining_m, "target_velocity": velocity, "target_turn": memory.to_turn}
        return {**super().state(), **own}

    def reward(self, running: Bool) -> Terms:
        """Progress and costs of ``reach``, the term ``held`` in place of ``stay``, and in ``search`` that term."""
        share = self.swarm.scenario.timing.decision_period_s / self.swarm.time_limit_s
        away, nearest = self._nearest()
        num_held = ((away == nearest) & (nearest <= self.numbers.held_m)).sum(axis=2)
        terms = {**super().reward(running), "held": self._weight.arrival * share[:, None] * num_held}
        if "search" not in self.terms:
            return terms
        cells = self.memory.covered_s.shape[1] / self.swarm.num_vehicles
        return {**terms, "search": _SEARCH_SHARE * self._weight.arrival * self.memory.newly_covered / cells}

    def remaining_m(self) -> tuple[Float64, Float64]:
        """Distance to the nearest target that no nearer vehicle holds, now and before the step [m]."""
        return self.memory.remaining_m, self.memory.remaining_before_m

    def done(self) -> Bool:
        """No world: the time limit ends the episode."""
        return np.zeros(self.swarm.num_worlds, np.bool_)

    def succeeded(self) -> Bool:
        """Vehicles that are alive and collision-free."""
        return self.swarm.state.alive & ~self.swarm.state.collided

    def success(self, world: int, vehicle: int | None = None) -> bool:
        """Whether a vehicle is collision-free; with None, whether every target was held for all of the last half."""
        return self.held_share(world) == 1.0 if vehicle is None else super().success(world, vehicle)

    def held_share(self, world: int) -> float:
        """Share of the last half so far in which targets were held; 0 before."""
        return float(self.memory.held[world].mean() / max(self.memory.judged[world], 1.0))

    def metrics(self, world: int) -> dict[str, float | None]:
        """Also the columns; ``swarm_success`` is 1 if every target was held for all of the last half."""
        found, share = self.memory.found_s[world], self.held_share(world)
        return {
            **super().metrics(world), "swarm_success": float(share == 1.0), "held_share": share,
            "found_share": float(np.isfinite(found).mean()),
            "found_s": float(np.minimum(found, self.swarm.time_limit_s[world]).mean()),
        }  # fmt: skip

    def marks(self, world: int) -> NDArray[np.floating[Any]]:
        """Circles in which targets are held."""
        targets = self.swarm.world_map.obstacles[world, :, :2]
        return np.column_stack([targets, np.full(len(targets), self.numbers.held_m)])
