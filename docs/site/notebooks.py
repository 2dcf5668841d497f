"""Make docs/tutorials/*.ipynb of the Python files beside them, with their outputs: make notebooks.

The last cell of a source, with the tag "check", holds what the text says of results. It runs, and no notebook shows it.
"""

import sys
import tempfile
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

SOURCES = sorted((Path(__file__).resolve().parent.parent / "tutorials").glob("*.py"))
# OWNER: put the repository's address, or the name of the package on PyPI, into INSTALL, and run this file again.
INSTALL = """\
# Installs uuv_marl where it is missing.
import os
import sys

try:
    import uuv_marl
except ImportError:
    %pip install --quiet "uuv_marl[analysis,render,train] @ git+https://github.com/OWNER/uuv_marl"

# Commands are found, and print neither colours nor moving bars, which a page can't show.
os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]
os.environ.update(FORCE_COLOR="", CLICOLOR_FORCE="", TERM="dumb")"""
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def read(source: Path) -> NotebookNode:
    """The notebook of a source, with its check and without outputs."""
    cells = jupytext.read(source, fmt="py:percent").cells
    first = nbformat.v4.new_code_cell(INSTALL, metadata={"tags": ["remove-cell"]})  # the site leaves it out
    return nbformat.v4.new_notebook(cells=[first, *cells], metadata=METADATA)


def run(notebook: NotebookNode, folder: Path) -> None:
    """Fill in the outputs. Raises CellExecutionError."""
    place = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=None, coalesce_streams=True, record_timing=False, resources=place).execute()


def shown(notebook: NotebookNode) -> NotebookNode:
    """The notebook without its check and without all that differs from run to run but the outputs themselves."""
    cells = [cell for cell in notebook.cells if "check" not in cell.metadata.get("tags", ())]
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"
        cell.metadata = {"tags": cell.metadata.tags} if "tags" in cell.metadata else {}
        for counted in [cell, *cell.get("outputs", ())]:
            if "execution_count" in counted:
                counted.execution_count = None
    return nbformat.v4.new_notebook(cells=cells, metadata=METADATA)


if __name__ == "__main__":
    for source in SOURCES:
        if not sys.argv[1:] or source.stem in sys.argv[1:]:
            notebook = read(source)
            with tempfile.TemporaryDirectory() as folder:
                run(notebook, Path(folder))
            nbformat.write(shown(notebook), source.with_suffix(".ipynb"))
