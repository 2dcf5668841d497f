"""Percept: what one vehicle knows, in its body frame, and the one table that orders, scales and bounds it.

A percept is a flat float32 vector in physical units; its fields are views of it. Scales are powers of two, so that
dividing by them (the observation) and multiplying again loses nothing.
"""

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from uuv_marl.errors import hint
from uuv_marl.scenario import MAX_RANGE_M, Scenario
from uuv_marl.types import Bool, Float32, Float64, UInt64

MAX_SPEED = 64.0
"""Velocities in a percept saturate here [m/s, rad/s], so that observation bounds are finite."""
_MAX_VEHICLES = 16384.0


class Kind(NamedTuple):
    """What numbers of a field are: their unit, the scale of an observation, and bounds at which they saturate."""

    unit: str
    scale: float
    low: float
    high: float


POSITION = Kind("m", 64.0, -MAX_RANGE_M, MAX_RANGE_M)
LENGTH = Kind("m", 64.0, 0.0, MAX_RANGE_M)
SPEED = Kind("m/s", 4.0, -MAX_SPEED, MAX_SPEED)
YAW_RATE = Kind("rad/s", 1.0, -MAX_SPEED, MAX_SPEED)
FLAG = Kind("1", 1.0, 0.0, 1.0)
DIRECTION = Kind("1", 1.0, -1.0, 1.0)
AGE = Kind("s", 1.0, 0.0, 4096.0)
IDENTITY = Kind("1", _MAX_VEHICLES, 0.0, _MAX_VEHICLES)


class PerceptField(NamedTuple):
    """One row of the table."""

    name: str
    shape: tuple[int, ...]
    kind: Kind
    meaning: str

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)


Table = tuple[PerceptField, ...]


def _sonar(sectors: int, active: int) -> Table:
    return (
        PerceptField("velocity", (2,), SPEED, "own surge and sway velocity over ground (current.velocity)"),
        PerceptField("yaw_rate", (1,), YAW_RATE, "own yaw rate"),
        PerceptField("reference", (2,), POSITION, "vector to the reference point l(t); a longer one is cut to 4096 m"),
        PerceptField("reference_velocity", (2,), SPEED, "velocity of the reference point"),
        PerceptField("detected", (sectors,), FLAG, "per sub-sector: 1 if a vehicle is heard (the nearest), else 0"),
        PerceptField("neighbour", (sectors, 2), POSITION, "per sub-sector: that vehicle's position, else 0"),
        PerceptField("echo", (active,), FLAG, "per active sub-sector: 1 if an obstacle returns an echo, else 0"),
        PerceptField(
            "echo_range", (active,), LENGTH,
            "per active sub-sector: range to the nearest obstacle's surface in it, else 0",
        ),
        PerceptField(
            "echo_position", (active, 2), POSITION,
            "per active sub-sector: position of its centre, or of that surface point (sonar.echo_reports), else 0",
        ),
    )  # fmt: skip


def _compass(_sectors: int, _active: int) -> Table:
    return (PerceptField("compass", (2,), DIRECTION, "cosine and sine of the heading from north"),)


def _link(sectors: int, _active: int) -> Table:
    return (
        PerceptField("link_identity", (sectors,), IDENTITY, "per sub-sector: 1 + index of the vehicle heard, else 0"),
        PerceptField(
            "link_velocity", (sectors, 2), SPEED, "per sub-sector: velocity of that vehicle over ground, else 0"
        ),
    )


def _current(_sectors: int, _active: int) -> Table:
    return (
        PerceptField("ground_velocity", (2,), SPEED, "own surge and sway velocity over ground"),
        PerceptField("water_velocity", (2,), SPEED, "own surge and sway velocity through the water"),
    )


def _age(sectors: int, _active: int) -> Table:
    return (PerceptField("age", (sectors,), AGE, "per sub-sector: time since the reception of its reading"),)


def _ranged(sectors: int, _active: int) -> Table:
    return (PerceptField("ranged", (sectors,), FLAG, "per sub-sector: 1 if the array measures ranges, else 0"),)


def _modem(sectors: int, _active: int) -> Table:
    return (
        PerceptField("modem_identity", (sectors,), IDENTITY, "per sub-sector: 1 + index of the vehicle heard, where a "
                     "message of it has arrived, else 0"),
        PerceptField("modem_velocity", (sectors, 2), SPEED, "per sub-sector: its velocity over ground when it sent"),
        PerceptField("modem_age", (sectors,), AGE, "per sub-sector: time since it sent"),
    )  # fmt: skip


CHANNELS = {
    "compass": _compass, "link": _link, "current": _current, "age": _age, "ranged": _ranged, "modem": _modem
}  # fmt: skip
"""Rows that a channel adds, by its name in ``sonar.channels``, in the order of the table."""


@functools.cache
def percept_table(num_sectors: int, num_active: int, channels: tuple[str, ...] = tuple(CHANNELS)) -> Table:
    """The fields of a percept in order. Everything is relative to the vehicle: x forward, y starboard."""
    with_policy_requirements = (rows(num_sectors, num_active) for name, rows in CHANNELS.items() if name in channels)
    return sum(with_policy_requirements, _sonar(num_sectors, num_active))


def task_fields(scenario: Scenario) -> Table:
    """Rows that a scenario's task tells: those it always does, and those of its own channels that are granted."""
    kind, with_policy_requirements = scenario.task_class, scenario.sonar.channels
    rows: Table = kind.observed
    return sum((own for name, own in kind.channels.items() if name in with_policy_requirements), rows)


class Starts(NamedTuple):
    """Where each field that there can be starts in a flat percept, -1 where it is absent."""

    velocity: int
    yaw_rate: int
    reference: int
    reference_velocity: int
    detected: int
    neighbour: int
    echo: int
    echo_range: int
    echo_position: int
    compass: int
    link_identity: int
    link_velocity: int
    ground_velocity: int
    water_velocity: int
    age: int
    ranged: int
    modem_identity: int
    modem_velocity: int
    modem_age: int


@dataclasses.dataclass(frozen=True)
class PerceptLayout:
    """A table with its positions in the flat vector."""

    table: tuple[PerceptField, ...]

    @staticmethod
    def of(scenario: Scenario) -> "PerceptLayout":
        """The layout that a scenario's sonar suite, channels and task make."""
        sonar = scenario.sonar
        own = percept_table(sonar.num_sectors, sonar.num_active_sectors, sonar.channels)
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
        """First index of every field that there can be, -1 where absent."""
        return Starts(**{field.name: self.starts.get(field.name, -1) for field in percept_table(0, 0)})

    @functools.cached_property
    def message_offsets(self) -> Starts:
        """``offsets``, the modem's fields in place of the link's, whose shapes are the same."""
        at = self.offsets
        return at._replace(link_identity=at.modem_identity, link_velocity=at.modem_velocity)

    @functools.cached_property
    def scale(self) -> Float32:
        """Unit of each observation entry, in physical units; powers of two. Shape (size,)."""
        return self._spread([field.kind.scale for field in self.table])

    @functools.cached_property
    def low(self) -> Float32:
        """Lower bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.kind.low / field.kind.scale for field in self.table])

    @functools.cached_property
    def high(self) -> Float32:
        """Upper bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.kind.high / field.kind.scale for field in self.table])

    def _spread(self, values: list[float]) -> Float32:
        return np.repeat(np.array(values, np.float32), [field.size for field in self.table])


class Clock(NamedTuple):
    """When a percept was heard. The arrays are the swarm's own: they show the present."""

    time_s: Float64
    """Since the reset, shape (world,)."""
    episode: UInt64
    """A number that every reset changes, except one with the same seed, shape (world,)."""
    seed: UInt64
    """Seed of the episode, or ``episode`` where its reset had none, shape (world,), for policies that draw."""


@dataclasses.dataclass(frozen=True, repr=False)
class Percept:
    """What vehicles know: ``flat`` of shape (..., layout.size), float32, physical units; its fields as views.

    ``velocity`` (..., 2), ``yaw_rate`` (..., 1), ``reference`` (..., 2), ``reference_velocity`` (..., 2),
    ``heard`` (..., sector), ``neighbour`` (..., sector, 2), ``echo`` (..., active), ``echo_range`` (..., active),
    ``echo_position`` (..., active, 2), and where their channels are granted ``compass`` (..., 2), ``link_identity``
    (..., sector), ``link_velocity`` (..., sector, 2) and those of docs/scenarios.md. Any of them by
    ``percept["name"]``; ``percept.names`` lists those there are.
    """

    flat: Float32
    layout: PerceptLayout
    clock: Clock | None = None
    """When this was perceived, where the swarm itself gives the percept; None for one made of observations."""
    alive: Bool | None = None
    """False for lost vehicles, whose rows are zero, shape (world, vehicle); None where nobody says."""

    @property
    def names(self) -> tuple[str, ...]:
        """The fields that ``percept["name"]`` gives, in the order of the flat vector."""
        return tuple(self.layout.starts)

    def __repr__(self) -> str:
        fields = ", ".join(f"{name} {self[name].shape}" for name in self.names)
        return f"Percept(flat {self.flat.shape}; {fields})"

    def __getitem__(self, name: str) -> Float32:
        """A field by name, as a view. Raises KeyError where there is none, or where its channel is not granted."""
        if name not in self.layout.starts:
            near = hint(str(name), self.names, 0.6)
            raise KeyError(f"percept has no field {name!r}; {near}It has {', '.join(self.names)}")
        start = self.layout.starts[name]
        field = next(field for field in self.layout.table if field.name == name)
        return self.flat[..., start : start + field.size].reshape(*self.flat.shape[:-1], *field.shape)

    def to_observation(self) -> Float32:
        """The scaled flat vector that environments hand out: a new array."""
        return self.flat / self.layout.scale

    @staticmethod
    def from_observation(observation: Float32, layout: PerceptLayout) -> "Percept":
        """The percept back from an observation, bit for bit."""
        return Percept(observation * layout.scale, layout)
