"""What the code names exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NAMED = sorted(
    {
        (source.relative_to(ROOT).as_posix(), name.rstrip("."))
        for folder in ("uuv_marl", "perf", "tools")
        for source in (ROOT / folder).rglob("*.py")
        for name in re.findall(r"\bdocs/[\w./-]+", source.read_text(encoding="utf-8"))
    }
)


@pytest.mark.parametrize(("source", "name"), NAMED)
def test_pages_that_the_code_names_exist(source, name):
    assert (ROOT / name).exists(), f"{source} names {name}"
