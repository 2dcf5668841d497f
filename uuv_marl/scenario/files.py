"""Scenarios from names, TOML files and overrides, with errors that name the field, the value and the remedy."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import tomlkit
from pydantic import ValidationError

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario.documents import File, items, merged, read_toml
from uuv_marl.scenario.fields import NAME
from uuv_marl.scenario.messages import explain, shown
from uuv_marl.scenario.overrides import assign, leaves, plain
from uuv_marl.scenario.scenario import Scenario
from uuv_marl.scenario.vehicle_files import load_vehicle, optional_defaults, vehicle_file

_FOLDER = Path(__file__).resolve().parent
_BASE = _FOLDER / "base.toml"


def scenario_names() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml") if path != _BASE)


def load_scenario(
    scenario: UserPath | Scenario | Mapping[str, object],
    *,
    num_vehicles: int | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Scenario:
    """Load a scenario by name or from a TOML file, or change another.

    Args:
        scenario: a shipped name (``scenario_names()``), a path ending in ``.toml``, a ``Scenario``, or a dictionary of
            all fields as ``Scenario.model_dump`` returns it. A file states only its differences from the scenario named
            by ``extends``, else from ``base.toml``.
        num_vehicles: replaces ``swarm.num_vehicles``.
        overrides: ``{"sonar.echo_reports": "surface", "sonar.arrays.bow.range_m": 80.0}``; entries of lists are
            addressed by name or index. A table changes only its fields, a list is replaced. Values may be those of
            NumPy, torch or OmegaConf. ``{"vehicle": "lauv"}`` replaces the vehicle, its limits and lags, and
            ``{"vehicle": "remus100+munk_on"}`` selects a variant of it; where the scenario fixes the inner loop for all
            policies (``timing.fixed``), another vehicle has none unless an override sets it.

    Raises:
        ScenarioError: names the field, the value and the remedy.
    """
    if not isinstance(cast(object, overrides), Mapping | None):
        raise ScenarioError(f"overrides must be a dictionary of fields and values, got {shown(overrides)}")
    data: dict[str, Any] = {}
    try:
        data = _data(scenario)
        # Whole tables before their entries, and a vehicle before its numbers, however they are ordered.
        ordered = sorted((overrides or {}).items(), key=lambda one: (str(one[0]) != "vehicle", str(one[0]).count(".")))
        for field, value in ((str(field), plain(value)) for field, value in ordered):
            if field == "vehicle" and isinstance(value, str):
                data = _without_foreign_loop(merged(data, load_vehicle(value)), data)
                continue
            if field == "vehicle" and (below := optional_defaults(value)):
                data["vehicle"] = below
            assign(data, field, value)
        if num_vehicles is not None:
            assign(data, "swarm.num_vehicles", plain(num_vehicles))
        return Scenario.model_validate(frozen(data))
    except ValidationError as error:
        raise ScenarioError(explain(error, data, Scenario, most=10)) from None
    except RecursionError:
        raise ScenarioError(
            f"scenario {shown(scenario)} or its overrides are nested too deeply; flatten them"
        ) from None


def to_toml(scenario: Scenario) -> str:
    """The complete scenario as TOML that ``load_scenario`` reads."""
    data = scenario.model_dump(mode="json", exclude_none=True, exclude={"name"})
    return tomlkit.dumps(data)  # pyright: ignore[reportUnknownMemberType]


def differences(scenario: Scenario) -> list[str]:
    """``field=value`` for every difference from the shipped scenario of the same name, or every field without one."""
    shipped = load_scenario(scenario.name) if scenario.name in scenario_names() else None
    before = leaves(shipped.model_dump(mode="json")) if shipped else {}
    now = leaves(scenario.model_dump(mode="json"))
    changed = [f"{field}={value}" for field, value in now.items() if before.get(field) != value]
    return changed + [f"{field} removed" for field in before if field not in now]


def show(name: UserPath) -> str:
    """A scenario's complete TOML with the source of every number: its comment, or the user's file that sets it."""
    document = tomlkit.parse(to_toml(load_scenario(name)))
    sources: dict[str, str] = {}
    for file in _layers(_find(name)):
        if optional_defaults(file.data.get("vehicle")) is not None:
            sources = {field: source for field, source in sources.items() if not field.startswith("vehicle.")}
        own = "" if file.path.is_relative_to(_FOLDER) else f"# {file.path.name}"
        stated = {field: item.trivia.comment or own for field, item in items(tomlkit.parse(file.text))}
        for prefix in ("", *(f"variants.{name}." for name in file.variants)):
            sources |= {field.removeprefix(prefix): stated[field] for field in stated if field.startswith(prefix)}
    for field, item in items(document):
        if "." in field and sources.get(field):
            item.trivia.comment_ws, item.trivia.comment = "  ", sources[field]
    return tomlkit.dumps(document)  # pyright: ignore[reportUnknownMemberType]


def _find(name: Any, beside: Path | None = None) -> Path:
    if not isinstance(name, str | os.PathLike):
        raise ScenarioError(f"scenario must be a name, a path ending in .toml, or a Scenario, got {shown(name)}")
    text = os.fsdecode(cast(str, name))
    if text.endswith(".toml"):
        path = (beside or Path()) / user_path(text)
        if not os.path.isfile(path):  # noqa: PTH113 - says no to names that no file can have
            raise ScenarioError(
                f"scenario file {shown(text)} does not exist; give the path of a TOML file, or a name: "
                f"{', '.join(scenario_names())}"
            )
        return path
    if text in scenario_names():
        return _FOLDER / f"{text}.toml"
    raise ScenarioError(
        f"scenario {shown(text)} is unknown; {hint(text, scenario_names())}give one of {', '.join(scenario_names())}, "
        "or a path ending in .toml"
    )


def _layers(path: Path, above: tuple[Path, ...] = ()) -> Iterator[File]:
    """The base, the files that extend it, and the file itself; before each the vehicle that it names."""
    file, chain = read_toml(path), (*above, path)
    if not path.samefile(_BASE):
        name = file.data.get("extends")
        if not isinstance(name, str | None):
            raise ScenarioError(f"{path}: extends must be a scenario's name or file, got {shown(name)}")
        parent = _BASE if name is None else _find(name, path.parent)
        if any(parent.samefile(each) for each in chain):
            raise ScenarioError(f"{path}: extends must not lead back to {parent}; name another scenario")
        yield from _layers(parent, chain)
    if isinstance(file.data.get("vehicle"), str):
        yield vehicle_file(file.data.pop("vehicle"), path.parent)
    yield file


def _data(scenario: Any) -> dict[str, Any]:
    """A scenario's fields and values, not yet validated."""
    if isinstance(scenario, Scenario | Mapping):
        return plain(cast(object, scenario))
    path = _find(scenario)
    if not re.fullmatch(NAME, path.stem):
        raise ScenarioError(
            f"scenario file {shown(path.name)} must have a name of letters, digits, _ and - only, since it is the "
            "scenario's name; rename the file"
        )
    data: dict[str, Any] = {}
    for file in _layers(path):
        before, below = data, optional_defaults(file.data.get("vehicle"))
        if below is not None:
            data = {**data, "vehicle": below}
        data = _without_foreign_loop(merged(data, file.data), before)
    data.pop("extends", None)
    return {**data, "name": path.stem}


def _without_foreign_loop(data: dict[str, Any], before: dict[str, Any]) -> dict[str, Any]:
    """The data; a fixed inner loop is set to 0 if the vehicle differs from ``before``."""
    names = [each.get("vehicle", {}).get("name") for each in (before, data)]
    if data.get("timing", {}).get("fixed") and None not in names and names[0] != names[1]:
        data["actuators"]["yaw_damping_nms"] = 0.0
    return data


def frozen(value: Any) -> Any:
    """A document's value with tuples in place of lists."""
    if isinstance(value, dict):
        return {key: frozen(entry) for key, entry in cast(dict[str, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return tuple(frozen(entry) for entry in cast(Sequence[Any], value))
    return value
