"""The room for tasks: what the water does for them, what is refused, and a user's task through the tools."""

import json
import re
import sys

import numpy as np
import pytest

import uuv_marl
from tests.processes import ROOT, python, succeeds
from tests.swarms import batched, run_of, started
from uuv_marl import load_scenario
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.figures import _outcome
from uuv_marl.benchmark.frame import load
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.errors import RewardError, ScenarioError
from uuv_marl.percept import FLAG, PerceptField
from uuv_marl.sim.episode_setup import default_setup
from uuv_marl.tasks import Follow, Task
from uuv_marl.tasks.measures import MEASURED

EXAMPLE = "examples.extending.task:Rendezvous"
DRAWS = """
import hashlib, uuv_marl
for name in ("few_informed", "hard_water", "two_swarms", "silent_targets", "random_field"):
    swarm = uuv_marl.vector_env(4, name).swarm
    swarm.reset(0)
    print(name, hashlib.sha256(swarm.world_map.obstacles.tobytes() + swarm.state.eta.tobytes()).hexdigest())
"""


def test_draws_do_not_depend_on_the_processor_s_own_instructions():
    """Matrix products, and NumPy's functions, are other code on processors without them."""
    older = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
    now, before = (python("-c", DRAWS, PYTHONWARNINGS="ignore", **more) for more in ({}, older))
    assert len(now.splitlines()) == 5
    assert now == before


@pytest.mark.parametrize("scenario", ["few_informed", "hard_water", "silent_targets", "two_swarms"])
def test_a_map_depends_on_its_seed_alone(scenario):
    """It is the same in a batch, whatever the vehicles do."""
    batch, single, rng = started(scenario, worlds=5, seed=40), started(scenario), np.random.default_rng(0)
    first, action = batch.snapshot(), np.zeros((5, batch.num_vehicles, 2))
    for _ in range(60):
        batch.step(action)
    for w in (0, 2, 4):
        single.reset(40 + w)
        for name, array in single.snapshot().items():
            if name != "streams":
                np.testing.assert_array_equal(array[0], first[name][w], err_msg=name)
        for _ in range(60):
            single.step(0.3 * rng.uniform(-1.0, 1.0, action[:1].shape))
        np.testing.assert_array_equal(single.world_map.obstacles[0], batch.world_map.obstacles[w])
    assert len({places.tobytes() for places in first["eta"]}) == 5


def test_a_goal_at_rest_is_at_rest_where_others_pass_by():
    sea = load_scenario("single_obstacle", num_vehicles=3, overrides={"arrival.criterion": "passage", "task": "reach"})
    batch = BatchedEnv(sea)
    assert np.isfinite(batch.reset(0)).all()
    assert np.isfinite(batch.step(np.ones((1, 3, 2))).reward).all()
    assert not batch.swarm.facts.reference[..., 2:].any()


class Survive(Task):
    """Every vehicle is at its goal, and only the time limit ends an episode."""

    def at_goal(self):
        return np.ones_like(self.swarm.state.alive)

    def done(self):
        return np.zeros(self.swarm.num_worlds, np.bool_)

    def reward(self, running):
        return {}


class TwoWays(Survive):
    """Two groups, the second led by the mirror image of l(t); one vehicle of each is uninformed."""

    @classmethod
    def sizes(cls, scenario):
        return {"group": 2}

    def draw(self, world, rng):
        drawn = default_setup(self.swarm.scenario, rng)
        rank, way = np.arange(len(drawn.eta)), drawn.waypoints[0]
        mirrored = {"waypoints": (way, way * [1.0, -1.0]), "times": 2 * drawn.times}
        return drawn._replace(group=(rank % 2).astype(np.int64), informed=rank > 1, **mirrored)


class Endless(Survive):
    """Draws a longer way than it says."""

    def draw(self, world, rng):
        return default_setup(self.swarm.scenario, rng)._replace(duration_s=1e4)


class Broken(Survive):
    """Gives a term that it does not declare."""

    rewards = {"dense": {"one": "1"}}  # noqa: RUF012

    def reward(self, running):
        return {"two": np.zeros((1, 5))}


BRIEF = {"time_limit.factor": 0.02, "time_limit.extra_s": 1.0}
TWO = {"task": f"{__name__}:TwoWays"}


@pytest.mark.parametrize("sea", [{}, {"navigation.drift_share": 0.1, "navigation.compass_bias_deg": 5.0}])
def test_each_vehicle_perceives_its_own_groups_reference_or_nothing(sea):
    swarm = started("multi_obstacle", TWO | sea, worlds=2, n=6)
    for _ in range(30):
        percept = swarm.step(np.zeros((2, 6, 2)))
    offset = swarm.own_reference[:, :, :2] - swarm.state.eta[:, :, :2]
    np.testing.assert_array_equal(swarm.facts.reference[:, 0, 1], -swarm.facts.reference[:, 1, 1])
    np.testing.assert_allclose(np.hypot(*np.moveaxis(offset, -1, 0)), swarm.facts.away, rtol=1e-12)
    seen = np.hypot(*np.moveaxis(percept["reference"], -1, 0))
    np.testing.assert_allclose(seen[:, 2:], swarm.facts.away[:, 2:], rtol=1e-5, atol=10.0 if sea else 0.0)
    assert (percept["reference"][:, :2] == 0).all()
    assert (percept["reference_velocity"][:, :2] == 0).all()
    assert (percept["reference_velocity"][:, 2:] != 0).any(axis=-1).all()


def test_an_arrival_of_groups_is_that_of_all():
    changes = TWO | {"arrival.radius_m": 1e5, "arrival.spread_m": 1e5, "arrival.dwell_s": 0.1}
    swarm = started("single_obstacle", changes, n=4)
    swarm.world_map.times[0, 1] *= 0.001
    swarm.step(np.zeros((1, 4, 2)))
    swarm.step(np.zeros((1, 4, 2)))
    assert not swarm.arrived[0]  # one group's l(t) still moves
    swarm.world_map.times[0, 0] *= 0.001
    swarm.step(np.zeros((1, 4, 2)))
    swarm.step(np.zeros((1, 4, 2)))
    assert swarm.arrived[0]


def test_at_a_goal_at_rest_who_touched_something_has_failed():
    batch = batched("starter", {"task": {"name": "reach", "near_m": 30.0}})
    swarm, goal = batch.swarm, batch.swarm.world_map.waypoints[0, 0, -1]
    assert (swarm.facts.reference[0, 0] == [*goal, 0.0, 0.0]).all()
    swarm.state.eta[0, :, :2] = goal + 7.0 * np.stack([np.arange(5), np.zeros(5)], axis=1)
    swarm.state.nu[0] = 0.0
    swarm.observe()
    swarm.state.collided[0, 2] = True
    result = batch.step(np.zeros((1, 5, 2)))
    assert result.world_terminated[0]
    assert result.terms["stay"][0] == pytest.approx(5 * [20.0])  # all of the time limit
    assert batch.task.metrics(0) == {"success_share": 0.8, "swarm_success": 0.0}


def test_a_task_that_is_named_takes_fields_too():
    for fields in ({"task.name": "reach", "task.near_m": 20.0}, {"task": "reach", "task.near_m": 20.0}):
        assert uuv_marl.load_scenario("starter", overrides=fields).task_numbers.near_m == 20.0


@pytest.mark.parametrize(("task", "message"), [
    ("folow", "task 'folow' is unknown; did you mean 'follow'"),
    ("nowhere:Task", "task 'nowhere:Task' can't be imported: No module named 'nowhere'"),
    ("json:dumps", "task 'json:dumps' must be a subclass of uuv_marl.tasks.Task"),
    (Follow, "task must be a name; give module:Class, such as 'uuv_marl.tasks.follow:Follow'"),
    ({"name": "reach", "near_m": -3.0}, "task.near_m must be greater than or equal to 0.001, got -3.0"),
    ({"name": "reach", "far_m": 3.0}, "task.far_m is unknown; .*near_m"),
    ({"near_m": 3.0}, "task.name is missing"),
    (7, "task must be"),
])  # fmt: skip
def test_a_task_that_can_not_be_is_refused_by_field_value_and_remedy(task, message):
    with pytest.raises(ScenarioError, match=message.replace("(", r"\(")):
        load_scenario("starter", overrides={"task": task})


NEAR = PerceptField("near", (1,), FLAG, "1 within 10 m")


@pytest.mark.parametrize(("base", "own", "message"), [
    (Task, {}, "must define at_goal, done, reward; see uuv_marl.tasks.Task"),
    (Survive, {"columns": {"collisions": "", "mine_m": ""}}, "can't have collisions in columns: the name is taken"),
    (Survive, {"columns": {"constraint_share_all": ""}}, "can't have constraint_share_all in columns"),
    (Survive, {"observed": (NEAR._replace(name="detected"),)}, "can't have detected in observed or channels"),
    (Survive, {"observed": (NEAR,), "channels": {"sight": (NEAR,)}}, "can't have near in observed or channels"),
    (Survive, {"channels": {"compass": (NEAR,)}}, "can't have compass in channels"),
    (Survive, {"rewards": {"dense": {}, "team": {}}}, "can't have team in rewards"),
    (Follow, {"rewards": {"dense": {"mine": ""}}}, "has rewards of its own; define reward(running)"),
])  # fmt: skip
def test_a_task_that_lacks_a_method_or_takes_a_name_twice_is_refused_by_it(monkeypatch, base, own, message):
    monkeypatch.setattr(sys.modules[__name__], "Unfit", type("Unfit", (base,), own), raising=False)
    with pytest.raises(ScenarioError, match=re.escape(f"task Unfit {message}")):
        load_scenario("starter", overrides={"task": f"{__name__}:Unfit"})


@pytest.mark.parametrize(("own", "more", "message"), [
    ({"min_spacing_m": 1.0, "success_share": 1.0, "swarm_success": 1.0}, {}, "can't give min_spacing_m in metrics"),
    ({"mine_m": 1.0}, {}, "must give success_share, swarm_success in metrics; add to super"),
    ({"success_share": 1.0, "swarm_success": 1.0}, {"headline": "mine_share"}, "must give mine_share in metrics"),
])  # fmt: skip
def test_metrics_that_would_be_hidden_or_missed_are_refused_at_the_first_episodes_end(monkeypatch, own, more, message):
    wrong = type("Wrong", (Survive,), {"metrics": lambda task, world: own, **more})
    monkeypatch.setattr(sys.modules[__name__], "Wrong", wrong, raising=False)
    scenario = load_scenario("starter", overrides={"task": f"{__name__}:Wrong", **BRIEF})
    with pytest.raises(ScenarioError, match=f"task Wrong {message}"):
        list(episodes(scenario, "idle", [0]))


def test_numbers_that_a_task_needs_are_missed_when_a_swarm_is_made():
    with pytest.raises(ScenarioError, match="task.kinds is missing; give it a value"):
        uuv_marl.parallel_env("starter", task="hard_water")


def test_a_reward_that_a_task_does_not_know_or_does_not_give_is_refused():
    message = "reward must be 'dense', 'first_arrival', 'team' or a function of the swarm, got 'sparse'"
    with pytest.raises(ValueError, match=message):
        uuv_marl.parallel_env("starter", task="reach", reward="sparse")
    env = uuv_marl.parallel_env("starter", task=f"{__name__}:Broken")
    env.reset(seed=0)
    with pytest.raises(RewardError, match="reward of Broken must give a dictionary of the terms one, got two"):
        env.step({agent: np.zeros(2, np.float32) for agent in env.agents})


class Still(Follow):
    """A reward of its own in place of the compiled one."""

    rewards = {"dense": {"still": "-1 m/s", "tracking": "as in follow"}}  # noqa: RUF012

    def reward(self, running):
        slow = -np.hypot(*np.moveaxis(self.swarm.velocity, -1, 0))
        return {"still": slow, "tracking": super().reward(running)["tracking"]}


def test_a_subclass_of_follow_may_have_its_own_reward():
    batch, usual = (batched("starter", own) for own in ({"task": f"{__name__}:Still"}, {}))
    result, expected = (env.step(np.ones((1, 5, 2))) for env in (batch, usual))
    np.testing.assert_array_equal(result.terms["tracking"], expected.terms["tracking"])
    np.testing.assert_array_equal(result.reward, sum(result.terms.values()))
    assert (result.terms["still"] < 0.0).all()


def test_a_task_may_draw_no_longer_way_than_it_says():
    env = uuv_marl.parallel_env("starter", task=f"{__name__}:Endless")
    with pytest.raises(ValueError, match="drew duration_s = 10000, and its longest_s gives 30; override longest_s"):
        env.reset(seed=0)


def test_where_clocks_are_fixed_everybody_has_them_unless_the_row_says_so():
    scenario = load_scenario("starter")
    for name in ("bio_inspired", "bio_inspired_plus", "scout", "idle", "mappo"):
        mine = with_policy_requirements(name, scenario)
        assert (mine.timing.decision_period_s, mine.actuators.yaw_damping_nms) == (0.5, 600.0)
    own = with_policy_requirements("bio_inspired,own_clock=true", scenario)
    assert (own.timing.decision_period_s, own.actuators.yaw_damping_nms) == (0.1, 0.0)
    assert run_of("bio_inspired,own_clock=true", scenario).metrics["task_time_s"] is not None


@pytest.fixture
def in_example_folder(monkeypatch):
    monkeypatch.chdir(ROOT / "examples" / "extending")
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield
    sys.modules.pop("task", None)


def test_a_users_task_runs_in_the_benchmark_and_the_replay_by_its_name(tmp_path, in_example_folder):
    how = ["--scenario", "starter", "--set", "task=task:Rendezvous", "--policy", "random"]
    succeeds("benchmark", *how, "--seeds", 2, "--output", tmp_path / "out")
    runs = json.loads((tmp_path / "out" / "results.json").read_text())["runs"]
    assert all(set(run["metrics"]["task"]) == {"success_share", "swarm_success", "spread_m"} for run in runs)
    text = (tmp_path / "out" / "table.md").read_text()
    assert "| spread_m |" in text
    assert "spread_m: mean distance from the centre at the end [m]." in text
    frame = load(tmp_path / "out")
    np.testing.assert_array_equal(frame["spread_m"], [run["metrics"]["task"]["spread_m"] for run in runs])
    assert {*frame.columns} <= {"spread_m", "success_share", "swarm_success", *MEASURED}
    assert _outcome(runs[0]["metrics"]).startswith("success 0%, ")
    succeeds("replay", *how, "--output", tmp_path / "replay.html")
    assert (tmp_path / "replay.html").stat().st_size > 10_000


@pytest.mark.needs("torch")
def test_a_task_of_the_follow_kind_is_judged_as_follow_though_it_measures_more():
    from uuv_marl.benchmark.metrics import shares_of

    metrics = {"task_time_s": 30.0, "collisions": 0}
    assert shares_of(metrics, "success_share") == shares_of(metrics | {"task": {"mine_m": 1.0}}, "success_share")


@pytest.mark.needs("torch")
def test_a_users_task_is_trained_and_the_policy_runs(tmp_path):
    from uuv_marl.train.run import train
    from uuv_marl.train.training import Training

    few = {"validation_episodes": 2, "validations": 1, "network": {"hidden": (16, 16)}, "ppo": {"horizon": 16}}
    training = Training(scenario="starter", overrides={"task": EXAMPLE}, sizes=((5, 20),), steps=20_000, **few)
    rewards = [record.reward for record in train(tmp_path / "a", training)]
    assert len(rewards) == 13
    assert np.isfinite(rewards).all()
    (run,) = uuv_marl.evaluate(str(tmp_path / "a" / "best"), "starter", [0], overrides={"task": EXAMPLE})
    assert run["task"]["spread_m"] > 0.0
