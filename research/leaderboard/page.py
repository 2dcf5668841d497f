"""``leaderboard.md``: policies by task, from the episodes that ship and from entries."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from typing import NamedTuple

import numpy as np

from research.data import read_text
from research.episodes import Row, grouped, measured, read_rows, short
from research.leaderboard.entry import Entry, Kind, kind_of, load
from research.second import runnable
from research.tasks.page import tier_sets, with_interval
from research.tasks.studies import STUDIES
from uuv_marl.benchmark.tables import markdown_table

ENTRIES = Path(__file__).resolve().parent / "entries"
_DOCS = Path(__file__).resolve().parents[2] / "docs"
_DIGITS, _SHOWN = 8, 10
"""Digits of a digest, and rows of a table."""


class Standing(NamedTuple):
    """A policy on a task."""

    name: str
    kind: Kind
    rows: Sequence[Row]
    """Its episodes on the medium tier."""


def report() -> str:
    """The page's text."""
    tables = {task: _table(task, [*_shipped(task), *_entered(task)]) for task in STUDIES}
    return Template(read_text("leaderboard", "story.md")).substitute(tables)


def _shipped(task: str) -> Iterator[Standing]:
    """The policies on the task's page, from its file of episodes."""
    wanted = tier_sets(task)
    for (policy,), rows in grouped(read_rows(_DOCS / f"{task}.csv.gz"), "policy").items():
        own = [row for row in rows if row["set"] in wanted]
        if {row["set"] for row in own} == {*wanted}:
            yield Standing(policy, kind_of(runnable(policy)), own)


def _entered(task: str) -> Iterator[Standing]:
    for path in sorted(ENTRIES.glob("*.json")):
        entry: Entry = load(path)
        if entry.task == task:
            yield Standing(entry.name, Kind(*(getattr(entry, field) for field in Kind._fields)), entry.episodes)


def _table(task: str, standings: Sequence[Standing]) -> str:
    """The best standings by the main metric."""
    headline = STUDIES[task].headline

    def mean(each: Standing) -> float:
        return float(np.mean(measured(each.rows, headline)))

    table = [
        (
            str(rank), each.name, each.kind.policy_class + ", talks" * each.kind.talks,
            ", ".join(each.kind.channels) or "–", with_interval(by_set(each.rows, headline)),
            short(float(np.mean(measured(each.rows, "swarm_success")))), f"`{each.kind.digest[:_DIGITS]}`",
        )
        for rank, each in enumerate(sorted(standings, key=mean, reverse=True)[:_SHOWN], 1)
    ]  # fmt: skip
    heads = ("", "policy", "class", "observes also", headline.replace("_", " "), "swarm success", "digest")
    return markdown_table(heads, table)


def by_set(rows: Sequence[Row], headline: str) -> list[np.ndarray]:
    """Values of the main metric, an array for each set of episodes."""
    return [np.array(measured(mine, headline)) for mine in grouped(rows, "set").values()]
