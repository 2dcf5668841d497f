"""The tutorials run from top to bottom, each in a clean folder and in the time that it says, and are the notebooks."""

import os
import re

import nbformat
import pytest

from docs.site.notebooks import SOURCES, read, run, shown

STATED = re.compile(r"^# - \*\*Time\*\*: about (\d) minutes? on two cores, of which \d+ s are compiling", re.MULTILINE)
GENEROUS = 3.0
"""Times the stated minutes, for slower processors."""
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # of Jupyter's libraries
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # kernels leave sockets to the interpreter's end
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


def worked():
    """Seconds in which processors worked for the processes that ended: a busy machine does not prolong them."""
    times = os.times()
    return times.children_user + times.children_system


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_a_tutorial_runs_in_a_clean_folder_and_in_its_time(source, tmp_path):
    before = worked()
    run(read(source), tmp_path)
    assert worked() - before < GENEROUS * 60.0 * int(STATED.search(source.read_text())[1])


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_a_notebook_is_what_its_source_makes(source):
    made = shown(read(source))
    stored = nbformat.read(source.with_suffix(".ipynb"), as_version=4)
    for cell in stored.cells:
        cell.pop("outputs", None)
    for cell in made.cells:
        cell.pop("outputs", None)
    assert stored == made, "run make notebooks"
