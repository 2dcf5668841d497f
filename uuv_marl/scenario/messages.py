"""Messages for pydantic's validation errors, and values as messages show them."""

from collections.abc import Iterator, Sequence
from typing import Any, cast, get_args, get_origin

from pydantic import BaseModel, ValidationError

from uuv_marl.errors import nearest

_SHOWN = 80
_EXPLANATIONS = {
    "tuple_type": "must be a list",
    "string_pattern_mismatch": "must hold letters, digits, _ and - only",
    "model_type": "must be a table of fields",
    "too_short": "must have at least {min_length} entries",
    "too_long": "must have at most {max_length} entries",
}
"""Words for kinds of errors that pydantic words as errors of Python's types."""


def explain(
    error: ValidationError, data: object, model: type[BaseModel] | None = None, prefix: str = "", most: int = 1
) -> str:
    """Messages for the first of pydantic's errors, one a line: the field, its value and the remedy.

    Args:
        error: raised by a validation.
        data: the validated data, for names of list entries.
        model: the validated model, whose fields are suggested in place of an unknown one.
        prefix: of the fields in messages, such as ``task.``.
        most: largest number of lines.
    """
    fields = list(_fields(model)) if model else []
    return "\n".join(_line(dict(each), data, fields, prefix) for each in error.errors()[:most])


def _line(error: dict[str, Any], data: object, fields: Sequence[str], prefix: str) -> str:
    kind, names = error["type"], list[str]()
    place: Any = data
    for part in error["loc"]:
        try:
            place = cast(dict[Any, Any], place)[part]
        except (KeyError, IndexError, TypeError):
            place = None
        name = cast(dict[str, Any], place).get("name") if isinstance(part, int) and isinstance(place, dict) else None
        names.append(str(name or part))
    field = short(prefix + ".".join(names)) or "''"
    if kind == "value_error":
        reason = str(error["ctx"]["error"])
        return f"{field} {reason}" if reason.startswith("must ") else reason
    if not error["loc"]:
        return str(error["msg"])
    if kind == "missing":
        return f"{field} is missing; give it a value"
    if kind == "extra_forbidden":
        return f"{field} is unknown{_nearest(error['loc'], fields, prefix)}"
    _, should, demand = str(error["msg"]).partition(" should ")
    explanation = _EXPLANATIONS.get(kind, "must {demand}" if should else "is not usable: {message}")
    text = explanation.format(**error.get("ctx", {}), message=error["msg"], demand=demand)
    return f"{field} {text}, got {shown(error['input'])}"


def _nearest(location: Sequence[str | int], fields: Sequence[str], prefix: str) -> str:
    """Suggestion for an unknown field: a similar name here, else anywhere."""
    last, table = str(location[-1]), "".join(f"{0 if isinstance(part, int) else part}." for part in location[:-1])
    here = dict.fromkeys(field.removeprefix(table).partition(".")[0] for field in fields if field.startswith(table))
    known = {field.rpartition(".")[2]: prefix + field for field in reversed(fields)}
    known |= {name: prefix + ".".join(map(str, (*location[:-1], name))) for name in here}
    near = nearest(last, here, 0.5) or nearest(last, known, 0.5)
    return f"; did you mean {known[near]!r}?" if near else f"; the fields here are {', '.join(here) or 'none'}"


def _fields(model: Any, prefix: str = "") -> Iterator[str]:
    """All fields of a model as overrides address them; index 0 stands for every entry of a list."""
    for name, info in model.model_fields.items():
        kind = info.annotation
        inner = [part for part in (kind, *get_args(kind)) if hasattr(part, "model_fields")]
        place = f"{prefix}{name}.0." if get_origin(kind) is tuple else f"{prefix}{name}."
        yield from _fields(inner[0], place) if inner else [prefix + name]


def shown(value: object) -> str:
    """A value as text of bounded length."""
    try:
        return short(repr(value))
    except (ValueError, RecursionError):
        return f"{type(value).__name__} too large to show"


def short(text: str) -> str:
    """A text of bounded length."""
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
