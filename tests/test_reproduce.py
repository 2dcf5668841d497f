"""The reproduction: its figures come from its data, its ledger from its runs, and its sentences can fail."""

from pathlib import Path

import numpy as np
import pytest

from research.dynamics import literal, sensitivity
from research.episodes import read_rows
from research.paper import cases
from research.paper import reproduce as job
from research.paper.assumptions import ASSUMPTIONS, READINGS
from research.paper.ledger import difference, ledger, stated_entries, verdict
from research.paper.report import page
from tests.processes import ROOT
from uuv_marl.benchmark.suite import Suite

KEPT = {case.name for case in cases.ALL}
FROM_RUNS = [part.name for part in job.PARTS if part.cases and {case.name for case in part.cases} <= KEPT]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One seed of everything that the ledger and the paper's figures need."""
    folder = tmp_path_factory.mktemp("reproduce")
    job.reproduce(folder, 1, [*FROM_RUNS, job.LEDGER], lambda what, share: None)
    return folder


def test_the_papers_inputs_are_the_scenarios():
    assert {entry.verdict for entry in stated_entries()} == {"as given"}


def test_a_ledger_of_nothing_claims_nothing():
    class Empty(Suite):
        def metric(self, case, name):
            return np.array([np.nan])

        def traces(self, case):
            return []

    rows = ledger(Empty(Path("nowhere"), 1))
    assert {row.verdict for row in rows if row.kind == "number"} == {"differs"}
    assert {row.verdict for row in rows if row.kind == "claim" and row.ours is None} == {"does not hold"}


def test_verdicts():
    assert verdict(difference(10.48 * 0.951, (10.48, 12.63))) == "matches within 5 %"
    assert difference(11.0, (10.48, 12.63)) == 0.0
    assert verdict(difference(12.63 * 1.06, (10.48, 12.63))) == "matches within 15 %"
    assert verdict(difference(6.34 * 0.8, (6.34,))) == "differs"


@pytest.mark.docs
def test_data_are_the_same_bytes_again_and_figures_come_from_them(made, tmp_path):
    parts = ["figure-9", "figure-11", "table-2"]
    job.reproduce(tmp_path, 1, parts, lambda what, share: None)
    again = sorted((tmp_path / "data").glob("*.csv"))
    assert [path.stem for path in again] == ["figure-11a", "figure-11b", *(f"figure-9{k}" for k in "abc"), "table-2"]
    for path in again:
        assert path.read_bytes() == (made / "data" / path.name).read_bytes()
    for part in parts:
        assert (tmp_path / "figures" / f"{part}.png").read_bytes() == (made / "figures" / f"{part}.png").read_bytes()


def test_eq_24_as_printed_is_of_first_order_and_ours_of_fourth():
    table = literal.convergence()
    for reading, order in (("as printed", 1.0), ("classical", 4.0)):
        own = (table["reading"] == reading) & (table["step_s"] <= 0.1)
        slope = np.polyfit(np.log(table["step_s"][own]), np.log(table["position_error_m"][own]), 1)[0]
        assert slope == pytest.approx(order, abs=0.3), reading


def test_every_alternative_changes_something():
    taken, *others = READINGS
    assert len(others) == sum(len(one.alternatives) for one in ASSUMPTIONS)
    for other in others:
        for scenario, case in READINGS[other].items():
            assert case.load() != READINGS[taken][scenario].load() or case.parameters, other
    names = [case.name for case in sensitivity.PART.cases]
    assert len(set(names)) == len(names)


@pytest.mark.docs
def test_the_page_in_the_docs_is_made_of_the_rows_beside_it():
    assert (ROOT / "docs" / "paper.md").read_text() == page(read_rows(ROOT / "docs" / "paper.csv.gz"))
