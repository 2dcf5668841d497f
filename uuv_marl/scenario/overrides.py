"""Fields of a scenario by name: ``field=value`` on the command line, and where in nested tables a field lies."""

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
"""Kinds of values, and what makes them plain."""


def parse_override(text: str) -> tuple[str, object]:
    """``field=value`` as the command line gives it; the value in TOML, a bare word taken as text."""
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
                f"--set {shown(field.strip())} is no list or table of TOML, got {shown(value.strip())}; texts in it "
                'need quotes: \'task.kinds=["pocket", "bar"]\''
            ) from None
        return field.strip(), value.strip()
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"--set {shown(field.strip())} can't be read: {error}; give a plain value") from None


def assign(data: dict[str, Any], field: str, value: Any) -> None:
    """Set a field of nested tables: its keys with dots between, an entry of a list by name or index, in place.

    A table changes the fields that it has and leaves the others, as a table of a file does; a list is replaced.

    Raises:
        ScenarioError: a key lies in what is no table, or there is no such entry.
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
    """Fields by the names that ``assign`` takes, instead of tables within tables."""
    values: dict[str, Any] = {}
    for key, value in data.items():
        table = isinstance(value, dict)
        values |= leaves(cast(dict[str, Any], value), f"{prefix}{key}.") if table else {prefix + key: value}
    return values


def override_of(overrides: Mapping[str, object], field: str) -> object | None:
    """What overrides give a field, by its name with a dot or in its section's table; None if nothing."""
    section, _, name = field.partition(".")
    table = plain(overrides.get(section)) if name else None
    inside = cast(Mapping[str, object], table).get(name) if isinstance(table, dict) else None
    return overrides.get(field, inside)


def plain(value: object) -> Any:
    """A value as TOML would give it, in tables and lists of its own: NumPy's, torch's and OmegaConf's are as good.

    Numbers, sequences and mappings are taken for what they can do, and any other value as it is.
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
