"""Tidy tables on disk: one CSV file each, a row per observation, the unit in the column's name."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.atomic import replacing

Columns = dict[str, NDArray[Any]]
"""A table by column, all of one length; numbers or texts. NaN stands for nothing measured."""
_DIGITS = 6


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """A table as CSV, whole or not at all: texts in quotes, numbers with six significant digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cells = [[_written(value) for value in values.tolist()] for values in columns.values()]
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))


def read_columns(path: Path) -> Columns:
    """A table that ``write_columns`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file, quoting=csv.QUOTE_NONNUMERIC)
    return {name: np.array([row[k] for row in rows]) for k, name in enumerate(head)}


def stack(tables: Sequence[Columns]) -> Columns:
    """Tables of the same columns, one below the other."""
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def _written(value: Any) -> str | float | int:
    if isinstance(value, bool):
        return int(value)
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
