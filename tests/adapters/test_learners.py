"""The comparison of learners: every trainer keeps its budget and leaves a policy, and the page is that of its rows."""

import json

import numpy as np
import pytest
import safetensors.numpy
import torch
from tensordict import TensorDict
from torchrl.envs import ExplorationType, set_exploration_type

from research.episodes import read_rows
from research.learners import cells, isac, page, protocol, tune, watch
from research.learners.layout import marl_eval
from research.learners.protocol import AGGREGATED, LEARNERS, TASKS, TIE, TUNING
from research.learners.squashed import Squashed
from research.statistics import estimate, improvement, resampled
from tests.processes import ROOT
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.observation import observation_layout, observer
from uuv_marl.sim.swarm import Swarm

pytestmark = pytest.mark.filterwarnings("ignore")
SHIPPED = ROOT / "research" / "learners" / "curves.csv.gz", ROOT / "docs" / "learners.csv.gz"


def quiet(_):
    pass


@pytest.mark.parametrize(
    ("name", "on"), [*((name, "hard_water") for name in LEARNERS), ("ISAC", "silent_targets_easy")]
)  # the last with a channel
def test_a_cell_is_made_once_and_its_policy_runs_in_every_set(name, on, tmp_path, monkeypatch):
    task = TASKS[on]
    small = tuple(tuple(each._replace(episodes=range(40_000, 40_001)) for each in tier[:1]) for tier in task.tiers)
    task = task._replace(tiers=small)
    monkeypatch.setattr(cells, "AGENT_STEPS", 45_000)
    for module in (protocol, watch):
        monkeypatch.setattr(module, "MEASURES", 2)
    monkeypatch.setitem(protocol._DATA, "validation_episodes", 1)
    cell = cells.Cell(task, LEARNERS[name], 0)
    folder = cell.folder(tmp_path)
    (folder / "run" / "checkpoints").mkdir(parents=True)
    (folder / "run" / ".lock").touch()  # of a training that was cut off
    cells.make(cell, folder, quiet)
    curve, rows = cells.read(cell, folder)
    assert 1 <= len(curve) <= 2
    assert 40_000 <= int(curve[-1]["agent_steps"]) < 100_000
    assert [row["set"] for row in rows] == [each.name for tier in small for each in tier]
    before = (folder / cells.EPISODES).stat().st_mtime_ns
    cells.make(cell, folder, quiet)
    assert (folder / cells.EPISODES).stat().st_mtime_ns == before
    first = small[0][0]
    (again,) = cells.episodes(cell.policy(folder / cells.WEIGHTS_FILE), first, range(40_000, 40_001))
    assert again == {key: rows[0][key] for key in again}


def test_a_folder_has_one_protocol(tmp_path):
    for _ in range(2):
        cells.check_protocol(tmp_path / "new")
    path = tmp_path / "new" / "protocol.toml"
    path.write_text(path.read_text().replace("first = 40_000", "first = 41_000"))
    with pytest.raises(ResultsError, match="was made by another protocol, see .*; remove it, or give another --output"):
        cells.check_protocol(tmp_path / "new")


@pytest.mark.parametrize("name", LEARNERS)
def test_a_training_that_runs_out_of_time_is_measured_at_its_end(name, tmp_path, monkeypatch):
    monkeypatch.setitem(protocol._DATA, "validation_episodes", 1)
    task = TASKS["hard_water"]
    asked = watch.TrainingRequest(task, 0, tmp_path, LEARNERS[name].settings, 5_000_000, 0.02, quiet)
    curve = cells.trainer_of(LEARNERS[name])(asked)
    assert 1 <= len(curve) <= protocol.MEASURES
    assert 0.02 <= float(curve[-1]["minutes"]) < 0.2
    assert (tmp_path / "policy.safetensors").exists()


def test_the_time_of_a_field_is_over_that_of_its_own_reference():
    (first,) = TASKS["random_field"].tiers[0]
    rows = list(cells.episodes("scout", first, range(40_000, 40_003)))
    assert all(1.0 <= float(row["time_ratio"]) < 1.1 for row in rows)


def test_what_isac_learned_acts_alike_without_torch(tmp_path, monkeypatch):
    actors = []
    usual = isac.tensors_of
    monkeypatch.setattr(isac, "tensors_of", lambda actor: actors.append(actor) or usual(actor))
    monkeypatch.setitem(protocol._DATA, "validation_episodes", 1)
    task = TASKS["hard_water"]
    isac.learn(watch.TrainingRequest(task, 0, tmp_path, LEARNERS["ISAC"].settings, 25_000, 1.0, quiet))
    (tmp_path / "now").write_bytes(safetensors.numpy.save(usual(actors[0])))
    swarm = Swarm(task.scenario, 3)
    percept = swarm.reset(10_100)
    observation, fill = observer(percept, observation_layout(task.scenario, "closeness"))
    fill(0, 3)
    told = TensorDict({"uuv": TensorDict({"observation": torch.from_numpy(observation)}, [3, 10])}, [3])
    with set_exploration_type(ExplorationType.DETERMINISTIC), torch.no_grad():
        wanted = actors[0](told)["uuv", "action"].numpy()
    found = Squashed(task.scenario, 3, path=str(tmp_path / "now")).decide(percept)
    np.testing.assert_allclose(found, wanted, atol=1e-5)
    assert np.abs(wanted).max() > 0.01


def invented(better=(), num=4):
    """Rows and curves of some trainings; some learners are better."""
    rng = np.random.default_rng(0)
    curves, rows = [], []
    for task in TASKS.values():
        maps = rng.uniform(0.1, 0.2, 8)
        level = {"random": 0.0, **dict.fromkeys(better, 0.7)}
        for who in (*task.learners, *task.policies):
            for training in range(num) if who in LEARNERS else ("",):
                place = {"task": task.name, "learner": who, "training": str(training)}
                gain = level.get(who, 0.2) + 0.1 * rng.uniform() * (who in LEARNERS)
                for each in task.sets:
                    values = dict.fromkeys(cells.MEASURES, "1") | {"time_ratio": ""}
                    rows += [
                        place
                        | {"set": each.name, "seed": str(40_000 + k)}
                        | values
                        | {"share": f"{gain + maps[k]:.3g}"}
                        for k in range(len(maps))
                    ]
                measured = {"minutes": "1.00", "share": "0.1", "swarm_success": "0", "collisions_per_vehicle": "2"}
                if who in LEARNERS:
                    curves += [place | measured | {"agent_steps": str(k)} for k in (1000, 2000)]
    return curves, rows


def test_the_page_separates_learners_that_differ_and_is_the_same_again():
    curves, rows = invented(better=("ISAC",))
    text = page.report(curves, rows)
    assert text == page.report(curves, rows)
    for task in AGGREGATED:
        (row,) = [line for line in text.splitlines() if line.startswith(f"| {task} |") and " over " in line]
        assert all(f"ISAC over {other}" in row for other in LEARNERS if other != "ISAC")
    equal = [{**row, "share": "0.0" if row["learner"] == "random" else "0.5"} for row in rows]
    table = page._apart(page.means(page.by_training(equal)))
    assert " over " not in table
    assert table.count(" and ") == len(AGGREGATED) * 10


@pytest.mark.parametrize(("gap", "tied"), [(TIE - 0.01, True), (TIE + 0.01, False)])
def test_equivalence_and_ties_have_the_margin_of_the_protocol(gap, tied):
    """Learners that differ by a little more than a tie are not equivalent, those that differ by less are."""
    rng = np.random.default_rng(3)
    maps = rng.uniform(0.2, 0.8, (1, 200))
    ahead = next(iter(LEARNERS))
    scores = {who: np.repeat(maps + gap * (who == ahead), 5, axis=0) for who in LEARNERS}
    scores |= {"random": 0.0 * maps, "controller": maps}
    found = dict(zip(scores, resampled(list(scores.values()), seed=0), strict=True))
    every = {(task, who): found[who] for task in AGGREGATED for who in (*LEARNERS, "random")}
    every |= {(task, TASKS[task].policies[0]): found["controller"] for task in AGGREGATED}
    for row in page._apart(every).splitlines()[2:]:
        _, _, num, apart, alike, _ = row.split("|")
        assert int(num) == apart.count(f"{ahead} over ") == 4  # the maps are the same, so any difference is significant
        assert (f"{ahead} and" in alike) == tied
        assert alike.count(" and ") == 6 + 4 * tied
    assert improvement(*(page._stacked(every, who) for who in list(LEARNERS)[:2]), TIE)[0] == (0.5 if tied else 1.0)


def test_the_worse_of_two_learners_stands_second():
    worse = next(iter(LEARNERS))
    curves, rows = invented(better=list(LEARNERS)[1:])
    assert f"{list(LEARNERS)[1]} over {worse}" in page.report(curves, rows)


def test_a_score_is_0_for_random_and_1_for_the_controller_and_the_order_of_rows_is_free():
    _, rows = invented()
    every = page.means(page.by_training(rows))
    for task in AGGREGATED:
        assert page.against_controller(every, task, "random") == pytest.approx(0.0)
        assert page.against_controller(every, task, TASKS[task].policies[0]) == pytest.approx(1.0)
    own = [row for row in rows if row["learner"] == next(iter(LEARNERS))]
    turned = sorted(own, key=lambda row: (row["training"], -int(row["seed"])))
    again = page.means(page.by_training([*turned, *(row for row in rows if row not in own)]))
    assert {*every} == {*again}
    for place, values in every.items():
        np.testing.assert_array_equal(values, again[place])


def test_intervals_are_over_trainings_and_maps():
    rng = np.random.default_rng(5)
    trainings, maps = rng.normal(0.0, 0.1, (5, 1)), rng.normal(0.0, 0.1, (1, 20))
    widths = []
    for scores in (trainings + 0.0 * maps, 0.0 * trainings + maps, trainings + maps):
        (found,) = resampled([scores], seed=0)
        low, high = estimate(found.mean(axis=1))[1:]
        widths.append(high - low)
        assert found[0] == pytest.approx(scores.mean(axis=1))
    assert widths[0] > 0.1
    assert widths[1] > 0.05
    assert widths[2] == pytest.approx(np.hypot(*widths[:2]), rel=0.15)


def test_a_task_at_the_floor_leaves_the_aggregates():
    curves, rows = invented()
    floored = [
        {**row, "share": "0.01"}
        if row["task"] == "silent_targets_easy" and row["learner"] in (*LEARNERS, "random")
        else row
        for row in rows
    ]
    every = page.means(page.by_training(floored))
    assert page.compared(every) == [task for task in AGGREGATED if task != "silent_targets_easy"]
    text = page.report(curves, floored)
    (row,) = [
        line for line in text.splitlines() if line.startswith("| silent_targets_easy | ") and line.endswith("| no |")
    ]
    assert row not in page.report(curves, rows)
    others = [task for task in AGGREGATED if task != "silent_targets_easy"]
    for who in LEARNERS:
        wanted = np.mean([page.against_controller(every, task, who)[0].mean() for task in others])
        assert page._overall(every, who)[0] == pytest.approx(wanted)


def test_the_page_is_written_with_its_picture_and_files(tmp_path):
    curves, rows = invented(num=2)
    curves = [row for row in curves if row["training"] != "1" or row["agent_steps"] != "2000"]  # one ends sooner
    paths = page.write_page(tmp_path, curves, rows)
    assert [path.name for path in paths if not path.exists()] == []
    assert paths[-1].stat().st_size > 10_000


def test_the_page_shows_the_trainings_that_all_learners_have():
    curves, rows = invented()
    assert page.complete(curves, rows) == (curves, rows)
    lacking = [
        row for row in curves if (row["task"], row["learner"], row["training"]) != ("hard_water", "SB3-PPO", "3")
    ]
    shown = page.complete(lacking, rows)
    assert {row["training"] for row in shown[0]} == {"0", "1", "2"}
    assert {row["training"] for row in shown[1]} == {"", "0", "1", "2"}
    assert "too few for a comparison" in page._apart(page.means(page.by_training(shown[1])))


def test_the_shipped_page_and_file_are_made_of_the_shipped_rows():
    curves, rows = map(read_rows, SHIPPED)
    text = page.report(curves, rows)
    assert "@" not in text
    assert (ROOT / "docs" / "learners.md").read_text() == text
    assert json.loads((ROOT / "docs" / "learners_marl_eval.json").read_text()) == marl_eval(curves, rows)


def test_the_policies_of_the_first_trainings_ship():
    names = {cell.shipped_weights.name for cell in cells.cells([], [], 1)}
    assert {path.name for path in cells.WEIGHTS_FOLDER.iterdir()} == names


class Found:
    """What the shipped rows say, for the findings of the page."""

    def __init__(self):
        self.curves, rows = page.complete(*map(read_rows, SHIPPED))
        self._groups = page.by_training(rows)
        self.every = page.means(self._groups)
        self.overall = {who: page._overall(self.every, who) for who in LEARNERS}

    def better(self, task, one, other):
        """Whether one is significantly better."""
        one, other = (self.every[task, who].mean(axis=1) for who in (one, other))
        return estimate(one - other).low > 0.0

    def differ(self, task, who):
        return any(self.better(task, one, other) for one in who for other in who)

    def mean(self, task, who, each=""):
        return float(page._values(self._groups, task, who, each=each).mean())

    def kept(self, task, who):
        """Share of the main metric that is left with disturbances."""
        return self.mean(task, who, f"{task}-disturbed") / self.mean(task, who)

    def during(self, task, who, least, most):
        """The main metric on validation between these millions of agent-steps."""
        own = [row for row in self.curves if (row["task"], row["learner"]) == (task, who)]
        return np.mean([float(row["share"]) for row in own if least <= float(row["agent_steps"]) / 1e6 < most])


CONTROLLERS = {task: TASKS[task].policies[0] for task in AGGREGATED}
FOUR = [who for who in LEARNERS if who != "ISAC"]
THREE = [who for who in FOUR if who != "MAPPO-GRU"]


@pytest.fixture(scope="module")
def found():
    return Found()


def test_the_best_learners_are_those_that_the_page_names(found):
    numbers = {"MAPPO": 0.87, "MAPPO-GRU": 0.86, "SB3-PPO": 0.78, "IPPO": 0.77, "ISAC": 0.40}
    assert {who: round(values[0], 2) for who, values in found.overall.items()} == numbers
    for one in ("MAPPO", "MAPPO-GRU"):
        assert all(estimate(found.overall[one] - found.overall[who]).low > 0.0 for who in ("IPPO", "SB3-PPO", "ISAC"))
    for task, controller in CONTROLLERS.items():
        ahead = {who for who in LEARNERS if found.better(task, who, controller)}
        assert ahead == ({"IPPO", "MAPPO"} if task == "hard_water" else set())
        assert task == "hard_water" or all(found.better(task, controller, who) for who in LEARNERS)
    for task, who, number in (
        ("hard_water", "MAPPO", 0.70), ("hard_water", "IPPO", 0.69), ("hard_water", "tangent_bug", 0.65),
        ("silent_targets_easy", "IPPO", 0.24), ("silent_targets_easy", "MAPPO", 0.53), ("few_informed", "MAPPO", 0.0),
    ):  # fmt: skip
        assert round(found.mean(task, who), 2) == number


def test_learners_differ_on_the_tasks_that_the_page_names(found):
    assert [task for task in AGGREGATED if found.differ(task, ("MAPPO", "IPPO"))] == ["silent_targets_easy"]
    gap = estimate((found.every["hard_water", "MAPPO"] - found.every["hard_water", "IPPO"]).mean(axis=1))
    assert -TIE <= gap.low <= gap.high <= TIE
    for task in ("two_swarms_easy", "silent_targets_easy"):
        memory = found.during(task, "MAPPO-GRU", 2.25, 2.75)
        assert all(memory > found.during(task, who, 2.25, 2.75) + 0.1 for who in THREE)
    assert not any(found.better(task, "MAPPO-GRU", "MAPPO") for task in AGGREGATED)
    assert [task for task in AGGREGATED if found.better(task, "MAPPO", "MAPPO-GRU")] == ["hard_water"]
    for task in ("random_field", "two_swarms_easy"):
        assert not found.differ(task, FOUR)
        assert np.ptp([found.mean(task, who) for who in FOUR]) < 0.05
    assert all(found.better(task, who, "ISAC") for task in AGGREGATED for who in FOUR)
    for task in ("random_field", "hard_water"):
        assert all(found.during(task, "ISAC", 0.3, 0.6) > found.during(task, who, 0.3, 0.6) for who in FOUR)
    ends = {(row["task"], row["learner"], row["training"]): float(row["agent_steps"]) / 1e6 for row in found.curves}
    for name, least, most in (("MAPPO-GRU", 2.2, 3.6), ("ISAC", 0.3, 0.5), ("MAPPO", 5.0, 5.1)):
        assert all(least <= end <= most for (_, who, _), end in ends.items() if who == name)


def test_disturbances_cost_what_the_page_says(found):
    assert (
        max(found.mean(task, "tangent_bug", f"{task}-disturbed") for task in ("hard_water", "two_swarms_easy")) < 0.045
    )
    lanes = CONTROLLERS["silent_targets_easy"]
    assert round(found.mean("silent_targets_easy", lanes, "silent_targets_easy-disturbed"), 2) == 0.13
    for task, least, most in (
        ("random_field", 0.0, 0.5), ("hard_water", 0.85, 1.0), ("two_swarms_easy", 0.0, 0.5),
        ("silent_targets_easy", 0.95, 1.1),
    ):  # fmt: skip
        assert all(least <= found.kept(task, who) <= most for who in FOUR)
        least_kept = min(found.kept(task, who) for who in LEARNERS)
        assert (found.kept(task, CONTROLLERS[task]) < least_kept) == (task != "random_field")


def test_estimates_are_what_they_say():
    scores = np.linspace(0.0, 1.0, 40).reshape(1, 8, 5)
    assert improvement(scores + 2.0, scores, TIE) == 1.0
    assert improvement(scores, scores, TIE) == 0.5


def test_the_layout_is_that_of_marl_eval():
    """As its README has it: environment, task, algorithm, run, then steps and absolute metrics."""
    told = json.loads(json.dumps(marl_eval(*invented())))
    assert list(told) == ["uuv_marl"]
    assert list(told["uuv_marl"]) == AGGREGATED
    for task in told["uuv_marl"].values():
        assert list(task) == list(LEARNERS)  # else marl-eval's matrices fail
        for runs in task.values():
            assert list(runs) == ["seed_0", "seed_1", "seed_2", "seed_3"]
            for run in runs.values():
                assert list(run) == [*(f"step_{k}" for k in range(protocol.MEASURES)), "absolute_metrics"]
                assert {*run["absolute_metrics"]} == {*run["step_0"]} - {"step_count"}  # else marl-eval refuses it
                assert all(isinstance(values, list) for values in run["absolute_metrics"].values())


def test_all_learners_have_one_axis():
    """Marl-eval draws steps over one interval, the mean of all differences of step counts, the first from 0."""
    told = json.loads((ROOT / "docs" / "learners_marl_eval.json").read_text())["uuv_marl"]
    every = [run for task in told.values() for runs in task.values() for run in runs.values()]
    counts = {tuple(step["step_count"] for key, step in run.items() if key.startswith("step_")) for run in every}
    assert len(counts) == 1
    assert {int(gap) for gap in np.diff([0, *counts.pop()])} == {protocol.AGENT_STEPS // protocol.MEASURES}


def test_a_step_is_the_nearest_measure_and_after_its_end_a_training_stays_at_its_last():
    learner = next(iter(LEARNERS))
    row = {"task": "hard_water", "learner": learner, "training": "0", "minutes": "1"}
    row |= {"swarm_success": "0", "collisions_per_vehicle": "0"}
    tenth = protocol.AGENT_STEPS // protocol.MEASURES
    ends = {0.8: "0.1", 1.4: "0.2", 3.2: "0.3"}
    curve = [{**row, "agent_steps": f"{k * tenth:.0f}", "share": share} for k, share in ends.items()]
    run = marl_eval(curve, [])["uuv_marl"]["hard_water"][learner]["seed_0"]
    assert [step["share"] for step in run.values()] == [[0.1], [0.2], *[[0.3]] * (protocol.MEASURES - 2)]


def test_every_set_of_the_protocol_can_be_run_by_its_learners():
    for task in TASKS.values():
        for each in task.sets:
            load_scenario(each.scenario, overrides=each.overrides)


@pytest.mark.parametrize("name", LEARNERS)
def test_a_learner_has_the_best_of_the_settings_that_were_tried(name):
    rows = [row for row in read_rows(ROOT / "research" / "learners" / "trials.csv") if row["learner"] == name]
    first, second = ([row for row in rows if row["seed"] == str(seed)] for seed in TUNING["seeds"])
    assert {int(row["trial"]) for row in first} == set(range(len(LEARNERS[name].tried)))
    again = tune.kept(first, name)
    assert {int(row["trial"]) for row in second} == set(again)
    scores = {k: np.mean([float(row["score"]) for row in rows if row["trial"] == str(k)]) for k in again}
    assert LEARNERS[name].chosen == max(scores, key=lambda k: scores[k])
