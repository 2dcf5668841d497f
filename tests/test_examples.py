"""The examples run as they stand, and are short enough to read."""

from pathlib import Path

import pytest

from tests.processes import ROOT, python

EXAMPLES = sorted((ROOT / "examples" / "extending").glob("*.py"))


@pytest.mark.parametrize(("path", "says"), [
    ("policy", "after 30 s the swarm is"), ("reward", "sum of all rewards"),
    ("task", "gathered"), ("vehicle", "slow: arrived after"), ("water", "m/s east: arrival"),
    ("sensor", "20 deg askew: arrived after"),
])  # fmt: skip
def test_an_example_runs(path, says):
    assert says in python(ROOT / "examples" / "extending" / f"{path}.py")


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_an_example_is_short_and_tested(file):
    assert len(file.read_text().splitlines()) < 60
    assert f'("{file.stem}", ' in Path(__file__).read_text()
