"""Fields of a scenario by name: ``field=value`` on the command line, and assignment in nested tables."""

import os
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, cast

from pydantic import BaseModel

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario.documents import merged
from uuv_marl.scenario.messages import short, shown
from uuv_marl.scenario.task import named_task


def parse_override(text: str) -> tuple[str, object]:
    """Parse ``field=value`` of the command line; the value in TOML, a bare word taken as text."""
    field, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not field or "\n" in text.strip():
        raise ScenarioError(
            f"--set must look like field=value, on one line, got {shown(text)}; for instance swarm.num_vehicles=20"
        )
    try:
        return field, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        if value.startswith(("[", "{")):
            raise ScenarioError(
                f"--set {shown(field)} must be a list or table, got {shown(value)}; texts in it need quotes: "
                '\'task.kinds=["pocket", "bar"]\''
            ) from None
        return field, value
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"--set {shown(field)} can't be read: {error}; give a plain value") from None


def assign(data: dict[str, Any], field: str, value: Any) -> None:
    """Set a field of nested tables in place: keys joined by dots, an entry of a list by name or index.

    A table changes its fields and leaves the others, as a table of a file does; a list is replaced.

    Raises ScenarioError if a key is not in a table or an entry does not exist.
    """
    if field.startswith("task."):
        data["task"] = named_task(data.get("task", {}))
    _assigned(data, field.split("."), value, field)


def _assigned(place: Any, path: Sequence[str], value: Any, field: str) -> Any:
    """What a place in a document holds once the value is set, which changes tables and lists on its path."""
    if not path:
        return merged(place, value)
    if isinstance(place, list):
        entries = cast(list[Any], place)
        k = _index(entries, path[0], field)
        entries[k] = _assigned(entries[k], path[1:], value, field)
    elif isinstance(place, dict):
        table = cast(dict[str, Any], place)
        table[path[0]] = _assigned(table.get(path[0], {}), path[1:], value, field)
    else:
        raise ScenarioError(f"{short(field)} is unknown: {shown(path[0])} follows a value, not a table")
    return cast(Any, place)


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

    Sequences and mappings are recognized by their protocols; other values stay as they are.
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
    return os.fspath(cast("os.PathLike[str]", value)) if isinstance(value, os.PathLike) else value


def _index(entries: Sequence[Any], part: str, field: str) -> int:
    places = {str(k): k for k in range(len(entries))}
    tables = {k: cast(dict[str, Any], entry) for k, entry in enumerate(entries) if isinstance(entry, dict)}
    names = {str(table["name"]): k for k, table in tables.items() if "name" in table}
    index = (places | names).get(part)
    if index is None:
        known = f"use one of {', '.join(names or places)}" if entries else "the list is empty: give it as a whole"
        raise ScenarioError(f"{short(field)} is unknown: there is no entry {shown(part)}; {known}")
    return index
