"""The sections of a scenario: their fields with ranges, and what the fields of one section demand of each other.

In SI units and degrees. Symbols of the vehicle are Fossen's; resistances (X_u, Y_v, ...) are positive, as in the
paper's Eq. 4.
"""

import math
from itertools import pairwise
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

MAX_RANGE_M = 4096.0
"""Positions in a percept saturate here, so that observation bounds are finite."""
NOMINAL_VEHICLES = 54
"""The paper's swarm; areas grow with sqrt(n / 54) above it, so that the density stays."""
MIN_SECTOR_DEG, MAX_SECTOR_DEG = 0.01, 120.0
"""Widths of sub-sectors that the sonar's table of directions is made for."""


def within(low: float, high: float) -> AfterValidator:
    """The range in which a number is plausible, both ends included."""

    def check(value: float) -> float:
        if not low <= value <= high:
            limits = {"low": f"{low:,.9g}", "high": f"{high:,.9g}"}
            raise PydanticCustomError("range", "must lie within {low} to {high}", limits)
        return value

    return AfterValidator(check)


Signed = Annotated[float, within(-1_000_000, 1_000_000)]
Positive = Annotated[float, within(0.001, 1_000_000)]
NonNegative = Annotated[float, within(0, 1_000_000)]
NonPositive = Annotated[float, within(-1_000_000, 0)]
Speed = Annotated[float, within(0, 100)]
Radius = Annotated[float, within(0.001, MAX_RANGE_M)]
Seconds = TypeVar("Seconds", float, NDArray[np.float64])
"""A time or an array of times [s]."""
Clock = Annotated[float, within(0.0001, 3_600)]
Lag = Annotated[float, within(0, 3_600)]
Legs = Annotated[int, within(1, 8)]
Discs = Annotated[int, within(0, 64)]
Channel = Literal["compass", "link", "current", "age", "ranged", "modem"]
Point = tuple[float, float]
"""North and east [m]."""


def growth(num_vehicles: int) -> float:
    """Factor on lengths that keeps the density of the paper's 54 vehicles in larger swarms."""
    return max(1.0, math.sqrt(num_vehicles / NOMINAL_VEHICLES))


Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=100)]


class Section(BaseModel):
    """A part of a scenario: immutable, no unknown fields, no silent conversion."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, use_attribute_docstrings=True)

    @model_validator(mode="after")
    def _checked(self) -> Self:
        self._check()
        return self

    def _check(self) -> None:
        """Raise ValueError where one field contradicts another."""


class Swarm(Section):
    """How many."""

    num_vehicles: Annotated[int, within(1, 16_384)]
    """Vehicles at the start."""


class Start(Section):
    """Two rectangles side by side behind the trajectory's first point, aligned with its first leg."""

    length_m: Positive
    """Side along the first leg, of each rectangle, for up to 54 vehicles."""
    width_m: Positive
    """Side across the first leg."""
    gap_m: NonNegative
    """Between the two."""
    spacing_m: Positive
    """Smallest distance between two vehicles at the start."""
    speed_min_mps: Speed
    """Lowest initial surge speed; uniform, with uniform heading."""
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

        Args:
            num_vehicles: size of the swarm, which the rectangles grow with.
            first: start of the trajectory's first leg, north and east [m].
            second: end of that leg, north and east [m].
            point: the point, north and east [m].
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
    """North and east of each corner; absent where ``random_field`` draws them."""

    @property
    def duration_s(self) -> float:
        """Time to the end of the fixed polyline; the bound on any task time."""
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
    """Distribution of trajectories and obstacles, one draw per episode."""

    legs: tuple[Legs, Legs]
    """Fewest and most legs."""
    leg_length_m: tuple[Positive, Positive]
    """Shortest and longest leg."""
    turn_max_deg: Annotated[float, within(0, 150)]
    """Sharpest turn between legs."""
    obstacles: tuple[Discs, Discs]
    """Fewest and most obstacles wished for; where the field is full there are fewer."""
    radius_m: tuple[Radius, Radius]
    """Smallest and largest radius."""
    offset_max_m: NonNegative
    """Largest distance of an obstacle's centre from the trajectory."""
    end_clear_m: Positive
    """Radius kept free around the end, for up to 54 vehicles."""

    def _check(self) -> None:
        for name in ("legs", "leg_length_m", "obstacles", "radius_m"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"random_field.{name} must be [low, high] with low <= high, got [{low}, {high}]")


class Vehicle(Section):
    """Parameters of Eq. 3-4. Dimensions follow from the force or moment and the velocities they multiply."""

    name: Name
    """The file in ``vehicles/`` that the numbers come from, where nothing overrides them."""
    m_kg: Positive
    I_z_kgm2: Positive
    x_G_m: Annotated[float, within(-100, 100)]
    X_udot_kg: NonPositive
    Y_vdot_kg: NonPositive
    Y_rdot_kgm: Signed
    N_rdot_kgm2: NonPositive
    X_u: NonNegative
    Y_v: NonNegative
    Y_r: Signed
    N_v: Signed
    N_r: NonNegative
    X_uu: NonNegative
    Y_vv: NonNegative
    Y_rr: Signed
    N_rv: Signed
    N_rr: NonNegative

    @property
    def inertia(self) -> tuple[float, float, float, float]:
        """Entries m_11 [kg], m_22 [kg], m_23 [kg m] and m_33 [kg m2] of Eq. 2's matrix M, added mass included."""
        return (
            self.m_kg - self.X_udot_kg,
            self.m_kg - self.Y_vdot_kg,
            self.m_kg * self.x_G_m - self.Y_rdot_kgm,
            self.I_z_kgm2 - self.N_rdot_kgm2,
        )

    def times(self, mass: float, added_mass: float, drag: float) -> "Vehicle":
        """A vehicle whose mass (and moment of inertia), added masses and resistances are times these factors."""
        factors = dict.fromkeys(("m_kg", "I_z_kgm2"), mass)
        factors |= dict.fromkeys(("X_udot_kg", "Y_vdot_kg", "Y_rdot_kgm", "N_rdot_kgm2"), added_mass)
        factors |= dict.fromkeys(("X_u", "Y_v", "Y_r", "N_v", "N_r", "X_uu", "Y_vv", "Y_rr", "N_rv", "N_rr"), drag)
        return self.model_copy(update={name: factor * getattr(self, name) for name, factor in factors.items()})


class Actuators(Section):
    """Limits of thrust and torque, the same for every policy."""

    max_force_n: Positive
    """Surge force at full action, ahead or astern."""
    max_torque_nm: Positive
    """Yaw torque at full action."""
    lever_arm_m: Annotated[float, within(0.001, 1_000)]
    """Turns the sideways component of a desired force into a torque (Eq. 22)."""
    yaw_damping_nms: NonNegative
    """Inner loop: torque -c r, added within the torque limit."""
    thrust_lag_s: Lag
    """Time constant with which thrust follows what is asked; 0: at once."""
    yaw_lag_s: Lag
    """The same of the torque."""
    yaw_authority: Annotated[float, within(0, 1)]
    """Share of the torque that reaches the water."""


class SonarArray(Section):
    """One fan, split into equal sub-sectors; the nearest vehicle of each is heard."""

    name: Annotated[str, Field(min_length=1)]
    """Unique within the suite."""
    kind: Literal["active", "passive"]
    """Only active arrays hear obstacles."""
    mounting_deg: Annotated[float, within(-360, 360)]
    """Direction of the fan's axis, clockwise from the bow."""
    aperture_deg: Annotated[float, within(0.01, 360)]
    """Width of the fan."""
    range_m: Radius
    """Vehicles nearer than this, and obstacles whose surface is, are heard."""
    sub_sectors: Annotated[int, within(1, 64)]
    """k_a (Eq. 12)."""

    def _check(self) -> None:
        width = self.aperture_deg / self.sub_sectors
        if width > MAX_SECTOR_DEG:
            raise ValueError(
                f"sonar.arrays.{self.name}.sub_sectors must leave sub-sectors of at most {MAX_SECTOR_DEG:g} deg, "
                f"got {width:g} deg; use at least {math.ceil(self.aperture_deg / MAX_SECTOR_DEG)}"
            )
        if width < MIN_SECTOR_DEG:
            raise ValueError(
                f"sonar.arrays.{self.name}.sub_sectors must leave sub-sectors of at least {MIN_SECTOR_DEG:g} deg, "
                f"got {width:g} deg; lower it or raise aperture_deg"
            )


class Sonar(Section):
    """What a vehicle hears."""

    echo_reports: Literal["centre", "surface"]
    """What an echo's position is: the obstacle's centre, or the nearest point of its surface in the beam."""
    obstacles_hide_vehicles: bool
    """Whether an obstacle on the line of sight silences a vehicle."""
    channels: tuple[Channel, ...]
    """Granted beyond the percept: ``compass`` (heading), ``link`` (an oracle of neighbours' identity and velocity),
    ``modem`` (the same as their latest messages tell it), ``current`` (own velocity over ground and through the water),
    ``age`` (of each sub-sector's reading), ``ranged`` (whether its range was measured)."""
    arrays: Annotated[tuple[SonarArray, ...], Field(min_length=1)]
    """The suite; their order is the order of sub-sectors in the percept."""

    @property
    def num_sectors(self) -> int:
        """Sub-sectors of all arrays."""
        return sum(array.sub_sectors for array in self.arrays)

    @property
    def num_active_sectors(self) -> int:
        """Sub-sectors of the active arrays."""
        return sum(array.sub_sectors for array in self.arrays if array.kind == "active")

    def _check(self) -> None:
        names = [array.name for array in self.arrays]
        if len(set(names)) < len(names):
            raise ValueError(f"sonar.arrays must have different names, got {names}")
        if len(set(self.channels)) < len(self.channels):
            raise ValueError(f"sonar.channels must name each channel once, got {list(self.channels)}")


class Timing(Section):
    """Three clocks."""

    control_hold_s: Clock
    """t_r: body forces are held this long."""
    integration_step_s: Clock
    """Runge-Kutta step; divides the control hold."""
    decision_period_s: Clock
    """A policy acts this often, a multiple of the control hold; the force is held in the world frame meanwhile."""

    @property
    def holds_per_decision(self) -> int:
        """Control holds in a decision period."""
        return round(self.decision_period_s / self.control_hold_s)

    @property
    def steps_per_hold(self) -> int:
        """Integration steps in a control hold."""
        return round(self.control_hold_s / self.integration_step_s)

    def _check(self) -> None:
        for long, short in (("control_hold_s", "integration_step_s"), ("decision_period_s", "control_hold_s")):
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


class Contact(Section):
    """What counts as a collision: two hulls, or a hull and an obstacle, overlap."""

    hull_radius_m: Positive
    """Vehicles collide closer than twice this; with an obstacle at this surface distance."""
    ends_vehicle: bool
    """Whether a vehicle that collides is lost."""


class Arrival(Section):
    """When the task is done."""

    radius_m: Positive
    """The swarm's centre this close to the end of the trajectory, with l(t) at rest there ..."""
    dwell_s: Annotated[float, within(0, 3_600)]
    """... for so long."""
    spread_m: Positive
    """Every vehicle this close to the end, for up to 54 vehicles."""
    ends_episode: bool
    """Whether an episode ends when the swarm arrives; else it runs to its time limit."""


class TimeLimit(Section):
    """When it is given up."""

    factor: Annotated[float, within(0.001, 1_000)]
    """Times the trajectory's duration ..."""
    extra_s: NonNegative
    """... plus this."""

    def of(self, duration_s: Seconds) -> Seconds:
        """The limit [s] of trajectories that take so long [s], a number or an array."""
        return self.factor * duration_s + self.extra_s


class Disturbance(Section):
    """What goes wrong."""

    loss_times_s: Annotated[tuple[NonNegative, ...], Field(max_length=16384)]
    """At each of these times a vehicle, drawn by the seed, is lost."""

    def _check(self) -> None:
        if list(self.loss_times_s) != sorted(self.loss_times_s):
            raise ValueError(f"disturbance.loss_times_s must not fall, got {list(self.loss_times_s)}; sort them")


class Reward(Section):
    """Weights of the terms in ``envs/reward.py``."""

    tracking: NonNegative
    obstacle: NonNegative
    spacing: NonNegative
    effort: NonNegative
    collision: NonNegative
    arrival: NonNegative
