"""The dimension of every number of a scenario, and its conversion to other units.

A field's name says its dimension: a unit at its end (``radius_m``, ``speed_mps``), or a symbol of Fossen's, which is a
force or a moment over velocities (``X_uu``, ``N_r``). Names with neither are listed here. Units of length,
time and mass then convert a whole scenario.
"""

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
_SPEED, _RATE, _FORCE, _MOMENT = Dimension(1, -1, 0), Dimension(0, -1, 0), Dimension(1, -2, 1), Dimension(2, -2, 1)
_UNITS = {
    "m": Dimension(1, 0, 0),
    "s": Dimension(0, 1, 0),
    "mps": _SPEED,
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
_FORCES = {"X": _FORCE, "Y": _FORCE, "N": _MOMENT}
_OVER = {"u": _SPEED, "v": _SPEED, "r": _RATE, "d": NUMBER}
"""A symbol is a force or moment over these, one for each letter; d is a rudder's angle."""
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
    stem, _, end = field.rpartition("_")
    if stem in _FORCES and set(end) <= _OVER.keys():
        over = [_OVER[letter] for letter in end]
        return Dimension(*(exponent - sum(of) for exponent, *of in zip(_FORCES[stem], *over, strict=True)))
    return _UNITS.get(end) if stem else None


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
