"""Percept: what one vehicle observes, in its body frame, and the one declaration of its fields.

A percept is a flat float32 vector in physical units; its fields are views of it. Scales are powers of two, so that
dividing by them (the observation) and multiplying again loses nothing.
"""

import dataclasses
import functools
import math
from typing import Annotated, NamedTuple, get_type_hints

import numpy as np

from uuv_marl.errors import hint
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.types import Bool, Float32, Float64, UInt64

MAX_SPEED = 64.0
"""Velocities in a percept saturate here [m/s, rad/s], so that observation bounds are finite."""
_MAX_VEHICLES = 16384.0
NUM_RECENT = 4
"""Number of the latest messages in a percept."""


class Quantity(NamedTuple):
    """Unit of a field's numbers, scale of their observation, and bounds at which they saturate."""

    unit: str
    scale: float
    low: float
    high: float


POSITION = Quantity("m", 64.0, -MAX_RANGE_M, MAX_RANGE_M)
LENGTH = Quantity("m", 64.0, 0.0, MAX_RANGE_M)
SPEED = Quantity("m/s", 4.0, -MAX_SPEED, MAX_SPEED)
YAW_RATE = Quantity("rad/s", 1.0, -MAX_SPEED, MAX_SPEED)
ANGLE = Quantity("rad", 1.0, -math.pi, math.pi)
FLAG = Quantity("1", 1.0, 0.0, 1.0)
DIRECTION = Quantity("1", 1.0, -1.0, 1.0)
AGE = Quantity("s", 1.0, 0.0, 4096.0)
DURATION = Quantity("s", 64.0, 0.0, 4096.0)
IDENTITY = Quantity("1", _MAX_VEHICLES, 0.0, _MAX_VEHICLES)


# fmt: off
class Fields(NamedTuple):
    """Views of the fields that ``FIELDS`` declares, shape (world, vehicle, *axes); empty where the channel is absent.

    ``Annotated`` holds each field's axes, quantity, meaning and, unless every percept has it, the channel that adds it.
    """

    velocity: Annotated[Float32, "2", SPEED, "own surge and sway velocity over ground (current.velocity)"]
    yaw_rate: Annotated[Float32, "1", YAW_RATE, "own yaw rate"]
    reference: Annotated[Float32, "2", POSITION, "vector to the reference point l(t); a longer one is cut to 4096 m"]
    reference_velocity: Annotated[Float32, "2", SPEED, "velocity of the reference point"]
    detected: Annotated[Float32, "sector", FLAG, "per sub-sector: 1 if a vehicle is detected in it, else 0"]
    neighbour: Annotated[Float32, "sector 2", POSITION, "per sub-sector: position of the nearest vehicle, else 0"]
    echo: Annotated[Float32, "active", FLAG, "per active sub-sector: 1 if an obstacle returns an echo, else 0"]
    echo_range: Annotated[
        Float32, "active", LENGTH, "per active sub-sector: range to the nearest obstacle's surface in it, else 0"]
    echo_position: Annotated[
        Float32, "active 2", POSITION,
        "per active sub-sector: position of its centre, or of that surface point (sonar.echo_reports), else 0"]
    compass: Annotated[Float32, "2", DIRECTION, "cosine and sine of the heading from north", "compass"]
    identity: Annotated[
        Float32, "1", FLAG, "(own index + 1/2) over the number of vehicles, the same for all of an episode", "identity"]
    link_identity: Annotated[
        Float32, "sector", IDENTITY, "per sub-sector: 1 + index of the vehicle detected, else 0", "link"]
    link_velocity: Annotated[
        Float32, "sector 2", SPEED, "per sub-sector: velocity of that vehicle over ground, else 0", "link"]


class DisturbanceFields(NamedTuple):
    """As ``Fields``, for the channels that only a disturbed world's code writes; they follow in the flat vector."""

    ground_velocity: Annotated[Float32, "2", SPEED, "own surge and sway velocity over ground", "current"]
    water_velocity: Annotated[Float32, "2", SPEED, "own surge and sway velocity through the water", "current"]
    odometry: Annotated[
        Float32, "2", POSITION, "vector from the own position at the start to the present one, by its navigation",
        "odometry"]
    age: Annotated[Float32, "sector", AGE, "per sub-sector: time since the reception of its reading", "age"]
    ranged: Annotated[Float32, "sector", FLAG, "per sub-sector: 1 if the array measures ranges, else 0", "ranged"]
    modem_identity: Annotated[
        Float32, "sector", IDENTITY,
        "per sub-sector: 1 + index of the vehicle detected, once a message of it has arrived, else 0", "modem"]
    modem_velocity: Annotated[
        Float32, "sector 2", SPEED, "per sub-sector: velocity over ground of that vehicle when it sent", "modem"]
    modem_age: Annotated[Float32, "sector", AGE, "per sub-sector: time since that message was sent", "modem"]
    neighbour_message_valid: Annotated[
        Float32, "sector", FLAG, "per sub-sector: 1 once a message of the vehicle detected has arrived, else 0",
        "messages"]
    neighbour_message: Annotated[
        Float32, "sector entry", DIRECTION, "per sub-sector: entries of its latest message that has arrived, else 0",
        "messages"]
    neighbour_message_age: Annotated[
        Float32, "sector", DURATION, "per sub-sector: time since that message was sent", "messages"]
    message_valid: Annotated[
        Float32, "recent", FLAG, "1 for each of the four latest messages, the latest first, else 0", "messages"]
    message: Annotated[Float32, "recent entry", DIRECTION, "their entries, whoever sent them, else 0", "messages"]
    message_age: Annotated[Float32, "recent", DURATION, "time since each was sent, else 0", "messages"]
    time_to_slot: Annotated[
        Float32, "1", DURATION, "time until the own next slot, in which the action then in force is sent", "messages"]
# fmt: on


class FieldSpec(NamedTuple):
    """Declaration of a field.

    Axes "sector" and "active" count sub-sectors, "entry" numbers in a message and "recent" ``NUM_RECENT`` messages; the
    channel is "" for none.
    """

    axes: str
    quantity: Quantity
    meaning: str
    channel: str = ""


FIELDS = {
    name: FieldSpec(*annotated.__metadata__)
    for table in (Fields, DisturbanceFields)
    for name, annotated in get_type_hints(table, include_extras=True).items()
}
"""Every field that a percept can have beside its task's, in order."""
CHANNELS = (*dict.fromkeys(spec.channel for spec in FIELDS.values() if spec.channel), "episode")
"""Names in ``sonar.channels`` that add fields in every task; ``episode`` adds ``EPISODE``."""
Starts = tuple[int, ...]
"""Index in a flat percept at which each of ``FIELDS`` starts, -1 where it is absent."""


class PerceptField(NamedTuple):
    """One row of the table of a percept, of an observation or of a state."""

    name: str
    shape: tuple[int, ...]
    quantity: Quantity
    meaning: str

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)


FieldTable = tuple[PerceptField, ...]

EPISODE: FieldTable = (
    PerceptField("arrived", (1,), FLAG, "1 once the vehicle has had its reward for arriving, else 0"),
    PerceptField("time_left", (1,), FLAG, "share of the time limit that is left"),
)
"""Fields of the channel ``episode``, which the task writes."""


@functools.cache
def percept_table(
    num_sectors: int, num_active: int, channels: tuple[str, ...] = CHANNELS, message_entries: int = 0
) -> FieldTable:
    """Fields of a percept in order. Everything is relative to the vehicle: x forward, y starboard."""
    sizes = {
        "1": 1, "2": 2, "sector": num_sectors, "active": num_active, "recent": NUM_RECENT, "entry": message_entries,
    }  # fmt: skip
    return tuple(
        PerceptField(name, tuple(sizes[axis] for axis in spec.axes.split()), spec.quantity, spec.meaning)
        for name, spec in FIELDS.items()
        if not spec.channel or spec.channel in channels
    )


def task_fields(scenario: Scenario) -> FieldTable:
    """Fields that a scenario's task writes: those it always adds, and those of its channels in ``sonar.channels``."""
    task, added = scenario.task_class, {"episode": EPISODE, **scenario.task_class.channels}
    rows: FieldTable = task.observed
    return sum((fields for name, fields in added.items() if name in scenario.sonar.channels), rows)


@dataclasses.dataclass(frozen=True)
class PerceptLayout:
    """A table with its positions in the flat vector."""

    table: FieldTable

    @staticmethod
    def of(scenario: Scenario) -> "PerceptLayout":
        """The layout that a scenario's sonar suite, channels and task result in."""
        sonar, entries = scenario.sonar, scenario.modem.message_entries
        own = percept_table(sonar.num_sectors, sonar.num_active_sectors, sonar.channels, entries)
        return PerceptLayout(own + task_fields(scenario))

    @functools.cached_property
    def size(self) -> int:
        """Length of the flat vector."""
        return sum(field.size for field in self.table)

    @functools.cached_property
    def starts(self) -> dict[str, int]:
        """First index of each field."""
        ends = np.cumsum([field.size for field in self.table])
        return {field.name: int(end) - field.size for field, end in zip(self.table, ends, strict=True)}

    @functools.cached_property
    def offsets(self) -> Starts:
        """First index of each of ``FIELDS``, -1 where it is absent."""
        return tuple(self.starts.get(name, -1) for name in FIELDS)

    @functools.cached_property
    def message_offsets(self) -> Starts:
        """``offsets`` with the modem's fields in place of the link's, which have the same shapes."""
        return tuple(self.starts.get(name.replace("link_", "modem_"), -1) for name in FIELDS)

    @functools.cached_property
    def scale(self) -> Float32:
        """Unit of each observation entry, in physical units; powers of two. Shape (size,)."""
        return self._spread([field.quantity.scale for field in self.table])

    @functools.cached_property
    def low(self) -> Float32:
        """Lower bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.quantity.low / field.quantity.scale for field in self.table])

    @functools.cached_property
    def high(self) -> Float32:
        """Upper bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.quantity.high / field.quantity.scale for field in self.table])

    def _spread(self, values: list[float]) -> Float32:
        return np.repeat(np.array(values, np.float32), [field.size for field in self.table])


class Clock(NamedTuple):
    """Time of a percept. The arrays are the swarm's own and always show the present."""

    time_s: Float64
    """Time since the reset, shape (world,)."""
    episode: UInt64
    """Key of the episode, which every reset changes except one with the same seed, shape (world,)."""
    seed: UInt64
    """Seed of the episode, or ``episode`` where its reset had none, shape (world,), for random policies."""


@dataclasses.dataclass(frozen=True, repr=False)
class Percept:
    """What vehicles observe: ``flat`` of shape (..., layout.size), float32, physical units; its fields as views.

    ``percept["neighbour"]`` is a field by its name in ``FIELDS`` or the task's table, shape (..., *axes);
    ``percept.names`` lists the fields that it has.
    """

    flat: Float32
    layout: PerceptLayout
    clock: Clock | None = None
    """Time of this percept where it comes from the swarm; None for one made from observations."""
    alive: Bool | None = None
    """False for lost vehicles (rows of zeros), shape (world, vehicle); None where it is unknown."""

    @property
    def names(self) -> tuple[str, ...]:
        """The fields that ``percept["name"]`` gives, in the order of the flat vector."""
        return tuple(self.layout.starts)

    def __repr__(self) -> str:
        fields = ", ".join(f"{name} {self[name].shape}" for name in self.names)
        return f"Percept(flat {self.flat.shape}; {fields})"

    def __getitem__(self, name: str) -> Float32:
        """View of a field, shape (..., *axes). Raises KeyError where it or its channel is absent."""
        if name not in self.layout.starts:
            near = hint(str(name), self.names, 0.6)
            raise KeyError(f"percept has no field {name!r}; {near}it has {', '.join(self.names)}")
        start, field = self.layout.starts[name], next(field for field in self.layout.table if field.name == name)
        return self.flat[..., start : start + field.size].reshape(*self.flat.shape[:-1], *field.shape)

    def to_observation(self) -> Float32:
        """The scaled flat vector that environments return, shape (..., layout.size): a new array."""
        return self.flat / self.layout.scale

    @staticmethod
    def from_observation(observation: Float32, layout: PerceptLayout) -> "Percept":
        """The percept of an observation, shape (..., layout.size), bit for bit."""
        return Percept(observation * layout.scale, layout)
