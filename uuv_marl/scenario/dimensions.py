"""The dimension of every number of a scenario, and its conversion to other units.

A field's name says its dimension: a unit at its end (``radius_m``, ``speed_mps``), or a symbol of Fossen's, which is a
force or a moment over velocities (``X_uu``, ``N_r``). Names with neither are listed here. Units of length,
time and mass then convert a whole scenario.
"""

import re
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, cast

from pydantic import BaseModel


class Dimension(NamedTuple):
    """Exponents of length, time and mass."""

    length: int
    time: int
    mass: int


NUMBER = Dimension(0, 0, 0)
"""The dimension of counts, shares, angles and levels."""
_RATE, _FORCE, _MOMENT = Dimension(0, -1, 0), Dimension(1, -2, 1), Dimension(2, -2, 1)
_UNITS = {
    "m": Dimension(1, 0, 0),
    "s": Dimension(0, 1, 0),
    "mps": Dimension(1, -1, 0),
    "bps": _RATE,
    "kg": Dimension(0, 0, 1),
    "kgm": Dimension(1, 0, 1),
    "kgm2": Dimension(2, 0, 1),
    "n": _FORCE,
    "nm": _MOMENT,
    "nms": Dimension(2, -1, 1),
    "deg": NUMBER,
    "db": NUMBER,
}
"""Dimensions by the end of a field's name."""
_SYMBOL = re.compile(r"([XYN])_([uvrd]+)")
"""A force or moment over these: u and v [m/s], r [1/s], and a rudder's angle d."""
_NUMBERS = {
    "added_mass", "arrival", "collision", "drag", "drift_share", "eddies", "efficiency", "factor",
    "false_echo_probability", "force", "legs", "length", "loss_probability", "mass", "num_vehicles", "obstacles",
    "passive_range_log_sd", "payload_bytes", "range_share", "share", "silence_probability", "silence_readings", "speed",
    "sub_sectors", "thrust", "version", "yaw_authority",
}  # fmt: skip
_RATES = {"effort", "obstacle", "spacing", "tracking"}
"""Weights of the reward that are paid per second."""


class Units(NamedTuple):
    """Units of length [m], time [s] and mass [kg]."""

    length: float
    time: float
    mass: float

    def of(self, dimension: Dimension) -> float:
        """The unit of a dimension, in SI units."""
        return self.length**dimension.length * self.time**dimension.time * self.mass**dimension.mass

    @property
    def inverse(self) -> "Units":
        """One over each: what converts back."""
        return Units(1.0 / self.length, 1.0 / self.time, 1.0 / self.mass)


def dimension(field: str) -> Dimension | None:
    """The dimension of a scenario's number by its name, the last part of its field; None for an unknown name."""
    if field in _NUMBERS:
        return NUMBER
    if field in _RATES:
        return _RATE
    symbol = _SYMBOL.fullmatch(field)
    if symbol is None:
        return _UNITS.get(field.rpartition("_")[2]) if "_" in field else None
    length, time, mass = _FORCE if symbol[1] in "XY" else _MOMENT
    speeds, rates = sum(symbol[2].count(letter) for letter in "uv"), symbol[2].count("r")
    return Dimension(length - speeds, time + speeds + rates, mass)


def converted(value: Any, units: Units, keep: Collection[str] = (), field: str = "") -> Any:
    """A scenario, a section or plain data whose numbers are multiplied by the units of their dimensions.

    Numbers of unknown names, and values that hold no number, stay as they are. Nothing is checked.

    Args:
        value: a model, a dictionary, a list, or one field's value.
        units: to multiply by; ``units.inverse`` converts back.
        keep: names of fields and sections that stay as they are.
        field: the value's own name.
    """
    if field in keep or isinstance(value, bool):
        return value
    if isinstance(value, BaseModel):
        own = {name: getattr(value, name) for name in type(value).model_fields}
        return value.model_copy(update=converted(own, units, keep))
    if isinstance(value, Mapping):
        entries = cast(Mapping[str, Any], value).items()
        return {name: converted(entry, units, keep, str(name)) for name, entry in entries}
    if isinstance(value, list | tuple):
        made = [converted(entry, units, keep, field) for entry in cast(list[Any], value)]
        return made if isinstance(value, list) else tuple(made)
    known = dimension(field)
    if not isinstance(value, int | float) or known in (None, NUMBER):
        return value
    return value * units.of(known)
