"""Percept: what one vehicle knows, in its body frame, and the one table that orders, scales and bounds it.

A percept is a flat float32 vector in physical units; its fields are views of it. Scales are powers of two, so that
dividing by them (the observation) and multiplying again loses nothing.
"""

import dataclasses
import difflib
import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.scenario import MAX_RANGE_M, Scenario

Float32 = NDArray[np.float32]

_POSITION_SCALE_M = 64.0
_SPEED_SCALE_MPS = 4.0
MAX_SPEED = 64.0
"""Velocities in a percept saturate here [m/s, rad/s], so that observation bounds are finite."""
_MAX_VEHICLES = 16384.0


class PerceptField(NamedTuple):
    """One row of the table. ``low`` and ``high`` are bounds in the field's unit; values saturate there."""

    name: str
    shape: tuple[int, ...]
    unit: str
    scale: float
    low: float
    high: float
    meaning: str

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)


class Offsets(NamedTuple):
    """Where each field starts in the flat vector, for compiled code; -1 where the field is absent."""

    velocity: int
    yaw_rate: int
    reference: int
    reference_velocity: int
    heard: int
    neighbour: int
    echo: int
    echo_range: int
    echo_position: int
    compass: int
    link_identity: int
    link_velocity: int


@functools.cache
def percept_table(num_sectors: int, num_active: int, channels: tuple[str, ...] = ()) -> tuple[PerceptField, ...]:
    """The fields of a percept in order. Everything is relative to the vehicle: x forward, y starboard."""
    position = ("m", _POSITION_SCALE_M, -MAX_RANGE_M, MAX_RANGE_M)
    speed = ("m/s", _SPEED_SCALE_MPS, -MAX_SPEED, MAX_SPEED)
    flag = ("1", 1.0, 0.0, 1.0)
    table = [
        PerceptField("velocity", (2,), *speed, "own surge and sway velocity"),
        PerceptField("yaw_rate", (1,), "rad/s", 1.0, -MAX_SPEED, MAX_SPEED, "own yaw rate"),
        PerceptField("reference", (2,), *position, "vector to the reference point l(t); a longer one is cut to 4096 m"),
        PerceptField("reference_velocity", (2,), *speed, "velocity of the reference point"),
        PerceptField("heard", (num_sectors,), *flag, "per sub-sector: 1 if a vehicle is heard (the nearest), else 0"),
        PerceptField("neighbour", (num_sectors, 2), *position, "per sub-sector: that vehicle's position, else 0"),
        PerceptField("echo", (num_active,), *flag, "per active sub-sector: 1 if an obstacle returns an echo, else 0"),
        PerceptField(
            "echo_range", (num_active,), "m", _POSITION_SCALE_M, 0.0, MAX_RANGE_M,
            "per active sub-sector: range to the nearest obstacle's surface in it, else 0",
        ),
        PerceptField(
            "echo_position", (num_active, 2), *position,
            "per active sub-sector: position of its centre, or of that surface point (sonar.echo_reports), else 0",
        ),
    ]  # fmt: skip
    if "compass" in channels:
        table.append(PerceptField("compass", (2,), "1", 1.0, -1.0, 1.0, "cosine and sine of the heading from north"))
    if "link" in channels:
        table += [
            PerceptField(
                "link_identity", (num_sectors,), "1", _MAX_VEHICLES, 0.0, _MAX_VEHICLES,
                "per sub-sector: 1 + index of the vehicle heard, else 0",
            ),
            PerceptField("link_velocity", (num_sectors, 2), *speed, "per sub-sector: velocity of that vehicle, else 0"),
        ]  # fmt: skip
    return tuple(table)


@dataclasses.dataclass(frozen=True)
class PerceptLayout:
    """A table with its positions in the flat vector."""

    table: tuple[PerceptField, ...]

    @staticmethod
    def of(scenario: Scenario) -> "PerceptLayout":
        """The layout that a scenario's sonar suite and channels make."""
        sonar = scenario.sonar
        return PerceptLayout(percept_table(sonar.num_sectors, sonar.num_active_sectors, sonar.channels))

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
    def offsets(self) -> Offsets:
        """First index of every possible field, -1 where absent."""
        return Offsets(*(self.starts.get(name, -1) for name in Offsets._fields))

    @functools.cached_property
    def scale(self) -> Float32:
        """Unit of each observation entry, in physical units; powers of two. Shape (size,)."""
        return self._spread([field.scale for field in self.table])

    @functools.cached_property
    def low(self) -> Float32:
        """Lower bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.low / field.scale for field in self.table])

    @functools.cached_property
    def high(self) -> Float32:
        """Upper bound of each observation entry (scaled). Shape (size,)."""
        return self._spread([field.high / field.scale for field in self.table])

    def _spread(self, values: list[float]) -> Float32:
        return np.repeat(np.array(values, np.float32), [field.size for field in self.table])


@dataclasses.dataclass(frozen=True, repr=False)
class Percept:
    """What vehicles know: ``flat`` of shape (..., layout.size), float32, physical units; its fields as views.

    ``velocity`` (..., 2), ``yaw_rate`` (..., 1), ``reference`` (..., 2), ``reference_velocity`` (..., 2),
    ``heard`` (..., sector), ``neighbour`` (..., sector, 2), ``echo`` (..., active), ``echo_range`` (..., active),
    ``echo_position`` (..., active, 2), and where granted ``compass`` (..., 2), ``link_identity`` (..., sector),
    ``link_velocity`` (..., sector, 2). Any of them by ``percept["name"]``; ``percept.names`` lists those there are.
    """

    flat: Float32
    layout: PerceptLayout

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
            near = difflib.get_close_matches(str(name), self.names, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise KeyError(f"percept has no field {name!r}; {hint}It has {', '.join(self.names)}")
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
