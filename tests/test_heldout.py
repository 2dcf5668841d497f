"""The held-out evaluation: what is run, what its numbers mean, and that the shipped page is made of its episodes."""

import csv
import importlib.util
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from uuv_marl import baselines
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.benchmark.tables import shown
from uuv_marl.cli import app
from uuv_marl.errors import ResultsError
from uuv_marl.studies.heldout import across, figures, job, page, sets
from uuv_marl.studies.heldout.across import efficiency, improvement, overall, success
from uuv_marl.studies.heldout.episodes import Episode, read_episodes, write_episodes
from uuv_marl.studies.heldout.marl_eval import write_marl_eval
from uuv_marl.studies.heldout.sets import LEADING, SETS, HeldOut
from uuv_marl.studies.heldout.targets import later, targets, upper_bound
from uuv_marl.studies.heldout.trainings import Trained, Validation, find_trainings

DOCS = Path(__file__).resolve().parent.parent / "docs" / "heldout"
SHIPPED = Path(baselines.__file__).parent / "weights" / "mappo.safetensors"
QUICK = {"swarm.num_vehicles": 3, "time_limit.factor": 0.02, "time_limit.extra_s": 1.0}


def episode(**changes):
    good = Episode("random_field", "mappo", None, 5000, 100.0, 160.0, 125.0, 0, 15.0, 7.0, 8.0, 0.9, 2.0, 0.5, 0)
    return good._replace(**changes)


def test_seeds_are_held_out_and_sets_are_told_apart():
    assert len({held.name for held in SETS}) == len(SETS)
    seeds = [f"mappo_v{k}{seed}" for k in (2, 3, 4) for seed in ("", "_seed1")]
    assert ("scout", "scout_plus", "scout_lead", "mappo", *seeds) == LEADING
    for held in SETS:
        cases = held.cases(["a", "b"], None)
        assert {case.load().name for case in cases} == {held.scenario}
        assert {seed for case in cases for seed in case.seeds} == set(range(5000, 5000 + held.seeds["leading"]))
        assert max(len(case.seeds) for case in held.cases([], 30)) <= 30
        assert held.seeds["leading"] == max(held.seeds.values()) >= held.across
    assert sum(held.across > 0 for held in SETS) == 4


def test_scores_by_hand():
    rows = [episode(), episode(task_time_s=None), episode(collisions=2, task_time_s=200.0), episode(task_time_s=100.0)]
    assert success(rows) == 0.5
    assert efficiency(rows) == pytest.approx((0.8 + 0.0 + 0.5 + 1.0) / 4)


def test_runs_are_resampled_within_their_tasks():
    """Two tasks whose scores are far apart: tasks that were resampled too would make a wide interval."""
    easy, hard = [0.90, 0.91, 0.92, 0.93, 0.94], [0.10, 0.11, 0.12, 0.13, 0.14]
    e = overall([easy, hard])
    assert e.value == pytest.approx(np.mean([0.92, 0.12]))
    assert e.low < e.value < e.high
    assert e.high - e.low < 0.05


def test_the_hardest_of_four_tasks_counts():
    assert overall([[1.0] * 3, [1.0] * 3, [1.0] * 3, [0.0] * 3]) == (0.75, 0.75, 0.75)


def test_few_runs_have_no_interval():
    assert shown([1.0, 2.0, 3.0, 4.0], ".1f") == "2.5"
    assert shown([1.0, 2.0, 3.0, 4.0, 5.0], ".1f").startswith("3.0 [")
    assert f"{overall([[0.5], [0.7]]):.1f}" == "0.6"
    assert f"{improvement([[0.5, 0.7, 0.9]], [[0.6, 0.7, 0.1]]):.2f}" == "0.72", "6.5 of 9"


def test_the_probability_of_improvement_by_hand():
    assert improvement([[0.5, 0.7]], [[0.6, 0.7]]).value == pytest.approx((0 + 0 + 1 + 0.5) / 4)
    mine, other = [[0.5, 0.7, 0.9], [1.0, 1.0, 1.0]], [[0.6, 0.7, 0.1], [1.0, 1.0, 1.0]]
    one, back = improvement(mine, other), improvement(other, mine)
    assert one.value + back.value == pytest.approx(1.0)
    assert (one.low + back.high, one.high + back.low) == (pytest.approx(1.0, abs=0.05), pytest.approx(1.0, abs=0.05))
    assert one.low < one.value < one.high
    assert improvement(mine[:1], other[:1]).value - 0.5 == pytest.approx(2 * (one.value - 0.5)), "ties count half"
    five = [1.0, 0.9, 0.8, 0.9, 1.0]
    assert improvement([five], [[0.1, 0.2, 0.3, 0.1, 0.2]]) == (1.0, 1.0, 1.0)


def test_ablations_stand_beside_the_comparison(tmp_path):
    folder = trainings(tmp_path, SHIPPED)
    shutil.copytree(folder / "ppo-0", folder / "ablations" / "one_size")
    settings = {"settings": {"algorithm": {"name": "mappo"}, "seed": 0, "chosen": "last"}}
    (folder / "ablations" / "one_size" / "config.json").write_text(json.dumps(settings))
    found = find_trainings(folder)
    assert [(one.algorithm, one.ablation) for one in found] == [("mappo", 0), ("ppo", 0), ("one_size", 1)]
    episodes = [
        episode(policy=one.algorithm, training_seed=one.seed, seed=5000 + k, task_time_s=110.0 + k)
        for one in found
        for k in range(3)
    ]
    write_marl_eval(episodes, found, tmp_path / "raw.json")
    assert {*json.loads((tmp_path / "raw.json").read_text())["uuv_marl"]["random_field"]} == {"mappo", "ppo"}
    text = page.report(episodes, found)
    assert "| one_size* | 1 |" in text
    assert "| probability that mappo is better than ppo | random_field | all |" in text


def test_the_policy_that_counts_is_the_one_that_was_chosen():
    both = Validation(10, 1.0, -0.5, 1.0), Validation(20, 2.0, -0.9, 0.5)
    best = Trained("mappo", 0, Path("best"), both)
    assert best.policy_at == both[0]
    assert best._replace(chosen="last").policy_at == both[1]


def test_targets_by_hand():
    def met(mine, other, demand):
        rows = [e._replace(policy="scout") for e in mine] + other
        return next(t.met for t in targets(rows) if t.policy == "scout" and demand in t.demand)

    many = [episode(seed=5000 + k) for k in range(100)]
    lost = [many[0]._replace(task_time_s=None), *many[1:]]
    assert met(many, many, "at least 99%")
    assert met(lost, many, "at least 99%")
    assert not met([many[0]._replace(task_time_s=None, seed=6000), *lost], many, "at least 99%")
    assert met(many, many, "no collision")
    assert not met([*many[1:], episode(collisions=1)], many, "no collision")
    single = [e._replace(set="single_obstacle", task_time_s=100.4) for e in many]
    assert met(single, [], "that of l(t)")
    assert not met([e._replace(task_time_s=100.6) for e in single], [], "that of l(t)")
    assert met(single, [], "12.63")
    assert not met([*single[1:], single[0]._replace(min_obstacle_distance_m=12.6)], [], "12.63")
    assert not met([*single[1:], single[0]._replace(min_spacing_m=5.9)], [], "spacing")
    tuned = [e._replace(policy="bio_inspired_plus", effort=0.6) for e in single]
    assert met(single, tuned, "effort")
    assert not met([e._replace(effort=0.7) for e in single], tuned, "effort")


def test_a_thousand_episodes_bound_the_share_of_collisions_and_compare_times():
    def met(mine, demand):
        rows = [e._replace(policy="scout") for e in mine] + many
        return next(t.met for t in targets(rows) if t.policy == "scout" and demand in t.demand)

    many = [episode(seed=5000 + k) for k in range(1000)]
    hit = [e._replace(collisions=1) if e.seed < 5001 else e for e in many]
    assert met(hit, "surely below 0.5%")
    assert not met([e._replace(collisions=1) if e.seed < 5002 else e for e in many], "surely below 0.5%")
    assert upper_bound(0, 1000) == pytest.approx(1.0 - 0.05 ** (1 / 1000))
    assert met(many, "at most that of `mappo`")
    assert not met([e._replace(task_time_s=125.1) for e in many], "at most that of `mappo`")
    assert not met([hit[0]._replace(task_time_s=None), *hit[1:]], "at most that of `mappo`")


def test_who_does_not_arrive_takes_the_time_limit():
    mine = [episode(seed=k, task_time_s=None if k == 0 else 120.0) for k in range(5)]
    other = [episode(seed=k) for k in range(6)]
    assert later(mine, other).value == pytest.approx((35.0 - 4 * 5.0) / 5)


def test_episodes_come_back_from_their_file(tmp_path):
    rows = [episode(), episode(task_time_s=None, min_obstacle_distance_m=None, training_seed=3, seed=7)]
    write_episodes(rows, tmp_path / "episodes.csv")
    assert read_episodes(tmp_path / "episodes.csv") == rows


@pytest.fixture
def quick(monkeypatch):
    groups = {"leading": ["bio_inspired_plus", "mappo"], "guarded": ["guarded:mappo"], "others": ["bio_inspired"]}
    monkeypatch.setattr(sets, "GROUPS", groups)
    held = HeldOut("quick", "random_field", {"leading": 2, "guarded": 2, "others": 1}, QUICK, "tiny", 2)
    for module in (job, page, across):
        monkeypatch.setattr(module, "SETS", (held,))
    return held


def trainings(folder, weights):
    for k, algorithm in enumerate(("mappo", "ppo")):
        one = folder / f"{algorithm}-0"
        (one / "best").mkdir(parents=True)
        shutil.copyfile(weights, one / "best" / WEIGHTS_FILE)
        (one / "config.json").write_text(json.dumps({"settings": {"algorithm": {"name": algorithm}, "seed": k}}))
        with (one / "progress.csv").open("w") as file:
            table = csv.writer(file)
            table.writerow(["agent_steps", "seconds", "reward", "score", "arrived"])
            table.writerows([[1000, 2.0, -2.0, -1.5, 0.5], [1500, 3.0, -1.8, "", ""], [2000, 4.0, -1.7, -0.5, 1.0]])
    return folder


def test_the_command_runs_what_is_missing_and_tells_of_it(tmp_path, quick):
    where = trainings(tmp_path / "trainings", SHIPPED)
    command = ["heldout", f"--output={tmp_path / 'out'}", f"--trainings={where}"]
    done = CliRunner().invoke(app, [*command, "--seeds=1"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    rows = read_episodes(tmp_path / "out" / "episodes.csv")
    assert len(rows) == 2 * 5 + 1
    assert {(e.policy, e.training_seed) for e in rows} == {
        ("bio_inspired", None), ("bio_inspired_plus", None), ("mappo", None), ("guarded:mappo", None), ("mappo", 0),
        ("ppo", 1),
    }  # fmt: skip
    shipped = [e for e in rows if e.policy == "mappo" and e.training_seed is None]
    assert shipped == [e._replace(training_seed=None) for e in rows if (e.policy, e.training_seed) == ("mappo", 0)]
    text = (tmp_path / "out" / "report.md").read_text()
    assert "### quick" in text
    assert "`random_field`, tiny, seeds from 5,000, at most 2." in text
    assert "| guarded:mappo | quick | 2 |" in text
    assert "{" not in text
    data = json.loads((tmp_path / "out" / "marl_eval.json").read_text())
    run = data["uuv_marl"]["quick"]["ppo"]["run_1"]
    assert run["step_1"] == {"step_count": 2000, "success": [0.0], "efficiency": [0.0], "collisions": [0.0]}
    assert run["absolute_metrics"]["success"] == [0.0, 0.0]
    assert data["uuv_marl_validation"]["validation"]["ppo"]["run_1"]["step_2"]["step_count"] == 2000
    check_marl_eval(data)
    assert (tmp_path / "out" / "figures" / "training.png").stat().st_size > 5000


def check_marl_eval(data):
    """What marl-eval's reader needs: it takes names of tasks, runs and steps from the first entry for all others."""
    for tasks in data.values():
        names = {tuple(algorithms) for algorithms in tasks.values()}
        assert len(names) == 1
        assert not any("," in name for name in names.pop())
        runs = [found for algorithms in tasks.values() for found in algorithms.values()]
        assert len({tuple(found) for found in runs}) == 1
        steps = [run for found in runs for run in found.values()]
        assert len({tuple(run) for run in steps}) == 1
        assert [*steps[0]][:-1] == [f"step_{k + 1}" for k in range(len(steps[0]) - 1)]
        assert len(steps[0]) > 1
        for run in steps:
            metrics = set(run["absolute_metrics"])
            assert [*run][-1] == "absolute_metrics"
            for name, step in run.items():
                assert set(step) == metrics | ({"step_count"} if name != "absolute_metrics" else set())
                for metric in metrics:
                    assert step[metric]
                    assert np.isfinite(step[metric]).all()
            counts = [run[name]["step_count"] for name in run if name != "absolute_metrics"]
            assert counts == sorted(counts)


def test_the_page_shows_what_was_asked_for_and_not_what_else_is_there(tmp_path, quick):
    where = trainings(tmp_path / "trainings", SHIPPED)
    command = ["heldout", f"--output={tmp_path / 'out'}"]
    assert CliRunner().invoke(app, [*command, f"--trainings={where}"]).exit_code == 0
    done = CliRunner().invoke(app, [*command, "--seeds=1"])
    assert done.exit_code == 0, done.output
    rows = read_episodes(tmp_path / "out" / "episodes.csv")
    assert {(e.policy, e.training_seed) for e in rows} == {
        (name, None) for name in ("bio_inspired", "bio_inspired_plus", "mappo", "guarded:mappo")
    }
    assert {e.seed for e in rows} == {5000}


def test_a_training_that_went_on_is_run_anew_where_that_is_said(tmp_path, quick):
    where = trainings(tmp_path / "trainings", SHIPPED)
    command = ["heldout", f"--output={tmp_path / 'out'}", f"--trainings={where}", "--seeds=1"]
    assert CliRunner().invoke(app, command).exit_code == 0
    other = SHIPPED.with_name("ppo.safetensors")
    shutil.copyfile(other, where / "mappo-0" / "best" / WEIGHTS_FILE)
    refused = CliRunner().invoke(app, command)
    assert refused.exit_code == 2
    assert "give --anew to drop those runs" in " ".join(refused.output.split())
    assert CliRunner().invoke(app, [*command, "--anew"]).exit_code == 0


def test_ablations_alone_make_a_page(tmp_path, quick):
    where = trainings(tmp_path / "ablations", SHIPPED)
    done = CliRunner().invoke(app, ["heldout", f"--output={tmp_path / 'out'}", f"--trainings={where}", "--seeds=1"])
    assert done.exit_code == 0, done.output
    assert "| mappo-0* | 1 |" in (tmp_path / "out" / "report.md").read_text()
    assert not (tmp_path / "out" / "marl_eval.json").exists()


def test_two_trainings_of_one_name_and_seed_are_refused(tmp_path):
    folder = trainings(tmp_path, SHIPPED)
    shutil.copytree(folder / "ppo-0", folder / "ppo-again")
    with pytest.raises(ResultsError, match="ppo-again.* are both ppo with seed 1.*move one of them out of the folder"):
        find_trainings(folder)


def test_what_is_shipped_is_found_again(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("ship_heldout", DOCS.parent.parent / "tools" / "ship_heldout.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    monkeypatch.setattr(tool, "TARGET", tmp_path)
    monkeypatch.setattr(tool, "write_page", lambda *_: None)
    tool.ship(DOCS, DOCS / "trainings")
    names = [[one.policy.relative_to(folder) for one in find_trainings(folder / "trainings")]
             for folder in (DOCS, tmp_path)]  # fmt: skip
    assert names[0] == names[1]


def test_without_trainings_the_command_ends_with_its_report(tmp_path, quick):
    done = CliRunner().invoke(app, ["heldout", f"--output={tmp_path / 'out'}", "--seeds=1"])
    assert done.exit_code == 0, done.output
    text = (tmp_path / "out" / "report.md").read_text()
    assert text.count("No trainings were given.") == 2
    assert not (tmp_path / "out" / "marl_eval.json").exists()


def test_trainings_without_a_set_of_the_comparison_make_no_table(tmp_path, quick, monkeypatch):
    import uuv_marl.baselines

    for module in (job, page, across):
        monkeypatch.setattr(module, "SETS", (quick._replace(across=0),))
    weights = Path(uuv_marl.baselines.__file__).parent / "weights" / "mappo.safetensors"
    where = trainings(tmp_path / "trainings", weights)
    done = CliRunner().invoke(app, ["heldout", f"--output={tmp_path / 'out'}", "--seeds=1", f"--trainings={where}"])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out" / "figures" / "training.png").exists()


def test_uneven_trainings_are_cut_to_what_marl_eval_can_read(tmp_path):
    shipped = [one for one in find_trainings(DOCS / "trainings") if not one.ablation]
    uneven = [shipped[0]._replace(validations=shipped[0].validations[:2]), *shipped[1:-1]]
    write_marl_eval(read_episodes(DOCS / "episodes.csv"), uneven, tmp_path / "marl_eval.json")
    data = json.loads((tmp_path / "marl_eval.json").read_text())
    check_marl_eval(data)
    runs = data["uuv_marl_validation"]["validation"]
    assert {name: len(found) for name, found in runs.items()} == {"mappo": 2, "ppo": 2}


def test_the_shipped_raw_results_can_be_read_by_marl_eval_and_are_those_of_the_episodes(tmp_path):
    episodes, found = read_episodes(DOCS / "episodes.csv"), find_trainings(DOCS / "trainings")
    write_marl_eval(episodes, found, tmp_path / "marl_eval.json")
    assert (DOCS / "marl_eval.json").read_text() == (tmp_path / "marl_eval.json").read_text()
    data = json.loads((DOCS / "marl_eval.json").read_text())
    check_marl_eval(data)
    run = data["uuv_marl"]["random_field"]["ppo"]["run_3"]
    mine = [e for e in episodes if (e.set, e.policy, e.training_seed) == ("random_field", "ppo", 2)]
    assert run["absolute_metrics"]["success"] == [float(e.succeeded) for e in mine]
    assert run["step_1"]["success"] == pytest.approx([success(mine)])


def test_the_picture_of_fields_hides_no_collision(tmp_path, monkeypatch):
    """Four ways to end, each with its own share; the best policy on top; how many episodes stands beside the name."""
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, path: drawn.append(figure) or path)
    worse = [episode(seed=k, policy="sdc", collisions=k % 2, task_time_s=None if k < 2 else 120.0) for k in range(8)]
    rows = [*worse, *(episode(seed=k, collisions=int(k == 0)) for k in range(4))]
    figures.draw_fields(rows, "random_field", tmp_path / "x.png")
    ax = drawn[0].axes[0]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["mappo (n = 4)", "sdc (n = 8)"]
    shares = [bar.get_width() for bar in ax.patches]
    assert shares == pytest.approx([3 / 4, 1 / 4, 0, 0, 3 / 8, 3 / 8, 1 / 8, 1 / 8])
    assert ax.patches[6].get_hatch()
    assert len({bar.get_facecolor() for bar in ax.patches[4:]}) == 4
    labels = [text.get_text() for text in drawn[0].legends[0].get_texts()]
    assert labels[:4] == list(figures.ENDS)


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
