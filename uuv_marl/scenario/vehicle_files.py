"""Vehicles from names and TOML files, and the variants of a file where sources disagree."""

from pathlib import Path
from typing import Any, cast

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.paths import user_path
from uuv_marl.scenario.documents import File, merged, read_toml
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.messages import short, shown

VEHICLES = Path(__file__).resolve().parent / "vehicles"
_FIELDS_BY_SECTION = {
    "vehicle": set(Vehicle.model_fields),
    "actuators": {"max_force_n", "max_torque_nm", "lever_arm_m"},
}
_OPTIONAL: dict[str, dict[str, Any]] = {
    section: {name: field.default for name, field in model.model_fields.items() if not field.is_required()}
    for section, model in (("vehicle", Vehicle), ("actuators", Actuators))
}
_OPTIONAL["actuators"] |= {"thrust_lag_s": 0.0, "yaw_lag_s": 0.0}
"""Defaults of the fields that a vehicle's file may omit, independent of the previous vehicle."""


def vehicle_names() -> list[str]:
    """Names of the shipped vehicles."""
    return sorted(path.stem for path in VEHICLES.glob("*.toml"))


def load_vehicle(name: str) -> dict[str, dict[str, Any]]:
    """Sections ``vehicle`` and ``actuators`` of a vehicle by name, TOML file or variant (``remus100+munk_on``).

    Raises ScenarioError if the vehicle or variant is unknown, or the file is invalid.
    """
    return vehicle_file(name).data


def variant_names(vehicle: str) -> list[str]:
    """Variants of a vehicle's file: other numbers where sources disagree. ``vehicle`` as for ``load_vehicle``."""
    return sorted(read_toml(_find_vehicle(_without_variants(vehicle)[0])).data.get("variants", {}))


def show_vehicle(name: str) -> str:
    """A vehicle's file, with its variants and the source of every number. ``name`` as for ``load_vehicle``."""
    return vehicle_file(name).text


def vehicle_file(name: str, beside: Path | None = None) -> File:
    """A vehicle's file, which must be complete, so that numbers of two vehicles are never mixed."""
    plain, chosen = _without_variants(name)
    file = read_toml(_find_vehicle(plain, beside))
    for section, fields in _FIELDS_BY_SECTION.items():
        table = file.data.get(section)
        needed = fields - _OPTIONAL[section].keys()
        missing = sorted(needed - set(cast(dict[str, Any], table) if isinstance(table, dict) else ()))
        if missing:
            raise ScenarioError(f"vehicle {file.path} lacks {section}.{missing[0]}; add this number to the file")
    other = next((key for key in file.data if key not in {*_FIELDS_BY_SECTION, "variants"}), None)
    if other is not None:
        raise ScenarioError(
            f"vehicle {file.path} holds {shown(other)}; it may hold vehicle and actuators only, and variants of them"
        )
    data = {section: {**_OPTIONAL[section], **file.data[section]} for section in _FIELDS_BY_SECTION}
    for variant in chosen:
        data = merged(data, _variant(file, variant))
    if chosen:
        data["vehicle"]["name"] = "+".join([str(data["vehicle"]["name"]), *chosen])
    return file._replace(data=data, variants=chosen)


def optional_defaults(vehicle: object) -> dict[str, Any] | None:
    """Defaults of a complete vehicle's omitted fields; None for a table with only some numbers of a vehicle."""
    needed = _FIELDS_BY_SECTION["vehicle"] - _OPTIONAL["vehicle"].keys()
    whole = isinstance(vehicle, dict) and needed <= cast(dict[str, Any], vehicle).keys()
    return dict(_OPTIONAL["vehicle"]) if whole else None


def _variant(file: File, name: str) -> dict[str, Any]:
    """Changes by a variant of a vehicle."""
    every = file.data.get("variants", {})
    variants = cast(dict[str, Any], every) if isinstance(every, dict) else {}
    changes = variants.get(name)
    if changes is None:
        raise ScenarioError(
            f"vehicle {file.path.stem} has no variant {shown(name)}; it has {', '.join(variants) or 'none'}"
        )
    if not isinstance(changes, dict) or not cast(dict[str, Any], changes).keys() <= _FIELDS_BY_SECTION.keys():
        raise ScenarioError(
            f"vehicle {file.path}: variants.{short(name)} must hold tables, such as [variants.{short(name)}.vehicle], "
            "of vehicle and actuators only"
        )
    return cast(dict[str, Any], changes)


def _without_variants(name: str) -> tuple[str, list[str]]:
    """A vehicle's name or file, and the variants that follow it, each after a plus."""
    file, toml, after = name.rpartition(".toml")
    if toml and (not after or after.startswith("+")):
        return file + toml, after.split("+")[1:]
    plain, *variants = name.split("+")
    return plain, variants


def _find_vehicle(name: str, beside: Path | None = None) -> Path:
    path = (beside or Path()) / user_path(name) if name.endswith(".toml") else VEHICLES / f"{name}.toml"
    if name in vehicle_names() or (name.endswith(".toml") and path.is_file()):
        return path
    raise ScenarioError(
        f"vehicle {shown(name)} is unknown; {hint(name, vehicle_names())}give one of {', '.join(vehicle_names())}, "
        "or a path ending in .toml"
    )
