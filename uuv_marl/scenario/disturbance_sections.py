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
    """Acoustic messages: in a round each vehicle sends one. Without ``message_entries`` it is its velocity."""

    period_s: Annotated[float, within(0.001, 36_000)] | None = None
    """Mean time between two messages of a vehicle; absent: a slot for each vehicle."""
    payload_bytes: Annotated[int, within(1, 4_096)]
    """Length of a message with a velocity."""
    message_entries: Annotated[int, within(0, 64)]
    """Numbers in a message, which the vehicle's action holds beside the forces; 0: messages hold its velocity."""
    message_vectors: Annotated[int, within(0, 32)]
    """Vectors with which these numbers begin, two each. A sender gives them in its body frame, within the unit disc;
    they are sent north and east by its compass, and read by the receiver's in its own frame."""
    bits_per_entry: Annotated[int, within(1, 32)]
    """Bits of such a number: it is rounded to the nearest of 2^bits values, evenly from -1 to 1."""
    header_bytes: Annotated[int, within(0, 4_096)]
    """Length of the header of a message with numbers."""
    access: Literal["tdma", "aloha"]
    """Who sends such messages: each vehicle in its own slot of a round, or in random slots, where messages collide."""
    bit_rate_bps: Annotated[float, within(1, 1_000_000)]
    """Net bit rate."""
    guard_m: NonNegative
    """Distance that a message travels before the next is sent."""
    range_m: Radius
    """Largest distance at which a message with numbers is received, and interferes with another."""
    loss_probability: Probability
    """Probability, for each listener, that a message is lost."""

    @property
    def airtime_s(self) -> float:
        """Time in which a message is sent [s]."""
        own = self.header_bytes * 8 + self.message_entries * self.bits_per_entry
        return (own if self.message_entries else 8.0 * self.payload_bytes) / self.bit_rate_bps

    def slot_s(self, sound_speed_mps: float) -> float:
        """Shortest time between two messages: one is sent, and sound travels ``guard_m`` [s]."""
        return self.airtime_s + self.guard_m / sound_speed_mps

    def round_s(self, num_vehicles: int, sound_speed_mps: float) -> float:
        """Mean time between two messages of a vehicle in a swarm of this size [s]."""
        return self.period_s if self.period_s is not None else num_vehicles * self.slot_s(sound_speed_mps)


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
