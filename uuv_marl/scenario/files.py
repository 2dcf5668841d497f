"""Scenarios from names, TOML files and overrides, with errors that name the field, the value and the remedy."""

import difflib
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import Any, NamedTuple, cast

import tomlkit
from pydantic import ValidationError
from tomlkit.container import Container
from tomlkit.items import AbstractTable

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.messages import explain, short, shown
from uuv_marl.scenario.scenario import Scenario

_FOLDER = Path(__file__).resolve().parent
_BASE = _FOLDER / "base.toml"
_VEHICLES = _FOLDER / "vehicles"
_MAX_BYTES = 1_000_000
_GIVEN = {"vehicle": set(Vehicle.model_fields), "actuators": {"max_force_n", "max_torque_nm", "lever_arm_m"}}
_OPTIONAL: dict[str, dict[str, Any]] = {
    section: {name: field.default for name, field in model.model_fields.items() if not field.is_required()}
    for section, model in (("vehicle", Vehicle), ("actuators", Actuators))
}
_OPTIONAL["actuators"] |= {"thrust_lag_s": 0.0, "yaw_lag_s": 0.0}
"""What a vehicle's file may leave out, and what it is then, whatever vehicle there was before."""


def scenario_names() -> list[str]:
    """Names of the scenarios that ship with the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml") if path != _BASE)


def vehicle_names() -> list[str]:
    """Names of the vehicles that ship with the package."""
    return sorted(path.stem for path in _VEHICLES.glob("*.toml"))


def load_vehicle(name: str) -> dict[str, dict[str, Any]]:
    """A vehicle's sections ``vehicle`` and ``actuators``, by name or TOML file, or a variant: ``remus100+munk_on``.

    Raises:
        ScenarioError: there is no such vehicle or variant, or its file is broken.
    """
    return _vehicle(name).data


def variant_names(vehicle: str) -> list[str]:
    """Variants that a vehicle's file has: other numbers where sources disagree. ``vehicle`` as for ``load_vehicle``."""
    return sorted(_parse(_find_vehicle(_without_variants(vehicle)[0])).data.get("variants", {}))


def show_vehicle(name: str) -> str:
    """A vehicle's file, with the source of every number; where variants are named, with theirs.

    Args:
        name: as for ``load_vehicle``.

    Raises:
        ScenarioError: there is no such vehicle or variant, or its file is broken.
    """
    file = _vehicle(name)
    document = tomlkit.parse(file.text)
    if file.variants:
        changed = _variant_comments(file)
        del document["variants"]
        for section, fields in file.data.items():
            table: Any = document[section]
            for field, value in fields.items():
                if f"{section}.{field}" in changed:
                    item = cast(Any, tomlkit).item(value)
                    table[field] = item.comment(changed[f"{section}.{field}"].lstrip("# "))
        document["vehicle"]["name"] = file.data["vehicle"]["name"]  # pyright: ignore[reportIndexIssue] - a table
    return tomlkit.dumps(document).rstrip("\n") + "\n"  # pyright: ignore[reportUnknownMemberType]


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
            addressed by their name or index. ``{"vehicle": "lauv"}`` replaces the vehicle, its limits and lags, and
            ``{"vehicle": "remus100+munk_on"}`` takes a variant of it.

    Raises:
        ScenarioError: names the field, the value and the remedy.
    """
    if not isinstance(cast(object, overrides), Mapping | None):
        raise ScenarioError(f"overrides must be a dictionary of fields and values, got {shown(overrides)}")
    data: dict[str, Any] = {}
    try:
        data = _data(scenario)
        for field, value in (overrides or {}).items():
            if field == "vehicle" and isinstance(value, str):
                data = _merged(data, load_vehicle(value))
            else:
                _assign(data, str(field), value)
        if num_vehicles is not None:
            whole = isinstance(cast(object, num_vehicles), Integral) and not isinstance(num_vehicles, bool)
            _assign(data, "swarm.num_vehicles", int(num_vehicles) if whole else num_vehicles)
        return Scenario.model_validate(_frozen(data))
    except ValidationError as error:
        raise ScenarioError("\n".join(explain(dict(e), data) for e in error.errors()[:10])) from None
    except RecursionError:
        raise ScenarioError(
            f"scenario {shown(scenario)} or its overrides are nested too deeply; flatten them"
        ) from None


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
    """A scenario's complete TOML with the source of every number: its comment, or the user's file that sets it."""
    document = tomlkit.parse(to_toml(load_scenario(name)))
    sources: dict[str, str] = {}
    for file in _layers(_find(name)):
        own = "" if file.path.is_relative_to(_FOLDER) else f"# {file.path.name}"
        sources |= {field: item.trivia.comment or own for field, item in _items(tomlkit.parse(file.text))}
        sources |= _variant_comments(file)
    for field, item in _items(document):
        if "." in field and sources.get(field):
            item.trivia.comment_ws, item.trivia.comment = "  ", sources[field]
    return tomlkit.dumps(document)  # pyright: ignore[reportUnknownMemberType]


def _items(table: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a parsed table with its field; entries of lists of tables by their index."""
    for key, item in (table if isinstance(table, Container) else table.value).body:
        if key is None:
            continue
        field = prefix + key.key
        if isinstance(item, AbstractTable):
            yield from _items(item, f"{field}.")
        elif isinstance(item, list) and item and isinstance(item[0], AbstractTable):
            for k, entry in enumerate(cast(list[Any], item)):
                yield from _items(entry, f"{field}.{k}.")
        else:
            yield field, item


def _variant_comments(file: "_File") -> dict[str, str]:
    """Comments of what the chosen variants of a vehicle change, by field."""
    every = dict(_items(tomlkit.parse(file.text)))
    return {
        field.removeprefix(f"variants.{name}."): item.trivia.comment
        for name in file.variants
        for field, item in every.items()
        if field.startswith(f"variants.{name}.")
    }


class _File(NamedTuple):
    path: Path
    text: str
    data: dict[str, Any]
    variants: Sequence[str] = ()
    """Those that are chosen, of a vehicle's file."""


def _find(name: Any, beside: Path | None = None) -> Path:
    if not isinstance(name, str | os.PathLike):
        raise ScenarioError(f"scenario must be a name, a path ending in .toml, or a Scenario, got {shown(name)}")
    text = os.fsdecode(cast(str, name))
    if text.endswith(".toml"):
        path = (beside or Path()) / text
        if not os.path.isfile(path):  # noqa: PTH113 - says no to names that no file can have
            raise ScenarioError(
                f"scenario file {shown(text)} does not exist; give the path of a TOML file, or a name: "
                f"{', '.join(scenario_names())}"
            )
        return path
    if text in scenario_names():
        return _FOLDER / f"{text}.toml"
    near = difflib.get_close_matches(text, scenario_names(), n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ScenarioError(
        f"scenario {shown(text)} is unknown; {hint}give one of {', '.join(scenario_names())}, or a path ending in .toml"
    )


def _vehicle(name: str, beside: Path | None = None) -> _File:
    """A vehicle's file, which must be complete: numbers of two vehicles are never mixed without a word."""
    plain, chosen = _without_variants(name)
    file = _parse(_find_vehicle(plain, beside))
    for section, fields in _GIVEN.items():
        given = file.data.get(section)
        needed = fields - _OPTIONAL[section].keys()
        missing = sorted(needed - set(cast(dict[str, Any], given) if isinstance(given, dict) else ()))
        if missing:
            raise ScenarioError(f"vehicle {file.path} lacks {section}.{missing[0]}; a vehicle's file gives all numbers")
    other = next((key for key in file.data if key not in {*_GIVEN, "variants"}), None)
    if other is not None:
        raise ScenarioError(
            f"vehicle {file.path} holds {shown(other)}; it may hold vehicle and actuators only, and variants of them"
        )
    data = {section: {**_OPTIONAL[section], **file.data[section]} for section in _GIVEN}
    for variant in chosen:
        data = _merged(data, _variant(file, variant))
    if chosen:
        data["vehicle"]["name"] = "+".join([str(data["vehicle"]["name"]), *chosen])
    return file._replace(data=data, variants=chosen)


def _variant(file: _File, name: str) -> dict[str, Any]:
    """What a variant of a vehicle changes."""
    every = file.data.get("variants", {})
    variants = cast(dict[str, Any], every) if isinstance(every, dict) else {}
    changes = variants.get(name)
    if changes is None:
        there = f"it has {', '.join(variants)}" if variants else "it has none"
        raise ScenarioError(f"vehicle {file.path.stem} has no variant {shown(name)}; {there}")
    if not isinstance(changes, dict) or not all(
        isinstance(part, dict) for part in cast(dict[str, Any], changes).values()
    ):
        raise ScenarioError(
            f"vehicle {file.path}: variants.{short(name)} must hold tables, such as [variants.{short(name)}.vehicle]"
        )
    other = next((key for key in cast(dict[str, Any], changes) if key not in _GIVEN), None)
    if other is not None:
        raise ScenarioError(
            f"vehicle {file.path}: variants.{short(name)} holds {shown(other)}; it may hold vehicle and actuators only"
        )
    return cast(dict[str, Any], changes)


def _without_variants(name: str) -> tuple[str, list[str]]:
    """A vehicle's name or file, and the variants that follow it: a plus before each."""
    file, toml, after = name.rpartition(".toml")
    if toml and (not after or after.startswith("+")):
        return file + toml, after.split("+")[1:]
    plain, *variants = name.split("+")
    return plain, variants


def _find_vehicle(name: str, beside: Path | None = None) -> Path:
    path = (beside or Path()) / name if name.endswith(".toml") else _VEHICLES / f"{name}.toml"
    if name in vehicle_names() or (name.endswith(".toml") and path.is_file()):
        return path
    near = difflib.get_close_matches(name, vehicle_names(), n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ScenarioError(
        f"vehicle {shown(name)} is unknown; {hint}give one of {', '.join(vehicle_names())}, or a path ending in .toml"
    )


def _parse(path: Path) -> _File:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise ScenarioError(f"{path} is no scenario: it has more than {_MAX_BYTES:,} bytes")
        text = path.read_text(encoding="utf-8")
        return _File(path, text, tomllib.loads(text))
    except OSError as error:
        raise ScenarioError(f"{path} can't be read ({error.strerror}); give another file") from None
    except RecursionError:
        raise ScenarioError(f"{path} is nested too deeply; flatten it") from None
    except ScenarioError:
        raise
    except ValueError as error:
        raise ScenarioError(f"{path} is not valid TOML: {error}") from None


def _chain(path: Path) -> list[_File]:
    """The file and all that it extends, down to the base."""
    chain = [_parse(path)]
    while not chain[-1].path.samefile(_BASE):
        last = chain[-1]
        name = last.data.get("extends")
        if not isinstance(name, str | None):
            raise ScenarioError(f"{last.path}: extends must be a scenario's name or file, got {shown(name)}")
        parent = _BASE if name is None else _find(name, last.path.parent)
        if any(parent.samefile(file.path) for file in chain):
            raise ScenarioError(f"{path}: extends must not lead back to {parent}; name another scenario")
        chain.append(_parse(parent))
    return chain


def _layers(path: Path) -> Iterator[_File]:
    """The base, what extends it, and the file itself; before each the vehicle that it names."""
    for file in reversed(_chain(path)):
        named = file.data.get("vehicle")
        if isinstance(named, str):
            yield _vehicle(named, file.path.parent)
            file.data.pop("vehicle")
        yield file


def _data(scenario: Any) -> dict[str, Any]:
    """A scenario's fields and values, not yet checked."""
    if isinstance(scenario, Scenario):
        return scenario.model_dump(mode="json", exclude_none=True)
    path = _find(scenario)
    data: dict[str, Any] = {}
    for file in _layers(path):
        data = _merged(data, file.data)
    data.pop("extends", None)
    return {**data, "name": path.stem}


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
        raise ScenarioError(f"{short(field)} is unknown: {short('.'.join(path))} is a value, not a table")


def _step(place: Any, part: str, field: str) -> Any:
    if isinstance(place, list):
        entries = cast(list[Any], place)
        return entries[_index(entries, part, field)]
    if not isinstance(place, dict):
        raise ScenarioError(f"{short(field)} is unknown: a value comes before {shown(part)}")
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


def _frozen(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in cast(dict[str, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return tuple(_frozen(entry) for entry in cast(Sequence[Any], value))
    return value
