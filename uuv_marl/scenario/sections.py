"""Mission and measurement of a scenario's swarm, as sections, in SI units and degrees."""

import math
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

from pydantic import Field

from uuv_marl.scenario.fields import ORDERED, Clock, NonNegative, Positive, Radius, Section, Signed, Speed, within
from uuv_marl.types import Float64

NOMINAL_VEHICLES = 54  # the paper's swarm; areas grow with sqrt(n / 54) above it, which keeps the density

Seconds = TypeVar("Seconds", float, Float64)  # a time or an array of times [s]
Legs = Annotated[int, within(1, 8)]
Discs = Annotated[int, within(0, 64)]
Point = tuple[float, float]  # north and east [m]


def growth(num_vehicles: int) -> float:
    """Factor on lengths that keeps the density of the paper's 54 vehicles in larger swarms."""
    return max(1.0, math.sqrt(num_vehicles / NOMINAL_VEHICLES))


class SwarmSize(Section):
    """Size of the swarm."""

    num_vehicles: Annotated[int, within(1, 16_384)]
    """Vehicles at the start."""


class Start(Section):
    """Two rectangles side by side behind the trajectory's first point, aligned with its first leg."""

    length_m: Positive
    """Side along the first leg, of each rectangle, for up to 54 vehicles."""
    width_m: Positive
    """Side across the first leg, of each rectangle, for up to 54 vehicles."""
    gap_m: NonNegative
    """Distance between the two rectangles."""
    spacing_m: Positive
    """Smallest distance between two vehicles at the start."""
    speed_min_mps: Speed
    """Lowest initial surge speed. Speeds and headings are uniform."""
    speed_max_mps: Speed
    """Highest initial surge speed."""

    def sides(self, num_vehicles: int) -> tuple[float, float]:
        """Length and width [m] of one rectangle for a swarm of this size."""
        scale = growth(num_vehicles)
        return self.length_m * scale, self.width_m * scale

    def lattice(self, num_vehicles: int) -> tuple[int, int, float]:
        """Columns, rows and row distance [m] of the hexagonal lattice at ``spacing_m`` in one rectangle."""
        length, width = self.sides(num_vehicles)
        row_m = self.spacing_m * math.sqrt(3) / 2
        columns = math.floor((width - self.spacing_m / 2) / self.spacing_m) + 1
        return max(columns, 1), math.floor(length / row_m) + 1, row_m

    def distance(self, num_vehicles: int, first: Point, second: Point, point: Point) -> float:
        """Distance [m] of a point from the rectangle around both start rectangles, 0 inside.

        ``first`` and ``second`` are the ends of the trajectory's first leg; all points are north and east [m].
        """
        length, width = self.sides(num_vehicles)
        leg = math.dist(first, second)
        ahead = ((second[0] - first[0]) / leg, (second[1] - first[1]) / leg)
        offset = (point[0] - first[0], point[1] - first[1])
        along = offset[0] * ahead[0] + offset[1] * ahead[1]
        across = abs(-offset[0] * ahead[1] + offset[1] * ahead[0])
        return math.hypot(max(along, -length - along, 0.0), max(across - width - self.gap_m / 2, 0.0))

    def _check(self) -> None:
        if self.speed_min_mps > self.speed_max_mps:
            raise ValueError(
                f"start.speed_min_mps must not exceed start.speed_max_mps = {self.speed_max_mps:g}, "
                f"got {self.speed_min_mps:g}"
            )


class Trajectory(Section):
    """The reference point l(t) (Eq. 5): constant speed along a polyline, then at rest."""

    speed_mps: Annotated[float, within(0.01, 100)]
    """Speed along the polyline."""
    waypoints_m: Annotated[tuple[tuple[Signed, Signed], ...], Field(min_length=2, max_length=1024)] | None = None
    """North and east of each corner; absent where ``random_field`` samples the corners."""

    @property
    def duration_s(self) -> float:
        """Time to the end of the fixed polyline."""
        points = self.waypoints_m or ()
        return sum(math.dist(a, b) for a, b in pairwise(points)) / self.speed_mps

    def _check(self) -> None:
        for k, (a, b) in enumerate(pairwise(self.waypoints_m or ())):
            if math.dist(a, b) < 1e-6:
                raise ValueError(f"trajectory.waypoints_m must differ from one to the next, got {list(a)} twice at {k}")


class Obstacle(Section):
    """A disc."""

    centre_m: tuple[Signed, Signed]
    """North and east of the centre."""
    radius_m: Radius
    """Radius."""


class RandomField(Section):
    """Distribution of trajectories and obstacles, sampled once per episode."""

    legs: Annotated[tuple[Legs, Legs], ORDERED]
    """Fewest and most legs."""
    leg_length_m: Annotated[tuple[Positive, Positive], ORDERED]
    """Shortest and longest leg."""
    turn_max_deg: Annotated[float, within(0, 150)]
    """Sharpest turn between legs."""
    obstacles: Annotated[tuple[Discs, Discs], ORDERED]
    """Fewest and most obstacles; a field too small for them has fewer."""
    radius_m: Annotated[tuple[Radius, Radius], ORDERED]
    """Smallest and largest radius."""
    offset_max_m: NonNegative
    """Largest distance of an obstacle's centre from the trajectory."""
    end_clear_m: Positive
    """Radius kept free around the end, for up to 54 vehicles."""


class Timing(Section):
    """Control step, integration step and decision period."""

    control_step_s: Clock
    """t_r: time for which body forces are constant."""
    integration_step_s: Clock
    """Runge-Kutta step, of which the control step is a multiple."""
    decision_period_s: Clock
    """Time between two decisions, a multiple of the control step; meanwhile the force is constant in the world
    frame."""
    fixed: bool
    """Whether decision period and inner loop (``actuators.yaw_damping_nms``) are the scenario's for every policy,
    instead of those that a policy requires."""

    @property
    def control_steps_per_decision(self) -> int:
        """Control steps in a decision period."""
        return round(self.decision_period_s / self.control_step_s)

    @property
    def integration_steps_per_control_step(self) -> int:
        """Integration steps in a control step."""
        return round(self.control_step_s / self.integration_step_s)

    def _check(self) -> None:
        for long, short in (("control_step_s", "integration_step_s"), ("decision_period_s", "control_step_s")):
            ratio = getattr(self, long) / getattr(self, short)
            if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-9 * ratio:
                raise ValueError(
                    f"timing.{long} must be a whole multiple of timing.{short} = {getattr(self, short):g}, "
                    f"got {getattr(self, long):g}; change either"
                )


class Constraints(Section):
    """The distances of Eq. 7."""

    s_l_m: Positive
    """Largest distance of a vehicle from l(t)."""
    s_o_m: Positive
    """Smallest distance from an obstacle's surface."""
    s_u_m: Positive
    """Smallest distance between vehicles."""


class Collision(Section):
    """Definition of a collision: two hulls, or a hull and an obstacle, overlap."""

    hull_radius_m: Positive
    """Vehicles collide when their centres are closer than twice this; with an obstacle at this surface distance."""
    ends_vehicle: bool
    """Whether a vehicle is lost by a collision."""
    stops: bool
    """Whether a hull stops at an obstacle or another hull, without velocity into it; if not, it passes through."""


class Arrival(Section):
    """End of the task: at rest at the trajectory's end, or in passage, for hulls that can't stop."""

    criterion: Literal["rest", "passage"] = "rest"
    """In passage l(t) continues along the last leg beyond the end. The swarm has arrived once l(t) and the swarm's
    centre have crossed the line through the end across that leg, with every vehicle within ``spread_m`` of the centre's
    position along the leg. ``radius_m`` and ``dwell_s`` then have no effect."""
    radius_m: Positive
    """At rest: largest distance of the swarm's centre from the end of the trajectory, where l(t) rests."""
    dwell_s: Annotated[float, within(0, 3_600)]
    """At rest: time for which the swarm's centre stays within ``radius_m``."""
    spread_m: Positive
    """Largest distance of every vehicle from the end, for up to 54 vehicles."""
    ends_episode: bool
    """Whether an episode ends when the swarm arrives; if not, it runs to its time limit."""


class TimeLimit(Section):
    """The time limit of an episode: ``factor`` times the trajectory's duration, plus ``extra_s``."""

    factor: Annotated[float, within(0.001, 1_000)]
    """Factor of the trajectory's duration."""
    extra_s: NonNegative
    """Time added to it."""

    def of(self, duration_s: Seconds) -> Seconds:
        """Time limit [s] for trajectories of this duration [s], a number or an array."""
        return self.factor * duration_s + self.extra_s


class Losses(Section):
    """Losses of vehicles at set times."""

    times_s: Annotated[tuple[NonNegative, ...], Field(max_length=16384)]
    """At each of these times a random vehicle is lost."""

    def _check(self) -> None:
        if list(self.times_s) != sorted(self.times_s):
            raise ValueError(f"losses.times_s must not fall, got {list(self.times_s)}; sort them")


class Reward(Section):
    """Weights of the terms of ``follow`` and ``reach`` (``tasks/``)."""

    tracking: NonNegative
    obstacle: NonNegative
    spacing: NonNegative
    effort: NonNegative
    collision: NonNegative
    arrival: NonNegative
    progress_m: Positive
    """Progress towards the reference that is rewarded with 1, in the dense reward."""
    progress_far_m: Positive
    """Distance from the reference beyond which progress is not rewarded, in the dense reward."""
