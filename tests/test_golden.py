"""Runs, percepts, actions, reward and fields are those of ``golden.json``; ``tests/golden.py`` says what it holds.

A commit that changes golden.json changes nothing else, and its message names the keys and the reason.
"""

import platform

import pytest

from tests import golden

SECTIONS = sorted({key.split()[0] for key in golden.read()} | {*golden.SETTINGS, golden.FIELDS})
SAME_BITS = platform.machine().lower() in ("x86_64", "amd64")


@pytest.mark.parametrize("section", SECTIONS)
def test_nothing_moved_that_must_not(section):
    if section != golden.FIELDS and not SAME_BITS:
        pytest.skip("hashes come from an x86-64 processor")
    then = {key: value for key, value in golden.read().items() if key.split()[0] == section}
    lines = golden.differences(then, golden.made(section))
    if lines:
        pytest.fail("\n".join([f"{golden.FILE.name} says something else:", *lines]), pytrace=False)
