"""Scenarios from names, TOML files and overrides, with errors that name the field, the value and the remedy."""

import difflib
import os
import tomllib
from collections.abc import Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import Any, cast

import tomlkit
from pydantic import ValidationError
from tomlkit.container import Container
from tomlkit.items import Array, Item, Table

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario import Scenario

_FOLDER = Path(__file__).resolve().parent / "scenarios"
_BASE = "base"
_EXPLANATIONS = {
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be a text",
    "tuple_type": "must be a list",
    "literal_error": "must be {expected}",
    "string_pattern_mismatch": "must hold letters, digits, _ and - only",
    "model_type": "must be a table of fields",
    "too_short": "must have at least {min_length} entries",
    "too_long": "must have at most {max_length} entries",
}


def scenario_names() -> list[str]:
    """Names of the scenarios that ship with the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml") if path.stem != _BASE)


def load_scenario(
    scenario: str | os.PathLike[str] | Scenario,
    *,
    num_vehicles: int | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Scenario:
    """A scenario by name, from a TOML file, or changed from another.

    Args:
        scenario: a shipped name (``scenario_names()``), a path ending in ``.toml``, or a ``Scenario``.
            A file states only what differs from the scenario named by its ``extends``, else from ``base.toml``.
        num_vehicles: replaces ``swarm.num_vehicles``.
        overrides: ``{"sonar.echo_reports": "surface", "sonar.arrays.bow.range_m": 80.0}``; entries of lists are
            addressed by their name or index.

    Raises:
        ScenarioError: names the field, the value and the remedy.
    """
    if isinstance(scenario, Scenario):
        data = scenario.model_dump(mode="json", exclude_none=True)
    else:
        path = _find(scenario)
        data = {**_read(path), "name": path.stem}
    for field, value in (overrides or {}).items():
        _assign(data, field, value)
    if num_vehicles is not None:
        _assign(data, "swarm.num_vehicles", int(num_vehicles) if isinstance(num_vehicles, Integral) else num_vehicles)
    try:
        return Scenario.model_validate(_frozen(data))
    except ValidationError as error:
        raise ScenarioError("\n".join(_explain(dict(e), data) for e in error.errors())) from None


def parse_override(text: str) -> tuple[str, object]:
    """``field=value`` as the command line gives it; the value in TOML, a bare word taken as text."""
    field, equals, value = text.partition("=")
    if not equals or not field.strip():
        raise ScenarioError(f"--set must look like field=value, got {text!r}; for instance swarm.num_vehicles=20")
    try:
        parsed: object = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    return field.strip(), parsed


def to_toml(scenario: Scenario) -> str:
    """The whole scenario as TOML that ``load_scenario`` reads back."""
    data = scenario.model_dump(mode="json", exclude_none=True, exclude={"name"})
    return tomlkit.dumps(data)  # pyright: ignore[reportUnknownMemberType]


def differences(scenario: Scenario) -> list[str]:
    """``field=value`` wherever a scenario differs from the shipped one of its name; everything where there is none."""
    shipped = load_scenario(scenario.name) if scenario.name in scenario_names() else None
    before = _leaves(shipped.model_dump(mode="json")) if shipped else {}
    now = _leaves(scenario.model_dump(mode="json"))
    changed = [f"{field}={value}" for field, value in now.items() if before.get(field) != value]
    return changed + [f"{field} removed" for field in before if field not in now]


def _leaves(data: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    leaves: dict[str, object] = {}
    for key, value in data.items():
        if isinstance(value, dict):
            leaves |= _leaves(cast(dict[str, Any], value), f"{prefix}{key}.")
        else:
            leaves[prefix + key] = value
    return leaves


def show(name: str | os.PathLike[str]) -> str:
    """A scenario's complete TOML with the source of every number, its own values over those that all share."""
    load_scenario(name)  # says what is wrong, where something is
    document = tomlkit.parse((_FOLDER / f"{_BASE}.toml").read_text(encoding="utf-8"))
    title = tomlkit.document()
    for path in reversed(_chain(_find(name))):
        if path.stem != _BASE:
            _overlay(cast(Container, document), cast(Container, tomlkit.parse(path.read_text(encoding="utf-8"))), title)
    return tomlkit.dumps(title) + "\n" + tomlkit.dumps(document)  # pyright: ignore[reportUnknownMemberType]


def _overlay(document: Container, changes: Container, title: Any) -> None:
    for key, item in changes.items():
        if not isinstance(item, (Table, list)) or isinstance(item, Array):
            title[key] = item
        elif isinstance(item, Table) and key in document:
            for field, value in cast(dict[str, Item], item).items():
                cast(Table, document[key])[field] = value
        else:
            document[key] = cast(Item, item)


def _find(name: str | os.PathLike[str], beside: Path | None = None) -> Path:
    text = os.fspath(name)
    if text.endswith(".toml"):
        path = (beside or Path()) / text
        if not path.is_file():
            raise ScenarioError(
                f"scenario file {text} does not exist; give the path of a TOML file, or a name: "
                f"{', '.join(scenario_names())}"
            )
        return path
    if text in scenario_names():
        return _FOLDER / f"{text}.toml"
    near = difflib.get_close_matches(text, scenario_names(), n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ScenarioError(
        f"scenario {text!r} is unknown; {hint}There are {', '.join(scenario_names())}, and any path ending in .toml"
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path} is not valid TOML: {error}") from None


def _chain(path: Path) -> list[Path]:
    """The file and all that it extends, down to the base."""
    chain = [path]
    while chain[-1] != _FOLDER / f"{_BASE}.toml":
        name = _parse(chain[-1]).get("extends")
        if not isinstance(name, str | None):
            raise ScenarioError(f"{chain[-1]}: extends must be a scenario's name or file, got {name!r}")
        parent = _FOLDER / f"{_BASE}.toml" if name is None else _find(name, chain[-1].parent)
        if parent in chain:
            raise ScenarioError(f"{path}: extends must not lead back to {parent}; name another scenario")
        chain.append(parent)
    return chain


def _read(path: Path) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for file in reversed(_chain(path)):
        data = _merged(data, _parse(file))
    data.pop("extends", None)
    return data


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Tables merge; everything else, lists included, is replaced."""
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        both = isinstance(old, dict) and isinstance(value, dict)
        result[key] = _merged(cast(dict[str, Any], old), cast(dict[str, Any], value)) if both else value
    return result


def _assign(data: dict[str, Any], field: str, value: object) -> None:
    *path, last = field.split(".")
    place: Any = data
    for part in path:
        place = _step(place, part, field)
    if isinstance(place, dict):
        cast(dict[str, Any], place)[last] = value
    elif isinstance(place, list):
        entries = cast(list[Any], place)
        entries[_index(entries, last, field)] = value
    else:
        raise ScenarioError(f"{field} is unknown: {'.'.join(path)} is a value, not a table")


def _step(place: Any, part: str, field: str) -> Any:
    if isinstance(place, list):
        entries = cast(list[Any], place)
        return entries[_index(entries, part, field)]
    if not isinstance(place, dict):
        raise ScenarioError(f"{field} is unknown: a value comes before {part!r}")
    return cast(dict[str, Any], place).setdefault(part, {})


def _index(entries: Sequence[Any], part: str, field: str) -> int:
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
    if part in names:
        return names.index(part)
    if part.isdigit() and int(part) < len(entries):
        return int(part)
    known = [name for name in names if name] or [str(k) for k in range(len(entries))]
    raise ScenarioError(f"{field} is unknown: there is no entry {part!r}; use one of {', '.join(known) or 'none'}")


def _frozen(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in cast(dict[str, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return tuple(_frozen(entry) for entry in cast(Sequence[Any], value))
    return value


def _explain(error: dict[str, Any], data: Mapping[str, Any]) -> str:
    """One line of our own for one of pydantic's errors."""
    kind, got = error["type"], error["input"]
    if kind == "value_error":
        return str(error["ctx"]["error"])
    place: Any = data
    names: list[str] = []
    for part in error["loc"]:
        try:
            place = place[part]
        except (KeyError, IndexError, TypeError):
            place = None
        name = cast(dict[str, Any], place).get("name") if isinstance(part, int) and isinstance(place, dict) else None
        names.append(str(name or part))
    field = ".".join(names)
    if kind == "missing":
        return f"{field} is missing; set it in the scenario's file or override it"
    if kind == "extra_forbidden":
        return f"{field} is unknown{_nearest(error['loc'])}"
    context = {**error.get("ctx", {})}
    if kind == "greater_than" and context["gt"] == 0:
        return f"{field} must be positive, got {got!r}"
    explanation = _EXPLANATIONS.get(kind)
    return f"{field} {explanation.format(**context) if explanation else ': ' + error['msg']}, got {got!r}"


def _nearest(location: Sequence[str | int]) -> str:
    model: Any = Scenario
    for part in location[:-1]:
        if not isinstance(part, int):
            annotation = model.model_fields[part].annotation
            inner = [a for a in getattr(annotation, "__args__", ()) if hasattr(a, "model_fields")]
            model = annotation if hasattr(annotation, "model_fields") else inner[0] if inner else model
    fields = list(model.model_fields)
    near = difflib.get_close_matches(str(location[-1]), fields, n=1, cutoff=0.5)
    return f"; did you mean {near[0]!r}?" if near else f"; the fields here are {', '.join(fields)}"
