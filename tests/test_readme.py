"""What README and the index of the pages claim is computed from what ships; test_docs.py has the rest."""

import csv
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from research.dynamics import acceptance
from research.heldout.episodes import ByPolicy, read_episodes
from research.heldout.targets import later
from research.paper.ledger import read_ledger
from research.paper.reproduce import NAMES
from uuv_marl import baselines, load_scenario, scenario_names
from uuv_marl.benchmark import handling
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.benchmark.robustness import job
from uuv_marl.benchmark.robustness.scores import EVERY, by_seed, group_score
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import conditions, load_vehicle, vehicle_names

pytestmark = pytest.mark.docs
ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
README, INDEX = (" ".join(page.read_text().split()) for page in (ROOT / "README.md", DOCS / "README.md"))
HELD_OUT = read_episodes(DOCS / "heldout" / "episodes.csv")
BY_POLICY = ByPolicy(HELD_OUT)
VEHICLE = "literature_185"


def table(name):
    with (DOCS / name).open() as file:
        return list(csv.DictReader(file))


def fields(policy):
    return BY_POLICY.select("random_field", policy)


def outcome(policy):
    """Fields, arrivals, and fields with a collision."""
    mine = fields(policy)
    return len(mine), sum(e.arrived for e in mine), sum(e.collisions > 0 for e in mine)


def papers(quantity):
    return next(e.paper for e in read_ledger(DOCS / "paper" / "ledger.json") if e.quantity == f"proposed: {quantity}")


def acceleration(vehicle):
    data = load_vehicle(vehicle)
    return data["actuators"]["max_force_n"] / (data["vehicle"]["m_kg"] - data["vehicle"]["X_udot_kg"])


def agility(vehicle):
    """Top speed [m/s], acceleration ahead [m/s2] and turn [deg/s] at the limits."""
    measured = acceptance.measured(vehicle)
    return np.array([measured.top_mps, acceleration(vehicle), measured.turn_dps])


def growth(speed):
    return acceptance.sway_yaw(handling.alone(VEHICLE), speed)[0].real


def tabled():
    """Policies and scenarios of docs/results.md."""
    text = (DOCS / "results.md").read_text()
    return len(set(re.findall(r"^\| (\w+) \| .*\d+/20 \|", text, re.M))), len(re.findall(r"^## \w+ v\d", text, re.M))


def paper_scenario():
    return load_scenario("single_obstacle")


def fast():
    """Agent-steps a second of 54 vehicles in many worlds [millions]."""
    cases = json.loads((ROOT / "perf" / "results.json").read_text())["cases"]
    cells = [c for c in cases if (c["case"], c["agents"]) == ("vector_env", 54) and c["worlds"] > 1]
    (value,) = {round(float(np.median(c["rates"])) / 1e6) for c in cells}
    return value


def earlier():
    """By how much ``trimmed_scout`` arrives before ``scout`` [s]."""
    return f"{-later(fields('mappo_v4'), fields('scout')).value:.1f}"


def strongest(count):
    """The policies with the highest scores over all groups of disturbances."""
    policies = by_seed(job.read_episodes(DOCS / "robustness" / job.EPISODES)).groupby(level="policy")
    return {name for name, _ in sorted(policies, key=lambda pair: group_score(pair[1], EVERY).value)[-count:]}


def hostile():
    rows = re.findall(r"^\| [a-z ]+ \| (\d+) \| \d+ \| \d+ \|", (DOCS / "reliability.md").read_text(), re.M)
    return round(sum(map(int, rows)), -3)


def versions():
    low, high = re.findall(r"\d+\.(\d+)", PROJECT["requires-python"])
    return f"Python 3.{low} to 3.{int(high) - 1}"


CLAIMS = {
    "first lines of the film": lambda: (
        f"In the film {paper_scenario().swarm.num_vehicles} vehicles follow a moving point"
    ),
    "how it is compared": lambda: (
        "One obstacle, 54 vehicles, 20 seeds."
        * (
            len(paper_scenario().obstacles) == 1
            and {r["seed"] for r in measured_again("sff")} == set(map(str, range(20)))
        )
    ),
    "versions of Python": lambda: f"You need {versions()}.",
    "versions of Python for make": lambda: f"With `make`, on a machine with {versions()}:",
    "the paper's numbers": lambda: (
        f"The paper states {papers('task time')} s and "
        f"{papers('smallest distance to the obstacle').replace('and', 'to')} m from the obstacle."
    ),
    "scout, held out": lambda: (
        "On 1,000 [held-out fields](docs/heldout/report.md) `scout` always arrives, and touches nothing."
        * (outcome("scout") == (1000, 1000, 0))
    ),
    "mappo, held out": lambda: (
        "`mappo`, a network without law, filter and memory, arrives in {1} and collides in {2}.".format(
            *outcome("mappo")
        )
    ),
    "trimmed_scout, held out": lambda: (
        f"The trained [`trimmed_scout`](docs/mappo.md#card-of-trimmed_scout) does the same {earlier()} s earlier."
        * (outcome("mappo_v4") == (1000, 1000, 0))
    ),
    "the strongest, disturbed": lambda: (
        "In the robustness suite `trimmed_scout` and its hand-made law, "
        "[`scout,preset=wary`](docs/guarded.md#presets), have the highest scores."
        * (strongest(3) == {"mappo_v4", "mappo_v4_seed1", "scout_wary"})
    ),
    "passive arrays": lambda: (
        f"positions from passive arrays at up to "
        f"{max(a.range_m for a in paper_scenario().sonar.arrays if a.kind == 'passive'):g} m;"
    ),
    "agility": lambda: (
        f"{paper_scenario().trajectory.speed_mps:g} m/s with {agility(VEHICLE)[1]:.0f} m/s2 and "
        f"{agility(VEHICLE)[2]:.0f} degrees/s, which no other [vehicle here](docs/vehicles.md) reaches;"
    ),
    "disturbances": lambda: (
        f"measures what each of {len({r['axis'] for r in table('robustness/episodes.csv')} - {'0'})} disturbances"
    ),
    "results": lambda: "[Results](docs/results.md): {} policies on {} scenarios,".format(
        *({5: "five", 10: "ten"}.get(n, n) for n in tabled())
    ),
    "held-out seeds": lambda: f"up to {len({e.seed for e in HELD_OUT}):,} seeds that nothing was made with.",
    "speed": lambda: f"about {fast()} million agent-steps/s on two cores, beside MPE2, VMAS and JaxMARL.",
    "figures of the paper": lambda: "the paper's figures {} to {} and its numbers".format(
        *(f(int(n[7:]) for n in NAMES if re.fullmatch(r"figure-\d+", n)) for f in (min, max))
    ),
    "hostile inputs": lambda: f" {hostile():,} hostile inputs, kills and crash points",
}
"""What README must say, by what it is about; an empty claim is one that no longer holds."""


@pytest.mark.parametrize("about", CLAIMS)
def test_readme_says_what_the_data_say(about):
    claim = CLAIMS[about]()
    assert claim, "what README says of this does not hold"
    assert claim in README


def measured_again(policy):
    """Episodes of the sea trials: the paper's vehicle in its own scale is on the paper's single obstacle."""
    rows = table("sea-trials.csv")
    return [r for r in rows if (r["scenario"], r["vehicle"], r["policy"]) == ("sea_trial", VEHICLE, policy)]


@pytest.mark.parametrize("policy", ["bio_inspired", "sff", "sdc", "scout", "mappo"])
def test_the_table_is_that_of_other_shipped_episodes(policy):
    check_row(policy, measured_again(policy))


def test_the_row_of_the_latest_training_is_that_of_its_episodes_run_again():
    scenario = baselines.granted("trimmed_scout", paper_scenario())
    runs = [event for event in evaluate(scenario, "trimmed_scout", range(20)) if isinstance(event, Run)]
    check_row("trimmed_scout", [run.metrics for run in runs])


def check_row(policy, rows):
    value = lambda name: np.array([float(row[name]) for row in rows])  # noqa: E731
    collided = np.count_nonzero(value("collisions"))
    middle = np.sort(value("task_time_s"))[len(rows) // 4 : -len(rows) // 4].mean()
    cells = (
        f"{middle + 1e-9:.1f} s",
        f"{value('min_obstacle_distance_m').min() + 1e-9:.1f} m, {value('min_spacing_m').min() + 1e-9:.1f} m",
        f"{value('collisions').sum():.0f} in {collided} seeds" if collided else "0",
    )
    (line,) = re.findall(rf"\| (`{policy}`.*?) \|(?= \||\s*<)", README)
    assert line.split(" | ")[1:] == list(cells)


def test_the_paper_s_ranking_does_not_hold_and_its_spacing_does():
    worst = lambda policy, name, of: of(float(row[name]) for row in measured_again(policy))  # noqa: E731
    for other in ("sff", "sdc"):
        assert worst(other, "task_time_s", max) < worst("bio_inspired", "task_time_s", min)
        assert worst(other, "min_spacing_m", max) < worst("bio_inspired", "min_spacing_m", min)


def test_no_other_vehicle_is_as_agile_or_stable_until_there():
    asked = np.array([paper_scenario().trajectory.speed_mps, *agility(VEHICLE)[1:]])
    for other in set(vehicle_names()) - {VEHICLE}:
        assert (agility(other) < asked).all(), other
    (limit,) = re.findall(r"a hull that is directionally unstable above (\S+) m/s", README)
    assert growth(float(limit) - 0.005) < 0.0 < growth(float(limit) + 0.005)


def test_the_least_realistic_assumptions_are_those_of_the_paper_s_page_in_its_order():
    story = (DOCS / "paper" / "report.md").read_text().partition("## What is least like the sea")[2]
    points = re.findall(r"^\d\. \*\*(.*?)\*\*", story, re.M)
    words = ("late", "Passive arrays", "agile", "directionally unstable above 0.68 m/s")
    assert len(points) == len(words)
    assert all(word in point for word, point in zip(words, points, strict=True))


def test_nothing_is_disturbed_unless_a_scenario_says_so():
    assert {conditions(load_scenario(name)) for name in scenario_names()} == {"still water, no noise, no delay"}


def test_a_vehicle_hears_where_others_are_and_not_how_fast_they_move():
    heard = {field.name for field in PerceptLayout.of(paper_scenario()).table}
    assert heard == {
        "velocity", "yaw_rate", "reference", "reference_velocity", "heard", "neighbour",
        "echo", "echo_range", "echo_position",
    }  # fmt: skip


def test_extras_are_those_of_the_project():
    installed, more = re.search(r"pip install '\.\[([\w,]+)\]' .*? more: ([\w, ]+?) ```", README).groups()
    assert {*installed.split(","), *more.split(", ")} == set(PROJECT["optional-dependencies"]) - {"docs", "test", "dev"}


def test_every_library_of_the_index_is_named_and_has_its_extra():
    text = (DOCS / "README.md").read_text().partition("## Your library")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([\w -]+?) \| .* \| (`\w+`|none) \| \[", text, re.M)
    (named,) = re.findall(r"\[Your library\]\(\S+\): ([^.]*)\.", README)
    assert [name.removeprefix("Ray ") for name, _ in rows] == named.split(", ")
    assert {extra.strip("`") for _, extra in rows} - {"none"} <= set(PROJECT["optional-dependencies"])


def test_make_help_lists_every_target_that_is_named():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`|; |: )make ([a-z-]+)", (ROOT / "README.md").read_text(), re.M):
        assert re.search(rf'@echo "make {target}\b', makefile) or target == "help", target


def test_the_index_counts_what_there_is():
    notebooks = sorted((DOCS / "tutorials").glob("[0-9]*.md"))
    minutes = {re.search(r"\*\*Time\*\*: about (\d) minute", page.read_text())[1] for page in notebooks}
    assert (len(notebooks), minutes) == (6, {"1", "2"})
    assert "Six [notebooks](tutorials/README.md) of one or two minutes each:" in INDEX
    assert tabled() == (10, 5)
    assert "ten policies on five scenarios, 20 seeds" in INDEX
    assert "what each of 22 disturbances costs" in INDEX
    assert f"{hostile():,} hostile inputs" in INDEX
