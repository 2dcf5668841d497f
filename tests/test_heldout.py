"""The held-out evaluation: what is run, what its numbers mean, and that the shipped page is made of its episodes."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import trim_mean
from typer.testing import CliRunner

from uuv_marl.baselines.learned import WEIGHTS_FILE
from uuv_marl.cli import app
from uuv_marl.heldout import job, page
from uuv_marl.heldout.across import efficiency, stratified, success
from uuv_marl.heldout.episodes import Episode, read_episodes, write_episodes
from uuv_marl.heldout.sets import ACROSS, SETS, HeldOut
from uuv_marl.heldout.targets import paired, targets
from uuv_marl.heldout.trainings import find_trainings

DOCS = Path(__file__).resolve().parent.parent / "docs" / "heldout"
QUICK = {"swarm.num_vehicles": 3, "time_limit.factor": 0.02, "time_limit.extra_s": 1.0}


def episode(**changes):
    good = Episode("random_field", "mappo", None, 0, 100.0, 125.0, 0, 15.0, 7.0, 8.0, 0.9, 2.0, 0.5, 0)
    return good._replace(**changes)


def test_seeds_are_the_benchmarks_and_sets_are_told_apart():
    assert len({held.name for held in SETS}) == len(SETS)
    assert max(held.seeds for held in SETS) == 500
    for held in SETS:
        assert held.load().name == held.scenario
    sets = {held.name: held for held in SETS}
    for held in ACROSS:
        assert held.load() == sets[held.name].load()
        assert held.seeds <= sets[held.name].seeds


def test_scores_by_hand():
    rows = [episode(), episode(task_time_s=None), episode(collisions=2, task_time_s=200.0), episode(task_time_s=100.0)]
    assert success(rows) == 0.5
    assert efficiency(rows) == pytest.approx((0.8 + 0.0 + 0.5 + 1.0) / 4)


def test_runs_are_resampled_within_their_tasks():
    """Two tasks whose scores are far apart: tasks that were resampled too would make a wide interval."""
    easy, hard = [0.90, 0.91, 0.92, 0.93, 0.94], [0.10, 0.11, 0.12, 0.13, 0.14]
    e = stratified([easy, hard])
    assert e.iqm == pytest.approx(trim_mean(easy + hard, 0.25))
    assert e.low < e.iqm < e.high
    assert e.high - e.low < 0.05
    assert stratified([easy]).iqm == pytest.approx(np.mean(easy[1:4]))
    assert stratified([[0.5], [0.7]]) == (0.6, 0.6, 0.6)


def test_targets_by_hand():
    def met(mine, rival, demand):
        rows = [e._replace(policy="bio_inspired_plus") for e in rival] + mine
        return next(t.met for t in targets(rows, "mappo") if demand in t.demand)

    many = [episode(seed=k) for k in range(100)]
    lost = [e._replace(task_time_s=None) if e.seed < 2 else e for e in many]
    assert met(many, many, "arrive")
    assert not met(lost, many, "at least 99%")
    assert met(many, lost, "no longer")
    assert not met([e._replace(task_time_s=125.1) for e in many], lost, "no longer")
    assert not met([*many[1:], episode(collisions=1)], many, "no collision")
    single = [e._replace(set="single_obstacle") for e in many]
    assert met(single, single, "mean time at most")
    assert not met([e._replace(task_time_s=126.5) for e in single], single, "mean time at most")
    assert met(single, single, "12.63")
    assert not met([*single[1:], single[0]._replace(min_obstacle_distance_m=12.6)], single, "12.63")
    assert not met([*single[1:], single[0]._replace(min_spacing_m=5.9)], single, "spacing")
    assert paired(many[:3], [*lost[:2], episode(seed=2, task_time_s=120.0)]) == [5.0]


def test_episodes_come_back_from_their_file(tmp_path):
    rows = [episode(), episode(task_time_s=None, min_obstacle_distance_m=None, training_seed=3, seed=7)]
    write_episodes(rows, tmp_path / "episodes.csv")
    assert read_episodes(tmp_path / "episodes.csv") == rows


@pytest.fixture
def quick(monkeypatch):
    held = HeldOut("quick", "random_field", 2, ("bio_inspired_plus", "mappo"), ("bio_inspired",), 1, QUICK, "tiny")
    for module in (job, page):
        monkeypatch.setattr(module, "SETS", (held,))
        monkeypatch.setattr(module, "ACROSS", (held,))


def trainings(folder, weights):
    for k, algorithm in enumerate(("mappo", "ppo")):
        one = folder / f"{algorithm}-0"
        (one / "best").mkdir(parents=True)
        shutil.copyfile(weights, one / "best" / WEIGHTS_FILE)
        (one / "config.json").write_text(json.dumps({"settings": {"algorithm": {"name": algorithm}, "seed": k}}))
        with (one / "progress.csv").open("w") as file:
            table = csv.writer(file)
            table.writerow(["agent_steps", "seconds", "score", "arrived"])
            table.writerows([[1000, 2.0, -1.5, 0.5], [1500, 3.0, "", ""], [2000, 4.0, -0.5, 1.0]])
    return folder


def test_the_command_runs_what_is_missing_and_tells_of_it(tmp_path, quick):
    import uuv_marl.baselines

    weights = Path(uuv_marl.baselines.__file__).parent / "trained" / "mappo.safetensors"
    where = trainings(tmp_path / "trainings", weights)
    command = ["heldout", f"--output={tmp_path / 'out'}", f"--trainings={where}"]
    done = CliRunner().invoke(app, [*command, "--seeds=1"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    rows = read_episodes(tmp_path / "out" / "episodes.csv")
    assert len(rows) == 2 * 4 + 1
    assert {(e.policy, e.training_seed) for e in rows} == {
        ("bio_inspired", None), ("bio_inspired_plus", None), ("mappo", None), ("mappo", 0), ("ppo", 1)
    }  # fmt: skip
    shipped = [e for e in rows if e.policy == "mappo" and e.training_seed is None]
    assert shipped == [e._replace(training_seed=None) for e in rows if (e.policy, e.training_seed) == ("mappo", 0)]
    text = (tmp_path / "out" / "report.md").read_text()
    assert "### quick" in text
    assert "`random_field`, tiny, seeds from 0, at most 2." in text
    assert "{" not in text
    data = json.loads((tmp_path / "out" / "marl_eval.json").read_text())
    run = data["uuv_marl"]["quick"]["ppo"]["seed_1"]
    assert run["step_1"]["step_count"] == 2000
    assert run["absolute_metrics"]["success"] == [0.0, 0.0]
    assert (tmp_path / "out" / "figures" / "training.png").stat().st_size > 5000


def test_what_is_not_there_is_explained(tmp_path):
    done = CliRunner().invoke(app, ["heldout", "--only=single", f"--output={tmp_path}"])
    assert done.exit_code == 2
    assert "there is no set 'single'; there are tracking" in " ".join(done.output.split())
    done = CliRunner().invoke(app, ["heldout", f"--trainings={tmp_path}", f"--output={tmp_path}"])
    assert done.exit_code == 2
    assert "no trainings with a best policy" in " ".join(done.output.split())


@pytest.mark.docs
def test_the_shipped_page_is_made_of_the_shipped_episodes():
    text = page.report(read_episodes(DOCS / "episodes.csv"), find_trainings(DOCS / "trainings"))
    assert (DOCS / "report.md").read_text() == text
