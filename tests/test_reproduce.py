"""The reproduction: its figures come from its data, its ledger from its runs, and its sentences can fail."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from research.columns import read_columns, write_columns
from research.dynamics import literal, rest, sensitivity
from research.episodes import read_rows
from research.paper import cases, measures
from research.paper import reproduce as job
from research.paper.assumptions import ASSUMPTIONS, READINGS
from research.paper.cases import (
    COMPARATORS,
    DELTA_LARGE,
    DELTA_SMALL,
    MULTI,
    SINGLE,
    TRACKING,
    ZETA_LARGE,
    ZETA_SMALL,
)  # fmt: skip
from research.paper.claims import CLAIMS
from research.paper.ledger import difference, given_entries, ledger, read_ledger, verdict
from research.paper.report import page
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.benchmark.suite import Case, Suite
from uuv_marl.errors import ResultsError

ROOT = Path(__file__).resolve().parent.parent
KEPT = {case.name for case in cases.ALL}
FROM_RUNS = [part.name for part in job.PARTS if part.cases and {case.name for case in part.cases} <= KEPT]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One seed of everything that the ledger and the paper's figures need."""
    folder = tmp_path_factory.mktemp("reproduce")
    job.reproduce(folder, 1, [*FROM_RUNS, job.LEDGER], lambda what, share: None)
    return folder


def test_scenario_files_differ_in_what_the_papers_text_says_and_nothing_else():
    said = {
        "tracking": {"trajectory": {"waypoints_m": [[180, 180], [800, 100], [500, 600], [1000, 1000]]}},
        "single_obstacle": {
            "trajectory": {"waypoints_m": [[150, 150], [600, 600]]},
            "obstacles": [{"centre_m": [350, 350], "radius_m": 25}],
        },
        "multi_obstacle": {
            "trajectory": {"waypoints_m": [[200, 200], [800, 100], [500, 600], [1000, 1000]]},
            "obstacles": [
                {"centre_m": list(centre), "radius_m": 25}
                for centre in ((600, 100), (400, 200), (700, 850), (700, 700))
            ],
        },
    }
    for name, text in said.items():
        file = tomllib.loads((ROOT / "uuv_marl" / "scenario" / f"{name}.toml").read_text())
        assert {key: value for key, value in file.items() if key not in ("title", "source", "version")} == text


def test_the_papers_inputs_are_the_scenarios():
    assert {entry.verdict for entry in given_entries()} == {"as given"}


def ledger_of_nothing():
    """The ledger of runs that measured nothing."""

    class Empty(Suite):
        def metric(self, case, name):
            return np.array([np.nan])

        def traces(self, case):
            return []

    return ledger(Empty(Path("nowhere"), 1))


def test_a_ledger_of_nothing_claims_nothing():
    rows = ledger_of_nothing()
    assert {row.verdict for row in rows if row.kind == "number"} == {"differs"}
    assert {row.verdict for row in rows if row.kind == "claim" and row.ours is None} == {"does not hold"}


@pytest.mark.docs
def test_our_numbers_are_those_of_the_runs(made):
    (file,) = (made / "runs").glob("multi_obstacle.*/results.json")
    data = json.loads(file.read_text())
    row = next(e for e in read_ledger(made / "ledger.json") if (e.section, e.quantity) == ("5.2.2", "task time"))
    assert row.ours == pytest.approx(data["runs"][0]["metrics"]["task_time_s"])
    data["runs"][0]["metrics"]["task_time_s"] = 527.0
    before = file.read_text()
    try:
        file.write_text(json.dumps(data))
        changed = {(e.section, e.quantity): e for e in ledger(Suite(made / "runs", 1))}["5.2.2", "task time"]
    finally:
        file.write_text(before)
    assert (changed.ours, changed.relative_difference, changed.verdict) == (527.0, 0.0, "matches within 5 %")


def test_verdicts():
    assert verdict(difference(10.48 * 0.951, (10.48, 12.63))) == "matches within 5 %"
    assert difference(11.0, (10.48, 12.63)) == 0.0
    assert verdict(difference(12.63 * 1.06, (10.48, 12.63))) == "matches within 15 %"
    assert verdict(difference(6.34 * 0.8, (6.34,))) == "differs"


@pytest.mark.docs
def test_data_are_the_same_bytes_again_and_figures_come_from_them(made, tmp_path):
    parts = ["figure-9", "figure-11", "table-2"]
    job.reproduce(tmp_path, 1, parts, lambda what, share: None)
    again = sorted((tmp_path / "data").glob("*.csv"))
    assert [path.name for path in again] == [
        "figure-11a.csv",
        "figure-11b.csv",
        "figure-9a.csv",
        "figure-9b.csv",
        "figure-9c.csv",
        "table-2.csv",
    ]
    for path in again:
        assert path.read_bytes() == (made / "data" / path.name).read_bytes()
    for part in parts:
        assert (tmp_path / "figures" / f"{part}.png").read_bytes() == (made / "figures" / f"{part}.png").read_bytes()


def test_a_stopped_job_goes_on(tmp_path):
    def stop(what, share):
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        job.reproduce(tmp_path, 2, ["figure-12"], stop)
    shares = []
    job.reproduce(tmp_path, 2, ["figure-12"], lambda what, share: shares.append(share))
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert (tmp_path / "figures" / "figure-12.png").exists()


def test_a_part_without_runs_is_computed_once(tmp_path, monkeypatch):
    """In a folder of its own; again once its table is gone."""
    calls = []

    def tables(suite, report):
        calls.append(report(1.0))
        return {"rest": {"value": np.arange(3.0)}}

    part = rest.PART._replace(tables=tables, draw=lambda made: Figure())
    monkeypatch.setattr(job, "PARTS", (part,))
    for expected in (1, 1):
        assert job.reproduce(tmp_path, 1, ["rest"], lambda what, share: None) == [tmp_path / "figures" / "rest.png"]
        assert len(calls) == expected
    (tmp_path / "data" / "rest.csv").unlink()
    job.reproduce(tmp_path, 1, ["rest"], lambda what, share: None)
    assert len(calls) == 2


# What each sentence is tested against: swarms for which it is false.
def swapped(words, cases, policy="bio_inspired", **parameters):
    """Other runs under the names of these cases."""
    return {c.name: Case(f"{words} {c.name}", c.scenario, policy, parameters=parameters, routes=True) for c in cases}


OBSTACLES = (ZETA_SMALL, ZETA_LARGE, DELTA_SMALL, DELTA_LARGE)
FALSE = {
    "idle": swapped("idle", (TRACKING, SINGLE, MULTI), "idle"),
    "random": swapped("random", (TRACKING, SINGLE), "random"),
    "no tau_n": swapped("alone", (TRACKING, MULTI), gains=BioInspiredGains(zeta_n=0.0)),
    "no tau_o": swapped("blind", (SINGLE, MULTI), gains=BioInspiredGains(zeta_o=0.0)),
    "the same gains": {case.name: SINGLE for case in OBSTACLES},
    "huge delta_o": swapped("huge", (DELTA_LARGE,), gains=BioInspiredGains(delta_o=400.0)),
    "safer comparators": {case.name: DELTA_LARGE for case in COMPARATORS},
    "faster comparators": {case.name: ZETA_SMALL for case in COMPARATORS},
}


class Swapped(Suite):
    """A study in which some cases are others'."""

    def __init__(self, folder, swaps):
        super().__init__(folder, 1)
        self._swaps = swaps

    def metric(self, case, name):
        return super().metric(self._swaps.get(case.name, case), name)

    def trace(self, case, seed):
        return super().trace(self._swaps.get(case.name, case), seed)


@pytest.fixture(scope="module")
def falsified(made):
    """By sentence, the swarms for which it does not hold."""
    found = {claim.says: [] for claim in CLAIMS}
    for name, swaps in FALSE.items():
        Suite(made / "runs", 1).run(list(swaps.values()), lambda what, share: None)
        suite = Swapped(made / "runs", swaps)
        for claim in CLAIMS:
            if not claim.holds(claim.values(suite)).all():
                found[claim.says].append(name)
    return found


@pytest.mark.docs
@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.says)
def test_every_sentence_can_fail(claim, falsified):
    assert falsified[claim.says]


@pytest.mark.docs
def test_a_swarm_without_tau_o_does_not_avoid(falsified):
    assert "no tau_o" in falsified["near the obstacle the swarm disperses"]
    assert "the same gains" in falsified["zeta_o too small fails to avoid"]
    assert "no tau_n" in falsified["the distance between vehicles stays above a safe distance"]


def test_distance_from_a_path():
    path = np.array([[0, 0], [10, 0], [10, 10]], np.float32)
    points = np.array([[5, 2], [12, 5], [-3, -4], [10, 0]], np.float32)
    np.testing.assert_allclose(measures.path_distance(points, path), [2, 2, 5, 0])
    np.testing.assert_allclose(measures.corner_times(path, 4.0), [2.5, 5.0])


def test_groups_are_linked_by_short_distances():
    position = np.array([[0, 0], [15, 0], [30, 0], [60, 0], [60, 15]], np.float32)
    assert [measures.num_groups(position, link) for link in (10.0, 20.0, 40.0)] == [5, 2, 1]


def test_sides_are_those_of_the_motion():
    along = np.linspace(-50, 50, 101, dtype=np.float32)
    lanes = np.array([-20, -10, 5, 30, 40], np.float32)
    position = np.stack(np.broadcast_arrays(along[:, None], lanes[None]), axis=2)
    assert measures.smaller_side(position, np.array([0, 0, 4], np.float32)) == pytest.approx(2 / 5)
    assert measures.smaller_side(position[..., ::-1], np.array([0, 0, 4], np.float32)) == pytest.approx(2 / 5)
    assert measures.smaller_side(position, np.array([0, 60, 4], np.float32)) == 0.0


def test_unrest_does_not_see_a_common_motion():
    time = np.linspace(0, 5, 50)[:, None, None]
    places = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    assert measures.pair_unrest(np.float32(places + time * [3.0, 1.0])) == pytest.approx(0.0, abs=1e-5)
    assert measures.pair_unrest(np.float32(places * (1 + 0.1 * np.sin(time)))) > 0.1


def test_a_heading_across_the_wrap_is_continuous():
    heading = np.float32(np.linspace(3.0, 3.5, 20)[:, None] + [[-0.1, 0.1]])
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(np.ptp(measures.mean_heading(wrapped)), 0.5, atol=1e-5)


def test_windows_are_taken_by_each_series_own_clock():
    trace = {
        "time_s": np.arange(5.0),
        "x": np.arange(5.0),
        "route_time_s": np.arange(0, 5, 2.0),
        "route_y": np.arange(3.0),
    }
    np.testing.assert_array_equal(measures.between(trace, "x", 1.0, 3.0), [1, 2, 3])
    np.testing.assert_array_equal(measures.between(trace, "route_y", 1.0, 4.0), [1, 2])


def test_eq_24_as_printed_is_of_first_order_and_ours_of_fourth():
    table = literal.convergence()
    for reading, order in (("as printed", 1.0), ("classical", 4.0)):
        own = (table["reading"] == reading) & (table["step_s"] <= 0.1)
        slope = np.polyfit(np.log(table["step_s"][own]), np.log(table["position_error_m"][own]), 1)[0]
        assert slope == pytest.approx(order, abs=0.3), reading


def test_every_alternative_changes_something():
    taken, *others = READINGS
    assert len(others) == sum(len(one.alternatives) for one in ASSUMPTIONS)
    for other in others:
        for scenario, case in READINGS[other].items():
            assert case.load() != READINGS[taken][scenario].load() or case.parameters, other
    names = [case.name for case in sensitivity.PART.cases]
    assert len(set(names)) == len(names)


def test_policies_on_one_scenario_share_a_folder(tmp_path):
    quick = {"time_limit.factor": 0.01, "time_limit.extra_s": 1.0}
    both = [Case("x", "single_obstacle", name, quick, seeds=range(1), shared=True) for name in ("idle", "random")]
    suite, shares = Suite(tmp_path), []
    suite.run(both, lambda what, share: shares.append((what, share)))
    assert [path.name for path in tmp_path.iterdir()] == ["x"]
    assert suite.metric(both[0], "effort") == 0.0
    assert suite.metric(both[1], "effort") > 0.0
    assert shares[-1] == ("x: random", 1.0)
    with pytest.raises(ResultsError, match="another 'single_obstacle'.*move it away or give another --output"):
        Suite(tmp_path).results(both[0]._replace(overrides={}))


def test_tables_survive_the_disk(tmp_path):
    table = {"label": np.array(["10", "b, c"]), "value": np.array([np.nan, 0.1 + 0.2]), "count": np.array([3, 4])}
    write_columns(tmp_path / "t.csv", table)
    read = read_columns(tmp_path / "t.csv")
    np.testing.assert_array_equal(read["label"], ["10", "b, c"])
    np.testing.assert_array_equal(read["value"], [np.nan, 0.3])
    np.testing.assert_array_equal(read["count"], [3, 4])


@pytest.mark.docs
def test_the_page_in_the_docs_is_made_of_the_rows_beside_it():
    assert (ROOT / "docs" / "paper.md").read_text() == page(read_rows(ROOT / "docs" / "paper.csv.gz"))
