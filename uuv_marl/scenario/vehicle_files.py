"""Vehicles from names and TOML files, and the variants of a file where sources disagree."""

from pathlib import Path
from typing import Any, cast

import tomlkit

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.paths import user_path
from uuv_marl.scenario.documents import File, items, merged, read_toml
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
    """A vehicle's file, with the source of every number, of named variants too. ``name`` as for ``load_vehicle``."""
    file = vehicle_file(name)
    document = tomlkit.parse(file.text)
    if file.variants:
        changed = variant_comments(file)
        del document["variants"]
        for section, fields in file.data.items():
            table: Any = document[section]
            for field, value in fields.items():
                if f"{section}.{field}" in changed:
                    item = cast(Any, tomlkit).item(value)
                    table[field] = item.comment(changed[f"{section}.{field}"].lstrip("# "))
        document["vehicle"]["name"] = file.data["vehicle"]["name"]  # pyright: ignore[reportIndexIssue] - a table
    return tomlkit.dumps(document).rstrip("\n") + "\n"  # pyright: ignore[reportUnknownMemberType]


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
        variants_text = f"it has {', '.join(variants)}" if variants else "it has none"
        raise ScenarioError(f"vehicle {file.path.stem} has no variant {shown(name)}; {variants_text}")
    if not isinstance(changes, dict) or not all(
        isinstance(part, dict) for part in cast(dict[str, Any], changes).values()
    ):
        raise ScenarioError(
            f"vehicle {file.path}: variants.{short(name)} must hold tables, such as [variants.{short(name)}.vehicle]"
        )
    other = next((key for key in cast(dict[str, Any], changes) if key not in _FIELDS_BY_SECTION), None)
    if other is not None:
        raise ScenarioError(
            f"vehicle {file.path}: variants.{short(name)} holds {shown(other)}; it may hold only vehicle and actuators"
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


def variant_comments(file: "File") -> dict[str, str]:
    """Comments of the fields that selected variants change, by field."""
    every = dict(items(tomlkit.parse(file.text)))
    return {
        field.removeprefix(f"variants.{name}."): item.trivia.comment
        for name in file.variants
        for field, item in every.items()
        if field.startswith(f"variants.{name}.")
    }
