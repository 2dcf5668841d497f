"""Fields of a scenario by name: ``field=value`` on the command line, and where in nested tables a field lies."""

import tomllib
from collections.abc import Sequence
from typing import Any, cast

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario.messages import short, shown


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
        return field.strip(), value.strip()
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"--set {shown(field.strip())} can't be read: {error}; give a plain value") from None


def assign(data: dict[str, Any], field: str, value: object) -> None:
    """Set a field of nested tables: its keys with dots between, an entry of a list by name or index, in place.

    Raises:
        ScenarioError: a key lies in what is no table, or there is no such entry.
    """
    *path, last = field.split(".")
    place: Any = data
    for part in path:
        place = _step(place, part, field)
    if isinstance(place, dict):
        cast(dict[str, Any], place)[last] = _copied(value)
    elif isinstance(place, list):
        entries = cast(list[Any], place)
        entries[_index(entries, last, field)] = _copied(value)
    else:
        raise ScenarioError(f"{short(field)} is unknown: {short('.'.join(path))} is a value, not a table")


def _copied(value: object) -> object:
    """Tables and lists of one's own, so that entries can be set in them."""
    if isinstance(value, dict):
        return {key: _copied(entry) for key, entry in cast(dict[str, Any], value).items()}
    return [_copied(entry) for entry in cast(list[Any], value)] if isinstance(value, list) else value


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
    found = (places | names).get(part)
    if found is None:
        known = f"use one of {', '.join(names or places)}" if entries else "the list is empty: give it as a whole"
        raise ScenarioError(f"{short(field)} is unknown: there is no entry {shown(part)}; {known}")
    return found
