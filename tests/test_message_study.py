"""The study of messages: its sets can run, and the shipped page is that of the shipped rows."""

import pytest

from research.episodes import read_rows
from research.messages import page
from research.messages.sets import (
    BITS,
    CONTROLLER,
    LOSSES,
    METRIC,
    PERIODS_S,
    SETS,
    SILENT,
    TASK,
    USUAL_LOSSES,
    name,
    usual_name,
)
from tests.processes import ROOT


def test_every_set_has_the_modem_of_its_name():
    assert len({each.name for each in SETS}) == len(SETS)
    assert len(SETS) == 1 + len(BITS) * len(PERIODS_S) + len(LOSSES) - 1 + len(USUAL_LOSSES)
    for each in SETS[1:]:
        modem = next(iter(each.cases(None).values())).load().modem
        usual = each.name == usual_name(modem.loss_probability)
        assert usual or each.name == name(modem.bits_per_entry, modem.period_s, modem.loss_probability)


def test_the_tables_by_hand():
    rows = [
        {"set": each, "policy": policy, "seed": str(seed), METRIC: share}
        for each, policy, shares in ((name(8, 12.0, 0.0), CONTROLLER, ("1", "0.5")), (TASK, SILENT, ("0", "0")))
        for seed, share in enumerate(shares)
    ]
    text = page.report(rows)
    assert "| 8 bits | – | – | .75 [.40, 1.00] | – |" in text
    assert "leads .00 [.00, .00] of them" in " ".join(text.split())


@pytest.mark.docs
def test_the_shipped_page_is_made_of_the_shipped_rows():
    rows = read_rows(ROOT / "docs" / "messages.csv.gz")
    assert {row["set"] for row in rows} == {each.name for each in SETS}
    assert (ROOT / "docs" / "messages.md").read_text(encoding="utf-8") == page.report(rows)
