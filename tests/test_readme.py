"""Tables and lists of README and of the index are those of the code and of what ships; test_docs.py has the rest."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from research.episodes import measured, read_rows, select
from uuv_marl import load_scenario, scenario_names
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import conditions

pytestmark = pytest.mark.docs
ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
README = " ".join((ROOT / "README.md").read_text().split())


@pytest.mark.parametrize("policy", ["bio_inspired", "sff", "sdc"])
def test_the_table_is_that_of_other_shipped_episodes(policy):
    rows = select(read_rows(DOCS / "paper.csv.gz"), scenario="single_obstacle", policy=policy)
    middle = np.sort(measured(rows, "task_time_s"))[len(rows) // 4 : -len(rows) // 4].mean()
    distances = (min(measured(rows, f"min_{what}_m")) for what in ("obstacle_distance", "spacing"))
    (line,) = re.findall(rf"\| (`{policy}`.*?) \|(?= \||\s*<)", README)
    assert line.split(" | ")[1:3] == [f"{middle + 1e-9:.1f} s", ", ".join(f"{d + 1e-9:.1f} m" for d in distances)]


def test_nothing_is_disturbed_unless_a_scenario_says_so():
    assert {conditions(load_scenario(name)) for name in scenario_names()} == {"still water, no noise, no delay"}


def test_a_vehicle_hears_where_others_are_and_not_how_fast_they_move():
    heard = {field.name for field in PerceptLayout.of(load_scenario("single_obstacle")).table}
    assert heard == {
        "velocity", "yaw_rate", "reference", "reference_velocity", "heard", "neighbour",
        "echo", "echo_range", "echo_position",
    }  # fmt: skip


def test_extras_are_those_of_the_project():
    installed, more = re.search(r"pip install '\.\[([\w,]+)\]' .*? more: ([\w, ]+?) ```", README).groups()
    assert {*installed.split(","), *more.split(", ")} == set(PROJECT["optional-dependencies"]) - {"docs", "test", "dev"}


def test_every_library_with_an_interface_is_named_and_has_its_extra():
    text = (DOCS / "interfaces.md").read_text().partition("\n## ")[0]
    rows = re.findall(r"^\| ([\w -]+?) \| .* \| (`\w+`|none) \| \[", text, re.M)
    (named,) = re.findall(r"\[Your library\]\(\S+\): ([^.]*)\.", README)
    assert [name.removeprefix("Ray ") for name, _ in rows] == named.split(", ")
    assert {extra.strip("`") for _, extra in rows} - {"none"} <= set(PROJECT["optional-dependencies"])


def test_make_help_lists_every_target_that_is_named():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`|; |: )make ([a-z-]+)", (ROOT / "README.md").read_text(), re.M):
        assert re.search(rf'@echo "make {target}\b', makefile) or target == "help", target
