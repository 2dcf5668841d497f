"""``paper.md``: the paper's numbers beside ours, written from the rows of the episodes alone."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, cells, select, write_rows
from research.paper.ledger import NUMBERS, Entry, number_entry
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.suite import Case, Suite
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.errors import ResultsError

METRICS = tuple(dict.fromkeys(number.metric for number in NUMBERS))
"""Metrics of an episode that are kept."""
DIGITS = ".6g"
_CASES = {(number.case.scenario, number.case.policy): number.case for number in NUMBERS}


def case_of(scenario: str, policy: str) -> Case:
    """A case of the paper's numbers. Raises ResultsError where there is none."""
    if (scenario, policy) not in _CASES:
        raise ResultsError(f"no number of the paper is of {policy!r} in {scenario!r} in this version")
    return _CASES[scenario, policy]


def write_page(folder: Path, suite: Suite) -> list[Path]:
    """The page and its rows, from the runs of a suite; the paths."""
    rows, table, text = list(_rows(suite)), folder / "paper.csv.gz", folder / "paper.md"
    write_rows(table, rows)
    write_text(text, page(rows))
    return [text, table]


def _rows(suite: Suite) -> Iterator[Row]:
    for (scenario, policy), case in _CASES.items():
        for run in suite.results(case).select(scenario, policy, suite.seeds):
            place = {"scenario": scenario, "policy": policy, "seed": str(run.seed)}
            yield place | cells(run.metrics, METRICS, DIGITS)


def page(rows: Sequence[Row]) -> str:
    """The page's text."""
    entries = [_entry(k, rows) for k in range(len(NUMBERS))]
    verdicts = [entry.verdict for entry in entries]
    head = ("section", "quantity", "paper", "ours", "difference")
    table = [
        (e.section, e.quantity, f"{e.paper} {e.unit}", e.estimate, f"{100 * (e.relative_difference or 0.0):+.0f} %")
        for e in entries
    ]
    return Template(read_text("paper", "story.md")).substitute(
        seeds=str(len({row["seed"] for row in rows})), count=str(len(entries)),
        near=str(verdicts.count("matches within 5 %")), fair=str(verdicts.count("matches within 15 %")),
        far=str(verdicts.count("differs")), numbers=markdown_table(head, table),
    )  # fmt: skip


def _entry(k: int, rows: Sequence[Row]) -> Entry:
    number = NUMBERS[k]
    mine = select(rows, scenario=number.case.scenario, policy=number.case.policy)
    return number_entry(number, np.array([float(row[number.metric] or "nan") for row in mine]))
