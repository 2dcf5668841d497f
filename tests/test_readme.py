"""Tables and lists of README and of the index are those of the code and of what ships; test_docs.py has the rest."""

import re
from pathlib import Path

import numpy as np
import pytest

from research.episodes import measured, read_rows, select

pytestmark = pytest.mark.docs
ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
README = " ".join((ROOT / "README.md").read_text().split())


@pytest.mark.parametrize("policy", ["bio_inspired", "sff", "sdc"])
def test_the_table_is_that_of_other_shipped_episodes(policy):
    rows = select(read_rows(DOCS / "paper.csv.gz"), scenario="single_obstacle", policy=policy)
    middle = np.sort(measured(rows, "task_time_s"))[len(rows) // 4 : -len(rows) // 4].mean()
    (line,) = re.findall(rf"\| (`{policy}`.*?) \|(?= \||\s*<)", README)
    assert line.split(" | ")[1].split(", ")[0] == f"{middle + 1e-9:.1f} s"


def test_make_help_lists_every_target_that_is_named():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`|; |: )make ([a-z-]+)", (ROOT / "README.md").read_text(), re.M):
        assert re.search(rf'@echo "make {target}\b', makefile) or target == "help", target
