"""What a sea does to vehicles and their sonar, as sections of a scenario; off in ``base.toml``, with sources there."""

import math
from typing import Annotated, Literal

from uuv_marl.scenario.fields import Clock, NonNegative, Radius, Section, Speed, within

Probability = Annotated[float, within(0, 1)]
Angle = Annotated[float, within(0, 180)]
Share = Annotated[float, within(0, 0.9)]
MAX_DELAY_S = 2.0
"""Longest processing of a reading."""
AROUND_M, _SQUARE_M = 250.0, 500.0
"""How far around a course's box there are eddies, and the side of the square that they are counted by."""


class Current(Section):
    """How the water moves: the sum of a mean, a Gauss-Markov process and steady eddies."""

    speed_mps: Speed
    """Of the mean."""
    direction_deg: Annotated[float, within(-360, 360)] | None = None
    """Where the mean flows to, clockwise from north; drawn by the seed where absent."""
    variation_mps: Speed
    """Standard deviation of the process, north and east each."""
    variation_time_s: Clock
    """In which it forgets: 1 / mu."""
    eddies: Annotated[int, within(0, 64)]
    """Per square of 500 m, over the course's box and 250 m around it; made an even number."""
    eddy_speed_mps: Speed
    """Largest speed of the water around one."""
    eddy_core_m: Radius
    """Radius of its core."""
    velocity: Literal["ground", "water"]
    """What a vehicle knows its own velocity over: the ground (a log that reaches the bottom), or through the water."""

    @property
    def flows(self) -> bool:
        """Whether the water moves."""
        return self.speed_mps > 0.0 or self.variation_mps > 0.0 or (self.eddies > 0 and self.eddy_speed_mps > 0.0)

    def num_eddies(self, north_m: float, east_m: float) -> int:
        """Eddies in and around a course's box with these sides: an even number, so that circulations sum to 0."""
        if self.eddies == 0 or self.eddy_speed_mps == 0.0:
            return 0
        squares = (north_m + 2.0 * AROUND_M) * (east_m + 2.0 * AROUND_M) / _SQUARE_M**2
        return 2 * math.ceil(self.eddies * squares / 2.0 - 1e-9)


class Latency(Section):
    """How late the sonar is. A reading is what an array hears at one time."""

    travel_time: bool
    """Whether a vehicle is heard where it was when its sound left it."""
    sound_speed_mps: Annotated[float, within(100, 10_000)]
    """Of sound in water."""
    processing_s: Annotated[float, within(0, MAX_DELAY_S)]
    """From reception until a policy gets the reading."""
    compensated: bool
    """Whether readings are carried to the present pose by the vehicle's own navigation."""
    active_period_s: Annotated[float, within(0, 3_600)]
    """Between two pings of an active array; 0: heard at every control hold, which no real one can."""
    passive_period_s: Annotated[float, within(0, 3_600)]
    """Between two readings of a passive array; 0: at every control hold."""


class Noise(Section):
    """What the sonar gets wrong, at each reading anew unless something else is said."""

    bearing_deg: Angle
    """Standard deviation of a bearing."""
    range_m: NonNegative
    """Standard deviation of a range ..."""
    range_share: Probability
    """... plus this share of it."""
    passive_range_log_sd: Annotated[float, within(0, 3)]
    """A vehicle's passive arrays take ranges times one lasting factor: exp of a normal number with this deviation."""
    passive_ranges: bool
    """Whether passive arrays measure ranges at all."""
    nominal_range_m: Radius
    """Where a vehicle is put that is heard by its bearing alone."""
    active_r50_m: NonNegative
    """Range at which an active array detects every second time; 0: always detects."""
    passive_r50_m: NonNegative
    """The same of a passive array."""
    detection_sd_db: Annotated[float, within(0.001, 100)]
    """Standard deviation of the signal excess."""
    silence_probability: Probability
    """That an array falls silent at a reading ..."""
    silence_readings: Annotated[int, within(1, 10_000)]
    """... for so many."""
    false_echo_probability: Probability
    """Per sub-sector: of an echo of nothing; an obstacle to active arrays, a vehicle to passive ones."""


class Navigation(Section):
    """What a vehicle knows of where it is, and so of where l(t) is."""

    drift_share: Probability
    """Its position drifts by this share of the way made, in a direction of its own."""
    compass_bias_deg: Angle
    """Standard deviation of its compass's lasting error."""


class Modem(Section):
    """Acoustic messages, one of each vehicle in a round, in turn. The channel ``modem`` gives what arrived."""

    period_s: Annotated[float, within(0.001, 36_000)] | None = None
    """Of a round; absent: one slot for each vehicle, long enough to send and for sound to cross ``guard_m``."""
    payload_bytes: Annotated[int, within(1, 4_096)]
    """Of a message."""
    bit_rate_bps: Annotated[float, within(1, 1_000_000)]
    """Net."""
    guard_m: NonNegative
    """Distance that a message crosses before the next is sent."""
    loss_probability: Probability
    """Of each message, for each listener."""

    def round_s(self, num_vehicles: int, sound_speed_mps: float) -> float:
        """Time between two messages of a vehicle in a swarm of this size [s]."""
        slot = 8.0 * self.payload_bytes / self.bit_rate_bps + self.guard_m / sound_speed_mps
        return self.period_s if self.period_s is not None else num_vehicles * slot


class Mismatch(Section):
    """How far a vehicle's numbers are from the scenario's: factors, uniform in 1 -+ share, one draw per vehicle."""

    mass: Share
    """Of mass and moment of inertia."""
    added_mass: Share
    """Of all added masses."""
    drag: Share
    """Of all resistances."""
    thrust: Share
    """Of thrust."""


class Fault(Section):
    """Something that breaks on a share of the vehicles, rounded up; a larger share has the smaller one's among them."""

    kind: Literal["thruster", "yaw", "array", "member"]
    """Thrust, yaw torque, a sonar array, or the whole vehicle."""
    share: Probability
    """Of the vehicles."""
    efficiency: Probability = 0.0
    """What is left of thrust or torque."""
    array: str | None = None
    """Which array."""
    onset_s: NonNegative | None = None
    """When it breaks; absent: at a time of l(t)'s way, drawn for each vehicle."""
    duration_s: NonNegative | None = None
    """How long; absent: to the end. A lost member stays lost."""

    def _check(self) -> None:
        if (self.kind == "array") != (self.array is not None):
            raise ValueError(
                f"faults.array must name the array of a fault of kind array, and of no other kind, got {self.array!r} "
                f"for kind {self.kind}"
            )
        if self.efficiency > 0.0 and self.kind not in ("thruster", "yaw"):
            raise ValueError(
                f"faults.efficiency is of kinds thruster and yaw alone, got {self.efficiency:g} for kind {self.kind}; "
                "leave it out"
            )
        if self.duration_s is not None and self.kind == "member":
            raise ValueError(
                f"faults.duration_s is of no use to kind member, got {self.duration_s:g}: who is lost stays lost; "
                "leave it out"
            )
