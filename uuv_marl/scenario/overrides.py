"""Fields of a scenario by name: ``field=value`` on the command line, and assignment in nested tables."""

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from numbers import Integral, Real
from typing import Any, cast

from pydantic import BaseModel

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario.documents import replaced
from uuv_marl.scenario.messages import short, shown
from uuv_marl.scenario.task import named_task

_PLAIN: tuple[tuple[type, Callable[[Any], object]], ...] = (
    (os.PathLike, os.fspath), (Integral, int), (Real, float), (Decimal, float),
)  # fmt: skip
"""Types of values and their conversions."""


def parse_override(text: str) -> tuple[str, object]:
    """Parse ``field=value`` of the command line; the value in TOML, a bare word taken as text."""
    field, equals, value = text.partition("=")
    if not equals or not field.strip() or "\n" in text.strip():
        raise ScenarioError(
            f"--set must look like field=value, on one line, got {shown(text)}; for instance swarm.num_vehicles=20"
        )
    try:
        return field.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        if value.strip().startswith(("[", "{")):
            raise ScenarioError(
                f"--set {shown(field.strip())} must be a list or table, got {shown(value.strip())}; texts in it "
                'need quotes: \'task.kinds=["pocket", "bar"]\''
            ) from None
        return field.strip(), value.strip()
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"--set {shown(field.strip())} can't be read: {error}; give a plain value") from None


def assign(data: dict[str, Any], field: str, value: Any) -> None:
    """Set a field of nested tables in place: keys joined by dots, an entry of a list by name or index.

    A table changes its fields and leaves the others, as a table of a file does; a list is replaced.

    Raises ScenarioError if a key is not in a table or an entry does not exist.
    """
    *path, last = field.split(".")
    if path[:1] == ["task"]:
        data["task"] = named_task(data.get("task", {}))
    place: Any = data
    for part in path:
        place = _step(place, part, field)
    if isinstance(place, list):
        entries = cast(list[Any], place)
        k = _index(entries, last, field)
        entries[k] = replaced(entries[k], value)
    elif isinstance(place, dict):
        table = cast(dict[str, Any], place)
        table[last] = replaced(table.get(last), value)
    else:
        raise ScenarioError(f"{short(field)} is unknown: {short('.'.join(path))} is a value, not a table")


def leaves(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values by the field names of ``assign``, instead of nested tables."""
    values: dict[str, Any] = {}
    for key, value in data.items():
        table = isinstance(value, dict)
        values |= leaves(cast(dict[str, Any], value), f"{prefix}{key}.") if table else {prefix + key: value}
    return values


def override_of(overrides: Mapping[str, object], field: str) -> object | None:
    """The override of a field, by its dotted name or in its section's table; None if there is none."""
    section, _, name = field.partition(".")
    table = plain(overrides.get(section)) if name else None
    inside = cast(Mapping[str, object], table).get(name) if isinstance(table, dict) else None
    return overrides.get(field, inside)


def plain(value: object) -> Any:
    """A value as plain TOML data, from types of NumPy, torch and OmegaConf too.

    Numbers, sequences and mappings are recognized by their protocols; other values stay as they are.
    """
    if callable(tolist := getattr(value, "tolist", None)):  # numbers and arrays of NumPy and torch
        value = tolist()
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, bool | str | bytes | bytearray):
        return value
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in cast(Mapping[Any, object], value).items()}
    if isinstance(value, Sequence):
        return [plain(entry) for entry in cast(Sequence[object], value)]
    to = next((to for kind, to in _PLAIN if isinstance(value, kind)), None)
    try:
        return value if to is None else to(value)
    except (OverflowError, ValueError):  # a fraction beyond all floats, a signalling NaN
        return value


def _step(place: Any, part: str, field: str) -> Any:
    if isinstance(place, list):
        entries = cast(list[Any], place)
        return entries[_index(entries, part, field)]
    if not isinstance(place, dict):
        raise ScenarioError(f"{short(field)} is unknown: {shown(part)} follows a value, not a table")
    return cast(dict[str, Any], place).setdefault(part, {})


def _index(entries: Sequence[Any], part: str, field: str) -> int:
    places = {str(k): k for k in range(len(entries))}
    tables = {k: cast(dict[str, Any], entry) for k, entry in enumerate(entries) if isinstance(entry, dict)}
    names = {str(table["name"]): k for k, table in tables.items() if "name" in table}
    index = (places | names).get(part)
    if index is None:
        known = f"use one of {', '.join(names or places)}" if entries else "the list is empty: give it as a whole"
        raise ScenarioError(f"{short(field)} is unknown: there is no entry {shown(part)}; {known}")
    return index
