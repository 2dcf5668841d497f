"""TOML files: text, data, and the comment beside each value."""

import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

from tomlkit.container import Container
from tomlkit.items import AbstractTable

from uuv_marl.errors import ScenarioError

_MAX_BYTES = 1_000_000


class File(NamedTuple):
    """A TOML file."""

    path: Path
    text: str
    data: dict[str, Any]
    variants: Sequence[str] = ()
    """Selected variants of a vehicle's file."""


def read_toml(path: Path) -> File:
    """Read a file. Raises ScenarioError if it can't be read, is too large or is not valid TOML."""
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise ScenarioError(f"{path} is not a scenario: it has more than {_MAX_BYTES:,} bytes")
        text = path.read_text(encoding="utf-8")
        return File(path, text, tomllib.loads(text))
    except OSError as error:
        raise ScenarioError(f"{path} can't be read ({error.strerror}); give another file") from None
    except RecursionError:
        raise ScenarioError(f"{path} is nested too deeply; flatten it") from None
    except ScenarioError:
        raise
    except ValueError as error:
        raise ScenarioError(f"{path} is not valid TOML: {error}") from None


def merged(old: Any, new: Any) -> Any:
    """The new value; two tables are merged, everything else, lists included, is replaced."""
    if not (isinstance(old, dict) and isinstance(new, dict)):
        return new
    below, above = cast(dict[str, Any], old), cast(dict[str, Any], new)
    return {**below, **{key: merged(below.get(key), value) for key, value in above.items()}}


def items(table: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a parsed table with its field; entries of lists of tables by their index."""
    for key, item in (table if isinstance(table, Container) else table.value).body:
        if key is None:
            continue
        field = prefix + key.key
        if isinstance(item, AbstractTable):
            yield from items(item, f"{field}.")
        elif isinstance(item, list) and item and isinstance(item[0], AbstractTable):
            for k, entry in enumerate(cast(list[Any], item)):
                yield from items(entry, f"{field}.{k}.")
        else:
            yield field, item
