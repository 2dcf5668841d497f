"""``heldout.md``: how often each policy arrives without a collision, written from the rows of the episodes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, grouped, measured, succeeded, write_rows
from research.heldout.figures import draw_fields
from research.heldout.sets import FIRST, GROUPS, SETS
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.style import house_style
from uuv_marl.benchmark.tables import NOTHING, markdown_table

_MAIN = "random_field"
"""The set of the second table and of the picture."""
Groups = Mapping[tuple[str, ...], Sequence[Row]]
"""Rows by policy and set."""


def write_page(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """Write ``heldout.md`` with its picture and rows; return the paths."""
    page, table = folder / "heldout.md", folder / "heldout.csv.gz"
    write_rows(table, rows)
    write_text(page, report(rows))
    with house_style():
        drawn = [row for row in rows if row["set"] == _MAIN]
        return [page, table, *([draw_fields(drawn, folder / "figures" / "heldout.png")] if drawn else [])]


def tables(rows: Sequence[Row]) -> tuple[str, str]:
    """Collision-free arrivals in each set, and measures of the episodes on random fields, as two tables."""
    groups = grouped(rows, "policy", "set")
    policies = [name for names in GROUPS.values() for name in names if any(name == policy for policy, _ in groups)]
    return _sets(groups, policies), _fields(groups, policies)


def report(rows: Sequence[Row]) -> str:
    """The page's text."""
    sets, fields = tables(rows)
    return Template(read_text("heldout", "story.md")).substitute(
        first=f"{FIRST:,}", episodes=f"{len(rows):,}", sets=sets, fields=fields
    )


def _sets(groups: Groups, policies: Sequence[str]) -> str:
    """Collision-free arrivals: a row for each policy that ran on several sets, a column for each set."""
    names = [held.name for held in SETS if any(held.name == name for _, name in groups)]
    cells = [(policy, *(_share(groups.get((policy, name), ())) for name in names)) for policy in policies]
    rows = [row for row in cells if len(names) - row.count(NOTHING) > 1 or len(names) == 1]
    return markdown_table(("policy", *(name.removeprefix("random_field_") for name in names)), rows)


def _share(mine: Sequence[Row]) -> str:
    return f"{sum(map(succeeded, mine))}/{len(mine)}" if mine else NOTHING


def _fields(groups: Groups, policies: Sequence[str]) -> str:
    """Measures of the episodes on random fields: a row for each policy."""
    rows = [(policy, *_cells(mine)) for policy in policies if (mine := groups.get((policy, _MAIN), ()))]
    head = ("policy", "arrived", "collided", "mean time [s]", "nearest obstacle [m]", "nearest vehicle [m]")
    return markdown_table(head, rows)


def _cells(mine: Sequence[Row]) -> tuple[str, ...]:
    times = measured(mine, "task_time_s")
    return (
        f"{len(times)}/{len(mine)}",
        f"{sum(row['collisions'] != '0' for row in mine)}",
        f"{np.mean(times):.1f}" if times else NOTHING,
        f"{min(measured(mine, 'min_obstacle_distance_m')):.2f}",
        f"{min(measured(mine, 'min_spacing_m')):.2f}",
    )
