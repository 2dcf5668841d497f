"""Vehicles from names and TOML files, and the variants of a file where sources disagree."""

from pathlib import Path
from typing import Any, cast

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.paths import user_path
from uuv_marl.scenario.documents import File, merged, read_toml
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.messages import shown

VEHICLES = Path(__file__).resolve().parent / "vehicles"
_OPTIONAL: dict[str, dict[str, Any]] = {
    section: {name: field.default for name, field in model.model_fields.items() if not field.is_required()}
    for section, model in (("vehicle", Vehicle), ("actuators", Actuators))
}
_OPTIONAL["actuators"] |= {"thrust_lag_s": 0.0, "yaw_lag_s": 0.0}
"""Defaults of the fields that a vehicle's file may omit, independent of the previous vehicle."""
_NEEDED = {
    "vehicle": Vehicle.model_fields.keys() - _OPTIONAL["vehicle"].keys(),
    "actuators": {"max_force_n", "max_torque_nm", "lever_arm_m"},
}


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
    for section, needed in _NEEDED.items():
        missing = sorted(needed - _table(file.data.get(section)).keys())
        if missing:
            raise ScenarioError(f"vehicle {file.path} lacks {section}.{missing[0]}; add this number to the file")
    data = {key: merged(_OPTIONAL.get(key), value) for key, value in file.data.items()}
    variants = _table(data.pop("variants", {}))
    for variant in chosen:
        if not isinstance(variants.get(variant), dict):
            raise ScenarioError(
                f"vehicle {file.path.stem} has no variant {shown(variant)}; it has {', '.join(variants) or 'none'}"
            )
        data = merged(data, variants[variant])
    if other := sorted(data.keys() - _NEEDED.keys()):
        raise ScenarioError(
            f"vehicle {file.path} holds {shown(other[0])}; it may hold vehicle and actuators only, and variants of them"
        )
    if chosen:
        data["vehicle"]["name"] = "+".join([str(data["vehicle"]["name"]), *chosen])
    return file._replace(data=data, variants=chosen)


def optional_defaults(vehicle: object) -> dict[str, Any] | None:
    """Defaults of a complete vehicle's omitted fields; None for a table with only some numbers of a vehicle."""
    return dict(_OPTIONAL["vehicle"]) if _NEEDED["vehicle"] <= _table(vehicle).keys() else None


def _table(value: object) -> dict[str, Any]:
    """A table, empty in place of any other value."""
    return cast(dict[str, Any], value) if isinstance(value, dict) else {}


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
