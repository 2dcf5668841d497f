"""The leaderboard: an entry is made and checked, a changed one is refused, and the page is that of the rows."""

import json

import pytest

from research.leaderboard import entry, page
from research.leaderboard.entry import check, kind_of, load, made, save
from tests.nets import saved
from tests.processes import ROOT
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import load_scenario


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A checkpoint, and its entry of two episodes."""
    monkeypatch.setattr(entry, "SEEDS", 2)
    policy = saved(tmp_path / "best", with_policy_requirements("mappo_two_swarms", load_scenario("two_swarms")))
    save(made(policy, "two_swarms", "mine"), tmp_path / "mine.json")
    return policy, tmp_path / "mine.json"


def test_an_entry_is_made_and_agrees_with_its_policy(mine):
    policy, path = mine
    told = load(path)
    assert (told.name, told.policy_class, told.talks, told.channels) == ("mine", "network", False, ())
    assert [row["seed"] for row in told.episodes] == ["0", "1"]
    check(told, policy, [0, 1])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: data["episodes"][1].update(collisions="777"), "seed 1 differs: collisions 777, now"),
        (lambda data: data["episodes"].pop(), "must have the episodes"),
        (lambda data: data["episodes"].reverse(), "must have the episodes"),
        (lambda data: data.update(digest="0"), "digest of mine is 0, and of"),
        (lambda data: data.update(policy_class="oracle"), "policy_class of mine is oracle, and of"),
        (lambda data: data.update(task="lake"), "is no entry: task"),
        (lambda data: data.update(colour="blue"), "is no entry: colour"),
    ],
)
def test_a_changed_entry_is_refused(mine, change, said):
    policy, path = mine
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    with pytest.raises(ResultsError, match=said):
        check(load(path), policy, [0, 1])


def test_another_policy_is_refused(mine):
    with pytest.raises(ResultsError, match="digest of mine is .*, and of mappo_two_swarms"):
        check(load(mine[1]), "mappo_two_swarms", [0])


def test_an_entry_joins_the_table(mine, monkeypatch):
    monkeypatch.setattr(page, "ENTRIES", mine[1].parent)
    assert "| mine | network |" in page._table("two_swarms", [*page._entered("two_swarms")])
    assert not [*page._entered("hard_water")]


def test_classes_follow_from_what_a_policy_requires():
    assert kind_of("oracle").policy_class == "oracle"
    assert kind_of("leader_broadcast")[:3] == ("controller", True, ("messages",))
    assert kind_of("mappo").policy_class == "network"


@pytest.mark.docs
def test_the_shipped_page_is_made_of_the_shipped_rows():
    assert (ROOT / "docs" / "leaderboard.md").read_text(encoding="utf-8") == page.report()
