"""Messages on what is wrong with a scenario: one line of ours for each of pydantic's errors."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast, get_args, get_origin

from uuv_marl.errors import nearest
from uuv_marl.scenario.scenario import Scenario

_SHOWN = 80
_EXPLANATIONS = {
    "range": "{message}",
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
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "invalid_key": "must be a text",
}


def explain(error: dict[str, Any], data: Mapping[str, Any]) -> str:
    """One line of ours for one of pydantic's errors."""
    kind, got = error["type"], error["input"]
    if kind == "value_error":
        return str(error["ctx"]["error"])
    place: Any = data
    names: list[str] = []
    for part in error["loc"]:
        try:
            place = cast(dict[Any, Any], place)[part]
        except (KeyError, IndexError, TypeError):
            place = None
        name = cast(dict[str, Any], place).get("name") if isinstance(part, int) and isinstance(place, dict) else None
        names.append(str(name or part))
    field = short(".".join(names)) or "''"
    if kind == "missing":
        return f"{field} is missing; set it in the scenario's file or override it"
    if kind == "extra_forbidden":
        return f"{field} is unknown{_nearest(error['loc'])}"
    explanation = _EXPLANATIONS.get(kind, "is not usable: {message}")
    return f"{field} {explanation.format(**error.get('ctx', {}), message=error['msg'])}, got {shown(got)}"


def _nearest(location: Sequence[str | int]) -> str:
    """What an unknown field may mean: the same name elsewhere, else a like one here, else a like one elsewhere."""
    last, prefix = str(location[-1]), "".join(f"{0 if isinstance(part, int) else part}." for part in location[:-1])
    every = list(_fields(Scenario))
    here = dict.fromkeys(field.removeprefix(prefix).partition(".")[0] for field in every if field.startswith(prefix))
    leaves = {field.rpartition(".")[2]: field for field in reversed(every)}
    location_text = ".".join(map(str, (*location[:-1], "")))
    near = [leaves[last]] if last in leaves else _like(last, {name: location_text + name for name in here})
    near = near or _like(last, leaves)
    return f"; did you mean {near[0]!r}?" if near else f"; the fields here are {', '.join(here)}"


def _like(name: str, names: Mapping[str, str]) -> list[str]:
    """What stands beside the name that is most like this one, if there is any."""
    near = nearest(name, names, 0.5)
    return [names[near]] if near else []


def _fields(model: Any, prefix: str = "") -> Iterator[str]:
    """All fields of a scenario as overrides address them; the first entry stands for a list's."""
    for name, info in model.model_fields.items():
        kind = info.annotation
        inner = [part for part in (kind, *get_args(kind)) if hasattr(part, "model_fields")]
        place = f"{prefix}{name}.0." if get_origin(kind) is tuple else f"{prefix}{name}."
        yield from _fields(inner[0], place) if inner else [prefix + name]


def shown(value: object) -> str:
    """A value as a message can hold it."""
    try:
        return short(repr(value))
    except (ValueError, RecursionError):
        return f"{type(value).__name__} that is too large to show"


def short(text: str) -> str:
    """A text as a message can hold it."""
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
