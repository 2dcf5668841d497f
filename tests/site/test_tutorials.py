"""The tutorials run from top to bottom, each in a clean folder, and take about as long as they say."""

import os
import re
from pathlib import Path

import pytest
from myst_nb.core.read import read_myst_markdown_notebook
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent.parent.parent / "docs" / "tutorials"
PAGES = sorted(FOLDER.glob("[0-9]*.md"))
STATED = re.compile(r"^- \*\*Time\*\*: about (\d) minutes? on two cores, of which (\d+) s are compiling", re.MULTILINE)
GENEROUS = 3.0
"""Times the stated minutes, for slower processors."""
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # of Jupyter's libraries
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # kernels leave sockets to the interpreter's end
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


def minutes(page):
    """What a tutorial states, and the compiling in it."""
    whole, compiling = STATED.search(page.read_text()).groups()
    return int(whole), int(compiling) / 60.0


def worked():
    """Seconds in which processors worked for the processes that ended: a busy machine does not prolong them."""
    times = os.times()
    return times.children_user + times.children_system


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_runs_in_a_clean_folder_and_in_its_time(page, tmp_path):
    notebook, before = read_myst_markdown_notebook(page.read_text()), worked()
    NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert worked() - before < GENEROUS * 60.0 * minutes(page)[0]
