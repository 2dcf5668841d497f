"""Tidy tables on disk: one CSV file each, a row per observation, the unit in the column's name."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Columns = dict[str, NDArray[Any]]
"""A table by column, all of one length; numbers or texts. NaN stands for nothing measured."""


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """A table as CSV, whole or not at all; numbers with six significant digits, nothing for NaN."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    texts = [[_text(value) for value in values.tolist()] for values in columns.values()]
    with partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*texts, strict=True))
    partial.replace(path)


def read_columns(path: Path) -> Columns:
    """A table that ``write_columns`` wrote; a column is numeric where all its entries are."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return {name: _parsed([row[k] for row in rows]) for k, name in enumerate(head)}


def stack(tables: Sequence[Columns]) -> Columns:
    """Tables of the same columns, one below the other."""
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def _text(value: object) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else f"{value:.6g}"
    return str(value)


def _parsed(values: Sequence[str]) -> NDArray[Any]:
    try:
        return np.array([float(value) if value else np.nan for value in values])
    except ValueError:
        return np.array(values, dtype=np.str_)
