"""Episodes as rows of a CSV file, compressed if its name ends in .gz; pages are written from them."""

import csv
import gzip
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from uuv_marl.atomic import replacing
from uuv_marl.benchmark.metrics import Metrics

Row = Mapping[str, str]
"""Cells of an episode by column; empty where the value does not exist."""


def cells(metrics: Metrics, names: Sequence[str], digits: str) -> dict[str, str]:
    """Metrics, also the task's own, as texts with ``digits`` such as ``.6g``."""
    metric_values: dict[str, Any] = {**metrics, **metrics.get("task", {})}
    values = {name: metric_values[name] for name in names}
    return {k: "" if v is None else f"{v:{digits}}" if isinstance(v, float) else str(v) for k, v in values.items()}


def write_rows(path: Path, rows: Iterable[Row]) -> None:
    """Write rows, at least one, atomically; the same rows give the same bytes."""
    table, text = list(rows), io.StringIO(newline="")
    writer = csv.DictWriter(text, table[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    path.parent.mkdir(parents=True, exist_ok=True)
    data = text.getvalue().encode()
    with replacing(path) as partial:
        partial.write_bytes(gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def read_text(path: Path) -> str:
    """The text of a file of rows. Raises OSError, EOFError or ValueError where it can't be read."""
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode()


def read_rows(path: Path) -> list[Row]:
    """Read the file of ``write_rows``."""
    return list(csv.DictReader(io.StringIO(read_text(path), newline="")))


def measured(rows: Iterable[Row], name: str) -> list[float]:
    """Values of a column in the rows that have one."""
    return [float(row[name]) for row in rows if row[name]]


def short(share: float) -> str:
    """Two decimals without a leading zero."""
    digits = f"{abs(share):.2f}".removeprefix("0")
    return f"-{digits}" if share < 0.0 and digits != ".00" else digits


def succeeded(row: Row) -> bool:
    """Whether the swarm arrives without a collision."""
    return bool(row["task_time_s"]) and row["collisions"] == "0"


def grouped(rows: Iterable[Row], *names: str) -> dict[tuple[str, ...], list[Row]]:
    """The rows by their values in these columns, in the order of first appearance."""
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    return groups


def select(rows: Iterable[Row], **values: str) -> list[Row]:
    """The rows that have these values."""
    return [row for row in rows if all(row[name] == value for name, value in values.items())]
