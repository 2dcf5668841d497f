"""Disturbances of vehicles and their sonar, as sections of a scenario; off in ``base.toml``, with sources there."""

import math
from typing import Annotated, Literal

from uuv_marl.scenario.fields import Clock, NonNegative, Radius, Section, Speed, within

Probability = Annotated[float, within(0, 1)]
Angle = Annotated[float, within(0, 180)]
Share = Annotated[float, within(0, 0.9)]
MAX_DELAY_S = 2.0  # longest processing time of a reading
AROUND_M, _SQUARE_M = 250.0, 500.0
"""Margin around a map's box that holds eddies, and side of the square for their density."""


class Current(Section):
    """Velocity of the water: the sum of a mean, a Gauss-Markov process and steady eddies."""

    speed_mps: Speed
    """Speed of the mean current."""
    direction_deg: Annotated[float, within(-360, 360)] | None = None
    """Direction to which the mean current flows, clockwise from north; if absent, random."""
    variation_mps: Speed
    """Standard deviation of the Gauss-Markov process, for north and for east."""
    variation_time_s: Clock
    """Time constant of the Gauss-Markov process: 1 / mu."""
    eddies: Annotated[int, within(0, 64)]
    """Eddies per square of 500 m, over the map's box and 250 m around it; the total is made even."""
    eddy_speed_mps: Speed
    """Largest water speed around an eddy."""
    eddy_core_m: Radius
    """Radius of an eddy's core."""
    velocity: Literal["ground", "water"]
    """Own velocity in a vehicle's percept: over ground (bottom-track log), or through the water."""

    @property
    def flows(self) -> bool:
        """Whether the water moves."""
        return self.speed_mps > 0.0 or self.variation_mps > 0.0 or (self.eddies > 0 and self.eddy_speed_mps > 0.0)

    def num_eddies(self, north_m: float, east_m: float) -> int:
        """Eddies in and around a map's box with these sides: an even number, so that circulations sum to 0."""
        if self.eddies == 0 or self.eddy_speed_mps == 0.0:
            return 0
        squares = (north_m + 2.0 * AROUND_M) * (east_m + 2.0 * AROUND_M) / _SQUARE_M**2
        return 2 * math.ceil(self.eddies * squares / 2.0 - 1e-9)


class Traffic(Section):
    """Moving obstacles: they oscillate about their initial positions along a random direction."""

    speed_mps: Speed
    """Speed, the same for all; 0: they are at rest."""
    amplitude_m: Radius
    """Largest distance from the initial position."""
    share: Probability
    """Share of the obstacles that move, rounded up. A larger share moves the same obstacles and more."""

    @property
    def moves(self) -> bool:
        """Whether any obstacle moves."""
        return self.speed_mps > 0.0 and self.share > 0.0


class Latency(Section):
    """Delays of the sonar. A reading is the output of an array at one time."""

    travel_time: bool
    """Whether a vehicle is detected at the position where its sound was emitted."""
    sound_speed_mps: Annotated[float, within(100, 10_000)]
    """Speed of sound in water."""
    processing_s: Annotated[float, within(0, MAX_DELAY_S)]
    """Time from the reception of a reading until it is in the percept."""
    compensated: bool
    """Whether readings are corrected for the vehicle's own motion since their reception, by its navigation."""
    active_period_s: Annotated[float, within(0, 3_600)]
    """Time between two pings of an active array; 0: a ping at every control step, which is not realistic."""
    passive_period_s: Annotated[float, within(0, 3_600)]
    """Time between two readings of a passive array; 0: a reading at every control step."""


class Noise(Section):
    """Errors of the sonar, independent for each reading unless a field says otherwise."""

    bearing_deg: Angle
    """Standard deviation of a bearing."""
    range_m: NonNegative
    """Constant part of the standard deviation of a range."""
    range_share: Probability
    """Part of the standard deviation of a range that is proportional to it."""
    passive_range_log_sd: Annotated[float, within(0, 3)]
    """A vehicle's passive arrays multiply ranges by a constant factor: exp of a normal number with this deviation."""
    passive_ranges: bool
    """Whether passive arrays measure ranges."""
    nominal_range_m: Radius
    """Reported range of a vehicle of which only the bearing is measured."""
    active_r50_m: NonNegative
    """Range at which an active array detects with probability 0.5; 0: it always detects."""
    passive_r50_m: NonNegative
    """Range at which a passive array detects with probability 0.5; 0: it always detects."""
    detection_sd_db: Annotated[float, within(0.001, 100)]
    """Standard deviation of the signal excess."""
    silence_probability: Probability
    """Probability, at each reading, that an array begins a period without detections."""
    silence_readings: Annotated[int, within(1, 10_000)]
    """Readings in such a period."""
    false_echo_probability: Probability
    """Probability of a false echo per sub-sector: an obstacle to active arrays, a vehicle to passive arrays."""


class Navigation(Section):
    """Errors of a vehicle's navigation: of its position, and so of the vector to l(t), and of its compass."""

    drift_share: Probability
    """Drift of the position estimate, as a share of the distance travelled, in a random direction."""
    compass_bias_deg: Angle
    """Standard deviation of the compass's constant bias."""


class Modem(Section):
    """Acoustic messages: in a round each vehicle sends one, in turn. The channel ``modem`` holds those received."""

    period_s: Annotated[float, within(0.001, 36_000)] | None = None
    """Period of a round; absent: a slot for each vehicle, in which it sends and sound travels ``guard_m``."""
    payload_bytes: Annotated[int, within(1, 4_096)]
    """Length of a message."""
    bit_rate_bps: Annotated[float, within(1, 1_000_000)]
    """Net bit rate."""
    guard_m: NonNegative
    """Distance that a message travels before the next is sent."""
    loss_probability: Probability
    """Probability, for each listener, that a message is lost."""

    def round_s(self, num_vehicles: int, sound_speed_mps: float) -> float:
        """Time between two messages of a vehicle in a swarm of this size [s]."""
        slot = 8.0 * self.payload_bytes / self.bit_rate_bps + self.guard_m / sound_speed_mps
        return self.period_s if self.period_s is not None else num_vehicles * slot


class Mismatch(Section):
    """Differences of vehicles' parameters from the scenario's: factors, uniform in 1 -+ share, one draw per vehicle."""

    mass: Share
    """Share for mass and moment of inertia."""
    added_mass: Share
    """Share for all added masses."""
    drag: Share
    """Share for all resistances."""
    thrust: Share
    """Share for thrust."""


class Fault(Section):
    """A fault of a share of the vehicles, rounded up. A larger share affects the same vehicles and more."""

    kind: Literal["thruster", "yaw", "array", "member"]
    """The component that fails: thruster, yaw actuator, sonar array, or the whole vehicle."""
    share: Probability
    """Share of the vehicles that are affected."""
    efficiency: Probability = 0.0
    """Share of thrust or torque that remains."""
    array: str | None = None
    """Name of the array that fails."""
    onset_s: NonNegative | None = None
    """Start of the fault; absent: a random time while l(t) moves, for each vehicle."""
    duration_s: NonNegative | None = None
    """Duration of the fault; absent: until the end. A lost vehicle stays lost."""

    def _check(self) -> None:
        if (self.kind == "array") != (self.array is not None):
            raise ValueError(
                f"faults.array must be given for kind array and for no other kind, got {self.array!r} for kind "
                f"{self.kind}"
            )
        for name, useless in (("efficiency", ("array", "member")), ("duration_s", ("member",))):
            if (value := getattr(self, name)) and self.kind in useless:
                raise ValueError(f"faults.{name} is of no use to kind {self.kind}, got {value:g}; leave it out")
