"""Tables by column, and on disk as CSV."""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.atomic import replacing

Columns = dict[str, NDArray[Any]]
"""Columns of equal length, numbers or texts; NaN for missing values."""
_DIGITS = 6


def columns(rows: Iterable[Mapping[str, Any]]) -> Columns:
    """A table from its rows, at least one."""
    table = list(rows)
    return {name: np.array([row[name] for row in table]) for name in table[0]}


def where(table: Columns, **values: object) -> Columns:
    """The rows that have these values."""
    own = np.all([table[name] == value for name, value in values.items()], axis=0)
    return {name: column[own] for name, column in table.items()}


def groups(table: Columns, *names: str) -> dict[tuple[Any, ...], Columns]:
    """The rows grouped by their values in these columns, in the order of first appearance."""
    combinations = dict.fromkeys(zip(*(table[name].tolist() for name in names), strict=True))
    return {values: where(table, **dict(zip(names, values, strict=True))) for values in combinations}


def write_columns(path: Path, table: Columns) -> None:
    """Write a table as CSV atomically: texts in quotes, numbers with six significant digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cells = [[written(value) for value in values.tolist()] for values in table.values()]
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
        writer.writerow(table)
        writer.writerows(zip(*cells, strict=True))


def read_columns(path: Path) -> Columns:
    """Read the file of ``write_columns``."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file, quoting=csv.QUOTE_NONNUMERIC)
    return {name: np.array([row[k] for row in rows]) for k, name in enumerate(head)}


def written(value: Any) -> Any:
    """The value of a cell in the file."""
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
