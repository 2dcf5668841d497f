"""Build the site into build/site; what follows on the command line goes to Sphinx: build.py -W --keep-going.

Sphinx reads a copy of the pages, so that README.md can be its front page and nothing is written beside the sources.
"""

import shutil
import sys
from pathlib import Path

from sphinx.cmd.build import main

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COPY = ROOT / "build" / "site-source"
FILES = (
    *("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"),
    *("CITATION.cff", "LICENSE"),
)
FOLDERS = ("docs", "perf", "examples", "uuv_marl")


def copy_pages() -> None:
    """Make the copy again; files keep their times, so that Sphinx reads again only what changed."""
    COPY.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        shutil.copy2(ROOT / name, COPY / name)
    for name in FOLDERS:
        shutil.rmtree(COPY / name, ignore_errors=True)
        shutil.copytree(ROOT / name, COPY / name, ignore=shutil.ignore_patterns("__pycache__"))


if __name__ == "__main__":
    copy_pages()
    folders = ["-c", str(HERE), "-d", str(ROOT / "build" / "site-doctrees"), str(COPY), str(ROOT / "build" / "site")]
    raise SystemExit(main([*sys.argv[1:], *folders]))
