"""The examples run as they stand, and are short enough to read."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "examples"
EXAMPLES = sorted((FOLDER / "extending").glob("*.py"))


@pytest.mark.parametrize(("path", "says"), [
    ("policy", "after 30 s the swarm is"), ("reward", "sum of all rewards"),
    ("task", "gathered"), ("vehicle", "slow: arrived after"), ("water", "m/s east: arrival"),
    ("sensor", "20 deg askew: arrived after"),
])  # fmt: skip
def test_an_example_runs(path, says):
    file = next(example for example in EXAMPLES if example.stem == path)
    done = subprocess.run([sys.executable, file], capture_output=True, text=True, check=True, timeout=300)
    assert says in done.stdout


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_an_example_is_short_and_tested(file):
    assert len(file.read_text().splitlines()) < 60
    assert f'("{file.stem}", ' in Path(__file__).read_text()
