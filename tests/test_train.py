"""The trainer on problems with known answers, and trainings that can be stopped anywhere."""

import contextlib
import csv
import errno
import itertools
import json
import math
import os
import random
import re
import shlex
import shutil
import signal
import sys
import warnings

import numpy as np
import pytest
import safetensors.numpy
import torch

from tests.nets import card_for, tensors
from tests.processes import cli, refused, succeeds
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import make_policy
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, load_checkpoint, save_checkpoint
from uuv_marl.baselines.learned.layers import Architecture
from uuv_marl.errors import PolicyError, ResultsError, RewardError, ScenarioError, TrainingError
from uuv_marl.scenario import parse_override
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train import run as trainings
from uuv_marl.train.critic import PRIVILEGED_SIZE, privileged
from uuv_marl.train.folder import Record, TrainingFolder
from uuv_marl.train.objective import objective
from uuv_marl.train.ppo import Learner, annealed, gae
from uuv_marl.train.rows import TRAINING_SEEDS, Rows, Transition
from uuv_marl.train.run import Trainer, resume, train
from uuv_marl.train.training import Ppo, Training, recipe_fields
from uuv_marl.train.validation import VALIDATION_SEEDS, Validation, Worst, replay_command

SLOW = {"trajectory.speed_mps": 1.5, "start.speed_max_mps": 1.5, "timing.integration_step_s": 0.025}
RUDDER = {"overrides": {"vehicle": "remus100", **SLOW}}
GOOD = Validation(1.0, 1.0, 0.0, 30.0, Worst("starter", 3, 900_000))
TINY = Ppo(horizon=8, minibatches=2)


@pytest.fixture(autouse=True)
def fixed_torch():
    with trainings.fixed_torch():
        yield


def test_advantages_by_hand():
    """gamma = lambda = 1/2. The second row's episode ends by the second of three steps."""
    reward = np.array([[1, 1], [2, 2], [3, 3]], np.float32)
    value = np.array([[4, 4], [8, 8], [16, 16], [32, 32]], np.float32)
    ended = np.array([[False, False], [False, True], [False, False]])
    # deltas, first row: 1 + 4 - 4 = 1, 2 + 8 - 8 = 2, 3 + 16 - 16 = 3; second row: 1, 2 - 8 = -6, 3
    expected = [[1 + 0.25 * (2 + 0.25 * 3), 1 + 0.25 * -6], [2 + 0.25 * 3, -6], [3, 3]]
    np.testing.assert_allclose(gae(reward, value, ended, 0.5, 0.5), expected)


class Toy:
    """Rows that see noise and are paid by a function of (observation, action); all end every ``length`` steps."""

    features, size, rows, part = 2, 3, 64, np.zeros(64, np.int64)

    def __init__(self, pay, length=1, cut_off=False):
        self._pay, self._length, self._cut_off, self._t = pay, length, cut_off, 0
        self._rng = np.random.default_rng(1)
        self._draw()

    def _draw(self):
        self.observation = self._rng.uniform(-1, 1, (self.rows, self.size)).astype(np.float32)

    def query_expert(self, action):
        """The expert's action is (x2, -x1), and the network acts."""
        return self.observation[:, 1::-1] * np.array([1.0, -1.0], np.float32), action

    def step(self, action):
        self._t += 1
        reward = np.asarray(self._pay(self.observation, action), np.float32)
        self._draw()
        over = np.full(self.rows, self._t % self._length == 0)
        none = np.zeros(self.rows, np.bool_)
        terminated, truncated = (none, over) if self._cut_off else (over, none)
        return Transition(reward, terminated, truncated, ~none, self.observation[truncated])


class Recall(Toy):
    """What is seen in the first step of an episode is to be said in the last; in between there is nothing to see."""

    features, size = 3, 3

    def __init__(self):
        self._told = np.zeros((self.rows, 2), np.float32)
        super().__init__(self._paid, 4)

    def _draw(self):
        first, last = self._t % 4 == 0, self._t % 4 == 3
        if first:
            self._told = self._rng.choice([-0.5, 0.5], (self.rows, 2)).astype(np.float32)
        self.observation = np.zeros((self.rows, 3), np.float32)
        self.observation[:, :2], self.observation[:, 2] = self._told * first, last

    def _paid(self, observation, action):
        return -np.sum((action - self._told) ** 2, axis=1) * observation[:, 2]


def learner_for(problem, by, made=None, seed=0):
    made, sizes = made or Architecture(hidden=(32,)), [("seen", problem.features)]
    return Learner(made, sizes, problem.size, problem.part, by, np.random.default_rng(seed))


def learned(problem, iterations, by, made=None):
    learner, rewards = learner_for(problem, by, made), []
    for k in range(iterations):
        share = k / iterations
        noise = [annealed((0.4, 0.1), share)] * 2
        batch, reward = learner.sample(problem, *noise)
        learner.update(batch, *noise, annealed((3e-3, 5e-4), share))
        rewards.append(reward)
    return learner, rewards


def updated(change, memory, minibatches=10):
    """A learner's arrays after an update on a batch that ``change`` has replaced."""
    problem = Toy(lambda x, a: x[:, 0] * a[:, 1], 4)
    problem.part = np.arange(64) % 2
    made = Architecture(hidden=(32,), memory=memory)
    learner = learner_for(problem, Ppo(horizon=8, minibatches=minibatches), made)
    batch, _ = learner.sample(problem, 0.4, 0.4)
    learner.update(change(batch), 0.4, 0.4, 1e-3)
    return learner.arrays()


@pytest.mark.parametrize("memory", [False, True])
def test_a_message_that_is_not_sent_changes_no_update(memory):
    """Neither do the entries that the policy drew outside the own slot; those that were sent do."""
    arrays = []
    for spoilt in (2.0, 0.0, 1.0):
        problem = Toy(lambda x, a: x[:, 0] * a[:, 1], 4)
        problem.sends = np.arange(64) % 3 == 0
        made, by = Architecture(hidden=(32,), memory=memory), Ppo(horizon=8)
        learner = Learner(
            made, [("seen", problem.features)], problem.size, problem.part, by, np.random.default_rng(0), 5
        )
        batch, _ = learner.sample(problem, 0.4, 0.1)
        action = torch.where(batch.used == spoilt, torch.full_like(batch.action, 0.7), batch.action)
        learner.update(batch._replace(action=action), 0.4, 0.1, 1e-3)
        arrays.append(learner.arrays())
    assert all(np.array_equal(arrays[0][name], array) for name, array in arrays[1].items())
    assert any(not np.array_equal(arrays[0][name], array) for name, array in arrays[2].items())


def test_messages_have_a_noise_of_their_own_by_which_their_ratio_counts():
    """The gradient of PPO's ratio at the mean is (action - mean) / variance, for forces and for messages."""
    problem = Toy(lambda x, a: x[:, 0] * a[:, 1], 4)
    problem.sends = np.ones(64, np.bool_)
    learner = Learner(
        Architecture(hidden=(32,)), [("seen", problem.features)], problem.size, problem.part, Ppo(horizon=64),
        np.random.default_rng(0), 5,
    )  # fmt: skip
    batch, _ = learner.sample(problem, 0.4, 0.05)
    drawn = (batch.action - batch.mean).std(dim=(0, 1))
    np.testing.assert_allclose(drawn, [0.4, 0.4, 0.05, 0.05, 0.05], rtol=0.05)
    learner.update(batch, 0.4, 0.05, 1e-3)
    np.testing.assert_allclose(
        batch.used[0, 0] / (2.0 * 0.4**2), [1 / (2.0 * each**2) for each in [0.4] * 2 + [0.05] * 3]
    )


@pytest.mark.parametrize(("memory", "since", "minibatches"), [(False, 3, 10), (True, 3, 10), (True, 0, 64)])
def test_rows_of_lost_vehicles_change_nothing(memory, since, minibatches):
    """What lost vehicles do and receive has no effect on an update, even where a minibatch has no others."""

    def lost(garbage):
        def change(batch):
            at = torch.arange(64) % 5 == 0
            acted = batch.acted.clone()
            acted[since:, at] = 0.0
            own = {name: getattr(batch, name).clone() for name in ("action", "mean", "advantage", "returns")}
            for values in own.values():
                values[since:, at] = garbage
            return batch._replace(acted=acted, **own)

        return change

    one, other = (updated(lost(garbage), memory, minibatches) for garbage in (0.0, 50.0))
    whole = updated(lambda batch: batch, memory, minibatches)
    assert all((one[name] == other[name]).all() for name in one)
    assert any((one[name] != whole[name]).any() for name in one)


@pytest.mark.parametrize("memory", [False, True])
def test_an_update_does_not_depend_on_the_scale_of_a_parts_reward(memory):
    """Advantages and returns are normalised in each part, so that none outweighs another."""

    def scaled(batch):
        factor = torch.where(batch.part == 1, 1000.0, 1.0)
        return batch._replace(advantage=batch.advantage * factor, returns=batch.returns * factor)

    one, other = updated(lambda batch: batch, memory), updated(scaled, memory)
    assert all(np.allclose(one[name], other[name], atol=2e-4) for name in one if name != "moments")


def error_of(learner, weights):
    """Root mean square distance of the mean action from (a x1 + c x2, b x2 + d x1), for weights (a, b, c, d)."""
    x = np.random.default_rng(5).uniform(-1, 1, (500, 3)).astype(np.float32)
    action = learner.act(torch.from_numpy(x), torch.zeros(500, 0))[0].numpy()
    return np.sqrt(np.mean((action - x[:, :2] * weights[:2] - x[:, 1::-1] * weights[2:]) ** 2))


def test_a_one_step_task_is_solved():
    """The reward is highest where the action is (x1, -x2) / 2, whatever the third number that only the critic sees."""

    def pay(observation, action):
        return 3.0 * observation[:, 2] - 10.0 * np.sum((action - observation[:, :2] * (0.5, -0.5)) ** 2, axis=1)

    learner, _ = learned(Toy(pay), 120, Ppo(horizon=8, minibatches=3, kl_stop=0.05))
    assert error_of(learner, (0.5, -0.5, 0, 0)) < 0.1


def test_imitation_ignores_the_reward():
    toy = Toy(lambda observation, action: 10.0 * observation[:, 0] * action[:, 0])
    learner = learner_for(toy, Ppo(horizon=8, minibatches=3))
    learner.set_imitation(imitating=True)
    batch, _ = learner.sample(toy, 1e-3, 1e-3)
    assert (batch.action - batch.mean).abs().max() < 0.01  # the network acts
    for _ in range(120):
        learner.update(learner.sample(toy, 0.2, 0.2)[0], 0.2, 0.2, 3e-3)
    assert error_of(learner, (0, 0, 1.0, -1.0)) < 0.1


@pytest.mark.parametrize(("imitation_weight", "near"), [(0.0, (0.5, -0.5, 0, 0)), (30.0, (0, 0, 1.0, -1.0))])
def test_an_imitation_weight_keeps_the_policy_near_the_expert_against_the_reward(imitation_weight, near):
    """Half of the observation is rewarded, and the expert swaps it."""
    toy = Toy(lambda observation, action: -np.square(action - observation[:, :2] * (0.5, -0.5)).sum(axis=1))
    learner = learner_for(toy, Ppo(horizon=8, minibatches=3))
    learner.set_imitation(imitating=False, imitation_weight=imitation_weight)
    for _ in range(150):
        learner.update(learner.sample(toy, 0.2, 0.2)[0], 0.2, 0.2, 3e-3)
    assert error_of(learner, near) < 0.15


@pytest.mark.parametrize("memory", [True, False])
def test_only_a_memory_recalls(memory):
    """Paid -0.5 every fourth step by who says nothing, that is -0.125; a memory comes near 0, but for its noise."""
    by = Ppo(horizon=16, minibatches=3, gamma=0.9, kl_stop=0.05)
    _, rewards = learned(Recall(), 80, by, Architecture(memory=memory, hidden=(16,)))
    assert (np.mean(rewards[-10:]) > -0.05) == memory
    assert np.mean(rewards[-10:]) > -0.2


@pytest.mark.parametrize(("cut_off", "expected"), [(True, 10.0), (False, 2.33)])
def test_values_of_a_steady_income(cut_off, expected):
    """1 at every step, gamma 0.9: worth 10 where every fourth step only cuts the episode off; where it ends it, worth
    between 1 (the last step) and 3.44 (all four), 2.33 on average, since the time is not observed."""
    by = Ppo(horizon=16, minibatches=3, gamma=0.9, value_decay=0.9)
    learner, _ = learned(Toy(lambda observation, _: np.ones(len(observation)), 4, cut_off), 80, by)
    x = np.random.default_rng(2).uniform(-1, 1, (200, 3)).astype(np.float32)
    value = learner.value(torch.from_numpy(x), torch.zeros(200, 0), torch.zeros(200, dtype=torch.int64)).mean()
    assert value == pytest.approx(expected, rel=0.05)


def test_epochs_stop_where_the_policy_has_gone_far():
    divergence = []
    for limit in (0.01, 1e9):
        problem = Toy(lambda observation, action: action[:, 0])
        learner = learner_for(problem, Ppo(horizon=8, epochs=20, kl_stop=limit))
        batch, _ = learner.sample(problem, 0.3, 0.3)
        divergence.append(learner.update(batch, 0.3, 0.3, 3e-3)[0])
    assert 0.01 < divergence[0] < divergence[1] / 2.0


def test_a_memory_is_trained_from_where_it_was():
    """States that sampling had are those of training, also behind an episode's end, whatever stood before."""
    problem = Toy(lambda observation, action: action[:, 0], 3)
    learner = learner_for(problem, Ppo(horizon=8), Architecture(memory=True, hidden=(8,)))
    for _ in range(2):
        batch, _ = learner.sample(problem, 0.3, 0.3)
        mean, states = learner.actor.through(batch.observation[:, :, :2], batch.state, batch.continues)
        np.testing.assert_allclose(mean.detach().reshape(8, 64, 2), batch.mean, atol=1e-6)
    np.testing.assert_allclose(states[-64:].detach(), learner.state, atol=1e-6)
    assert not batch.continues.bool().all()


class Mixed(Toy):
    """Rows of which the fifth ends, and the third and the fourth are cut off, each in a step of its own."""

    features, size, rows, part = 2, 3, 6, np.zeros(6, np.int64)
    ends, cuts = ((1, 4),), ((1, 2), (2, 3))

    def step(self, action):
        k, self._t = self._t, self._t + 1
        self._draw()
        ended, cut = np.zeros((2, self.rows), np.bool_)
        for t, row in self.ends:
            ended[row] |= t == k
        for t, row in self.cuts:
            cut[row] |= t == k
        self.finals = self._rng.uniform(-1, 1, (int(cut.sum()), self.size)).astype(np.float32)
        return Transition(np.ones(self.rows, np.float32), ended, cut, np.ones(self.rows, np.bool_), self.finals)


def test_what_would_have_come_after_a_cut_counts_as_the_memory_would_have_seen_it():
    """Advantages with lambda 0 by hand: 1 + gamma V(next) - V, next what the critic saw last of rows that were cut off,
    nothing where the episode ended."""
    problem = Mixed(None)
    learner = learner_for(problem, Ppo(horizon=4, gae_lambda=0.0), Architecture(memory=True, hidden=(5,)))
    learner.value = lambda seen, state, part: (seen[:, 2] + 10.0 * state.sum(1)).numpy()
    finals, step = [], problem.step
    problem.step = lambda action: (step(action), finals.append(problem.finals))[0]
    batch, _ = learner.sample(problem, 0.3, 0.3)
    state = torch.zeros(6, 5)
    for t in range(4):
        state = learner.act(batch.observation[t], state)[1]
        value = learner.value(batch.observation[t], state, batch.part[t])
        after = torch.from_numpy(problem.observation) if t == 3 else batch.observation[t + 1]
        cut, ended = [row for k, row in problem.cuts if k == t], [row for k, row in problem.ends if k == t]
        fresh = state.clone()
        fresh[cut + ended] = 0.0
        ahead = learner.value(after, learner.act(after, fresh)[1], batch.part[t])
        if cut:
            final = torch.from_numpy(finals[t])
            ahead[cut] = learner.value(final, learner.act(final, state[cut])[1], batch.part[t][cut])
        ahead[ended] = 0.0
        np.testing.assert_allclose(batch.advantage[t], 1.0 + 0.99 * ahead - value, atol=1e-4)
        state = fresh


def rows_for(training, seed=0):
    rng = np.random.default_rng(seed)
    return Rows(training, lambda num: rng.integers(*TRAINING_SEEDS, num))


def test_rows_of_mixed_sizes_end_and_start_anew():
    brief = {"time_limit.factor": 0.001, "time_limit.extra_s": 1.9}
    env = rows_for(Training(scenario="starter", sizes=[(1, 2), (3, 2)], overrides=brief, ppo=TINY))
    assert env.observation.shape == (8, env.features + PRIVILEGED_SIZE)
    idle = np.zeros((8, 2), np.float32)
    for _ in range(3):
        came = env.step(idle)
        assert not (came.terminated | came.truncated).any()
        assert came.final.shape == (0, env.size)
    before = env.observation.copy()
    came = env.step(idle)
    assert came.truncated.all()
    assert came.final.shape == env.observation.shape
    assert np.abs(came.final - before).max() < np.abs(env.observation - before).max()


def test_collisions_cost_more_as_a_training_goes_on(tmp_path, no_validation, monkeypatch):
    """Each collision costs as much, and nothing else changes."""
    crowd = Training(scenario="starter", sizes=[(12, 4)], ppo=TINY)
    plain, charged, found = rows_for(crowd), rows_for(crowd), 0
    charged.schedule(7.0, 0.0)
    rng = np.random.default_rng(0)
    for _ in range(60):
        action = rng.uniform(-1.0, 1.0, (48, 2)).astype(np.float32)
        less = plain.step(action).reward - charged.step(action).reward
        collisions = charged.groups[0].env.swarm.facts.vehicle_collisions.ravel()
        np.testing.assert_allclose(less, 7.0 * collisions, atol=1e-4)
        found += collisions.sum()
    assert found > 0
    costs = []
    monkeypatch.setattr(Rows, "schedule", lambda self, cost, share: costs.append(cost))
    list(train(tmp_path, small(steps=5 * 168)))
    assert costs[0] == 1.0
    assert costs == sorted(costs)
    assert 50.0 < costs[-1] < 300.0


OWN_TASK = """
import numpy as np
from uuv_marl.baselines import Policy
from uuv_marl.tasks import Task
from uuv_marl.tasks.reach import Reach
class Still(Policy):
    def decide(self, percept):
        return np.zeros((*percept.flat.shape[:2], 2), np.float32)
class Mine(Task):
    rewards = {"dense": {"still": "-0.5 m/s for each decision", "collision": "-60 for each"}}
    def at_goal(self):
        return self.swarm.state.alive
    def done(self):
        return ~self.swarm.state.alive.any(axis=1)
    def reward(self, running):
        slow = -np.hypot(*np.moveaxis(self.swarm.velocity, -1, 0))
        return {"still": 0.5 * slow, "collision": -60.0 * self.swarm.facts.vehicle_collisions}
class Nearer(Reach):
    pass
def mine(swarm):
    return np.zeros((swarm.num_worlds, swarm.num_vehicles))
"""


@pytest.fixture
def own_task(tmp_path, monkeypatch):
    (tmp_path / "own_task.py").write_text(OWN_TASK)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_task", raising=False)


NEARER = {"name": "own_task:Nearer", "near_m": 20.0}


@pytest.mark.parametrize(("fields", "cost"), [
    ({}, (1.0, 300.0)),
    ({"scenario": "few_informed", "reward": "leader"}, (1.0, 300.0)),
    ({"reward": "own_task:mine"}, (0.0, 0.0)),
    ({"overrides": {"task": "own_task:Mine"}}, (0.0, 0.0)),
    ({"overrides": {"task": "own_task:Mine"}, "extra_scenarios": ["starter"]}, (0.0, 0.0)),
    ({"overrides": {"task": NEARER}}, (0.0, 0.0)),
    ({"overrides": {"task": NEARER}, "ppo": {"collision_cost": (2.0, 5.0)}}, (2.0, 5.0)),
    ({"ppo": {"collision_cost": (0.0, 0.0)}}, (0.0, 0.0)),
])  # fmt: skip
def test_collisions_cost_nothing_beyond_a_reward_of_ones_own(fields, cost, own_task):
    training = Training(**fields)
    assert training.ppo.collision_cost == cost
    assert Training(**json.loads(training.model_dump_json())) == training
    assert ("collision costs" in objective(training)) == (cost[1] > 0.0)


@pytest.mark.parametrize("fields", [
    {"reward": "own_task:mine"},
    {"overrides": {"task": NEARER}},
    {"expert": "own_task:Still", "imitation_share": 0.5},
], ids=lambda fields: next(iter(fields)))  # fmt: skip
def test_a_changed_file_of_ones_own_is_refused_at_a_resume(fields, tmp_path, own_task, no_validation):
    next(begins := train(tmp_path / "run", small(checkpoint_every=1, **fields)))
    begins.close()
    TrainingFolder(tmp_path / "run", None)
    with (tmp_path / "own_task.py").open("a") as file:
        file.write("# changed")
    with pytest.raises(ResultsError, match=r"was started with (\w+) = own_task:\w+ \(.*\), and \1 is own_task:\w+ \("):
        TrainingFolder(tmp_path / "run", None)


def test_a_training_begins_with_its_whole_objective(tmp_path, own_task, no_validation):
    said = []
    training = small(steps=1, expert="scout", imitation_share=0.3, imitation_weight=2.0)
    list(train(tmp_path / "a", training, say=said.append))
    assert said[1] == objective(training)
    for part in (
        "Reward dense of task follow on starter\n  weights w: tracking 0.1, obstacle 0.1, ",
        "arrival 20, progress_m 10, progress_far_m 500\n  tracking: -w · dt · clip(d/s_l - 1, 0, 1); d: the vehicle's",
        "\nIn addition a collision costs 1 at the start and 300 at the end (ppo.collision_cost); discount 0.99",
        "For 30% of the budget the network first imitates scout.",
        "Then 2 times the mean squared distance from its actions is added to PPO's loss.",
    ):
        assert part in said[1]
    own = objective(small(overrides={"task": "own_task:Mine"}))
    assert "Reward dense of task own_task:Mine on starter\n" in own
    assert "\n  collision: -60 for each\nNothing is added to the reward; discount" in own
    assert objective(small(reward="own_task:mine")).startswith("Reward own_task:mine on starter\nNothing is added")
    waters = {"scenario": "hard_water", "extra_scenarios": ["hard_water_hard", "random_field"]}
    several = objective(Training(**waters, sizes=[2, 3]))
    assert several.count("Reward dense of task") == 2
    assert "task hard_water on hard_water, hard_water_hard\n" in several


def test_one_network_learns_on_several_scenarios(tmp_path):
    short = {"time_limit.factor": 0.01, "time_limit.extra_s": 3.0}
    (tmp_path / "short.toml").write_text('extends = "training_field"\n[time_limit]\nfactor = 0.01\nextra_s = 3.0\n')
    several = Training(
        scenario="starter", extra_scenarios=[str(tmp_path / "short.toml")], overrides=short, sizes=[(3, 2)], steps=1,
        ppo=TINY, validations=1, validation_episodes=2,
    )  # fmt: skip
    env = rows_for(several)
    assert [group.env.swarm.scenario.name for group in env.groups] == ["starter", "short"]
    assert env.rows == 12
    (record,) = train(tmp_path / "run", several)
    assert record.agent_steps == 12 * TINY.horizon
    assert list(resume(tmp_path / "run")) == []
    assert trainings.best_of(tmp_path / "run")[1].startswith("uuv-marl replay --scenario")


def test_lost_vehicles_are_rows_that_do_not_act(tmp_path, no_validation):
    losing = {"losses.times_s": [1.0, 1.5], "time_limit.factor": 0.001, "time_limit.extra_s": 3.0}
    training = Training(scenario="starter", overrides=losing, sizes=[(4, 2)], steps=1, ppo=TINY)
    env = rows_for(training)
    acted, ended = [], []
    for _ in range(7):
        transition = env.step(np.zeros((8, 2), np.float32))
        acted.append(transition.acted)
        ended.append(transition.terminated | transition.truncated)
    np.testing.assert_array_equal(np.sum(acted, axis=1), [8, 8, 6, 4, 4, 4, 4])
    np.testing.assert_array_equal(np.sum(ended, axis=1), [0, 2, 2, 0, 0, 0, 8])
    (record,) = train(tmp_path / "run", training)
    assert record.agent_steps < 8 * TINY.horizon


def test_a_critic_that_sees_its_own_alone_has_the_actors_input():
    env = rows_for(Training(scenario="starter", sizes=[(3, 2)], critic="own", ppo=TINY))
    assert env.size == env.features == env.observation.shape[1]


@pytest.mark.parametrize("beside", [
    {}, {"filter": True}, {"base_controller": "scout"}, RUDDER, {**RUDDER, "base_controller": "scout"},
    {**RUDDER, "base_controller": "sff"},
], ids=["alone", "filter", "scout", "rudder", "rudder, scout", "rudder, sff"])  # fmt: skip
def test_rows_act_as_the_policy_will(beside, tmp_path):
    """What comes of a training's actions is what comes of its checkpoint's, filter, law and all bounds included."""
    brief = {"time_limit.factor": 0.001, "time_limit.extra_s": 3.0}
    told = {"scenario": "starter", **beside}
    training = Training(sizes=[(4, 1)], ppo=TINY, **{**told, "overrides": told.get("overrides", {}) | brief})
    trainer = Trainer(training)
    trainer.learner.actor.tensors[f"{len(training.network.hidden)}.bias"].data[:] = torch.tensor([1.0, 1.0])
    trainer.save_policy(tmp_path, Record())
    env, learner = trainer.rows, trainer.learner

    policy = make_policy(str(tmp_path), env.groups[0].env.swarm.scenario)
    for _ in range(10):
        expected = policy.act(env.groups[0].env.swarm.percept).copy()
        taken = []
        step = env.groups[0].env.step
        env.groups[0].env.step = lambda action, step=step, taken=taken: taken.append(action) or step(action)
        env.step(learner.act(torch.from_numpy(env.observation), learner.state)[0].numpy())
        env.groups[0].env.step = step
        np.testing.assert_allclose(taken[0], expected, atol=1e-5)


@pytest.mark.parametrize("beside", [{}, {"filter": True}, RUDDER], ids=["alone", "filter", "rudder"])
def test_an_expert_records_the_executed_action_and_acts_as_it_would_alone(beside):
    """Its actions are executed in its own worlds, and its memory follows the executed ones in all."""
    brief = {"time_limit.factor": 0.001, "time_limit.extra_s": 3.0}
    fields = {"scenario": "starter", **beside, "expert": "scout"}
    training = Training(sizes=[(4, 2)], ppo=TINY, **{**fields, "overrides": fields.get("overrides", {}) | brief})
    seeds, executed = itertools.count(100_000), []
    env = Rows(training, lambda num: [next(seeds) for _ in range(num)])
    group = env.groups[0]
    alone = make_policy("scout", group.env.swarm.scenario, 2)
    step = group.env.step
    group.env.step = lambda action: executed.append(action) or step(action)
    for _ in range(16):
        group._expert_acts[:] = True, False
        expected = alone.act(group.env.swarm.percept).copy()
        said, done = env.query_expert(np.full((env.rows, 2), 0.3, np.float32))
        np.testing.assert_array_equal(said, expected.reshape(-1, 2))
        np.testing.assert_array_equal(done, [*said[:4], *np.full((4, 2), np.float32(0.3))])
        env.step(done)
        alone.record_action(executed[-1])
    assert next(seeds) > 100_004  # new worlds have begun
    assert np.abs(executed[-1][0] - expected[0]).max() < 1e-6 or beside.get("filter")
    assert np.abs(executed[-1][1] - expected[1]).max() > 1e-3


def test_all_messages_are_the_experts_while_it_acts_somewhere():
    """A network's messages would mislead the expert, whose actions are the targets."""
    overrides = {"sonar.channels": ["messages"], "modem.message_entries": 5, "modem.message_vectors": 2}
    training = Training(scenario="few_informed", sizes=[(20, 2)], overrides=overrides, expert="leader_broadcast")
    env = Rows(training, np.arange)
    env.groups[0]._expert_acts[:] = True, False
    for share in (0.5, -0.1):
        env.schedule(0.0, share)
        said, done = env.query_expert(np.full((env.rows, 7), 0.3, np.float32))
        np.testing.assert_array_equal(done[:20], said[:20])
        np.testing.assert_array_equal(done[20:, :2], np.full((20, 2), 0.3, np.float32))
        wanted = said[20:, 2:] if share > 0.0 else np.full((20, 5), 0.3, np.float32)
        np.testing.assert_array_equal(done[20:, 2:], wanted)


def test_an_expert_without_its_requirements_is_named(tmp_path):
    for expert, message in (
        ("scoot", "policy 'scoot' is unknown; did you mean 'scout'"),
        ("orca_informed", "orca_informed needs the channel link .*, which scenario 'starter' does not have"),
    ):
        with pytest.raises(PolicyError, match=message):
            list(train(tmp_path / "a", Training(scenario="starter", expert=expert, steps=100)))
        assert not (tmp_path / "a" / "config.json").exists()


def test_fewer_and_fewer_worlds_are_the_experts():
    training = Training(scenario="starter", sizes=[(1, 400)], expert="random", overrides={"time_limit.factor": 0.001})
    drawn = np.random.default_rng(0)
    env = Rows(training, lambda num: drawn.integers(*TRAINING_SEEDS, num))
    for share in (1.0, 0.6, 0.0, -0.3):
        env.schedule(0.0, share)
        ended = np.zeros(env.rows, np.bool_)
        while not ended.all():
            env.query_expert(np.zeros((env.rows, 2), np.float32))
            came = env.step(np.zeros((env.rows, 2), np.float32))
            ended |= came.terminated | came.truncated
        assert abs(env.groups[0]._expert_acts.mean() - max(share, 0.0)) < 0.1


def test_rewards_count_after_the_imitation(tmp_path, no_validation):
    """During imitation the network is far from the expert that acts; then PPO is near itself."""
    fields = {"scenario": "starter", "sizes": [(4, 2)], "steps": 20 * 64, "imitation_share": 0.9, "expert": "scout"}
    records = list(train(tmp_path, Training(ppo=TINY, **fields)))
    assert len(records) == 20
    after = [record.kl for record in records[18:]]
    assert 1e-6 < min(after) <= max(after) < 0.1 < min(record.kl for record in records[:18])


def test_after_the_imitation_the_network_acts_and_the_expert_is_queried():
    """Also in worlds that started while the expert acted."""
    imitating = {"expert": "scout", "imitation_share": 0.0, "imitation_weight": 2.0}
    trainer = Trainer(Training(scenario="starter", sizes=[(4, 2)], ppo=TINY, **imitating))
    trainer.learner.set_imitation(imitating=False, imitation_weight=2.0)
    batch, _ = trainer.learner.sample(trainer.rows, 1e-3, 1e-3)
    assert (batch.action - batch.mean).abs().max() < 0.01
    assert (batch.action - batch.expert_action).abs().mean() > 0.1


def test_training_worlds_are_not_those_of_validation():
    seeds = []
    trainer = Trainer(Training(scenario="starter", sizes=[(1, 2)], ppo=TINY))
    for _ in range(500):
        seeds.extend(trainer.rows._seeds(2))
    assert TRAINING_SEEDS == (100_000, VALIDATION_SEEDS)
    assert 100_000 <= min(seeds) < 110_000
    assert 890_000 < max(seeds) < VALIDATION_SEEDS


def test_the_critics_view_does_not_depend_on_the_order_of_vehicles():
    swarm = Swarm(load_scenario("single_obstacle", num_vehicles=12))
    swarm.reset(1)
    views = []
    order = np.random.default_rng(0).permutation(12)
    for rows in (np.arange(12), order):
        swarm.state.eta[0], swarm.state.nu[0] = swarm.state.eta[0, rows], swarm.state.nu[0, rows]
        swarm.state.before[0] = swarm.state.eta[0, :, :2]
        swarm.observe()
        views.append(privileged(swarm))
    np.testing.assert_allclose(views[0][:, order], views[1], atol=1e-5)
    assert np.isfinite(views[0]).all()


def small(**changes):
    """Of 168 agent-steps an iteration."""
    few = {"sizes": ((3, 3), (6, 2)), "checkpoint_every": 2, "validations": 2, "scenario": "starter"}
    shorter = {"time_limit.factor": 0.001, "time_limit.extra_s": 6.0}
    net = {"memory": True, "hidden": (8, 8)}
    return Training(**{"steps": 5 * 168, "ppo": TINY, "network": net, "overrides": shorter, **few, **changes})


@pytest.fixture
def no_validation(monkeypatch):
    verdicts = itertools.cycle([0.2, 0.5, 0.4])
    monkeypatch.setattr(trainings, "validate", lambda *_: GOOD._replace(swarm_success=next(verdicts)))


def begun(folder, iterations, **changes):
    """A training that was stopped after so many."""
    records = train(folder, small(**changes))
    for _ in range(iterations):
        next(records)
    records.close()


def files(folder):
    return {
        path.name: path.read_bytes()
        for path in (folder / "checkpoints" / "000005").iterdir()
        if path.name not in ("record.json", WEIGHTS_FILE)
    }


def rows(folder):
    with (folder / "progress.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("kind", [
    {},
    {"network": {"kind": "sectors", "hidden": (8,)}},
    {"filter": True},
    {"base_controller": "random"},
    {"base_controller": "scout"},
    {"expert": "scout", "imitation_share": 0.3},
    {"expert": "scout", "imitation_share": 0.3, "imitation_weight": 2.0},
], ids=["gru", "sectors", "filter", "random", "scout", "imitation", "weight"])  # fmt: skip
def test_a_resumed_training_equals_an_uninterrupted_one(kind, tmp_path, no_validation):
    """Bit for bit: weights, optimiser, memories, worlds and random numbers; stopped after a checkpoint, and between."""
    kind = {"validations": 1, **kind}
    records = list(train(tmp_path / "swarm_success", small(**kind)))
    for stop in (2, 3):
        begun(tmp_path / f"{stop}", stop, **kind)
        rest = list(resume(tmp_path / f"{stop}"))
        assert [record.iteration for record in rest] == [3, 4, 5]
        assert [record.reward for record in rest] == [record.reward for record in records[2:]]
        assert files(tmp_path / f"{stop}") == files(tmp_path / "swarm_success")
    assert [row["iteration"] for row in rows(tmp_path / "3")] == ["1", "2", "3", "4", "5"]
    assert (tmp_path / "3" / "curve.png").is_file()
    assert list(resume(tmp_path / "swarm_success")) == []


def test_a_finished_training_goes_on_to_more_steps_as_it_ended(tmp_path, no_validation):
    """Noise and rates stay what they were at its end; stopped and resumed it is the same bit for bit."""
    assert annealed((0.4, 0.1), 1.5) == annealed((0.4, 0.1), 1.0)
    assert len(list(train(tmp_path / "swarm_success", small(steps=2 * 168)))) == 2
    rest = list(resume(tmp_path / "swarm_success", 5 * 168))
    assert [record.iteration for record in rest] == [3, 4, 5]
    list(train(tmp_path / "parts", small(steps=2 * 168)))
    for steps in (4, 5):
        list(resume(tmp_path / "parts", steps * 168))
    assert files(tmp_path / "parts") == files(tmp_path / "swarm_success")
    assert json.loads((tmp_path / "parts" / "config.json").read_text())["training"]["steps"] == 2 * 168
    assert TrainingFolder(tmp_path / "parts", None).until == 5 * 168
    for until in (0.0, math.nan, math.inf):
        with pytest.raises(TrainingError, match="until must be above 0 and finite"):
            list(resume(tmp_path / "parts", until))


def test_a_training_of_minutes_ends_by_processor_time(tmp_path, no_validation):
    records = list(train(tmp_path, small(steps=None, minutes=0.005)))
    assert records[-2].seconds < 0.3 <= records[-1].seconds
    assert records[-1].swarm_success is not None
    with pytest.raises(TrainingError, match="has a budget of minutes; give --minutes, not --steps"):
        TrainingFolder(tmp_path, None).budget_with(None, 100)
    assert TrainingFolder(tmp_path, None).budget_with(2.0, None) == 120.0


def test_a_reward_of_ones_own_is_learned_from(tmp_path, no_validation, monkeypatch):
    (tmp_path / "mine.py").write_text(
        "import numpy as np\n"
        "def still(swarm):\n    return -np.hypot(*np.moveaxis(swarm.velocity, -1, 0))\n"
        "def single(swarm):\n    return np.zeros(swarm.num_worlds)\n"
        "number = 3\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    (record,) = train(tmp_path / "a", small(steps=1, reward="mine:still"))
    assert -6.0 < record.reward < 0.0
    with pytest.raises(RewardError, match=r"must have shape \(2, 2\) \(world, vehicle\), got \(2,\)"):
        list(train(tmp_path / "b", small(steps=1, sizes=((2, 2),), reward="mine:single")))
    for name, message in (
        ("mine:nothing", "reward 'mine:nothing' can't be imported.*give module:function"),
        ("mine:number", "must be a function of the swarm, got 3"),
    ):
        with pytest.raises(RewardError, match=message):
            list(train(tmp_path / name, small(steps=1, reward=name)))


def test_the_starter_scenario_is_learned_in_seconds(tmp_path):
    """From nothing to arrival: after 328,000 agent-steps 15 of 16 swarms were seen to arrive without a contact."""
    list(train(tmp_path / "a", Training(scenario="starter", steps=400_000, validations=1, validation_episodes=1)))
    policy = str(tmp_path / "a" / "best")
    assert sum(run["task_time_s"] is not None for run in evaluate(policy, "starter", range(10))) >= 7


def test_the_best_policy_is_kept_with_its_worst_episode(tmp_path, monkeypatch):
    scores = iter([0.2, 0.5, 0.4, 0.5])
    seen = iter([900_001, 900_002, 900_003, 900_004])
    judge = lambda *_: GOOD._replace(swarm_success=next(scores), share=0.5, worst=Worst("starter", 6, next(seen)))  # noqa: E731
    monkeypatch.setattr(trainings, "validate", judge)
    records = list(train(tmp_path / "a", small(validations=4, steps=4 * 168)))
    assert [record.best for record in records] == [0.35, 0.5, 0.5, 0.5]
    assert load_checkpoint(tmp_path / "a" / "best").card.training["record"]["iteration"] == 4
    best, command = trainings.best_of(tmp_path / "a")
    assert (best.iteration, best.swarm_success) == (4, 0.5)
    assert command.startswith(f"uuv-marl replay --scenario starter --policy {tmp_path}/a/best --seed 900004 --set ")
    assert "--set time_limit.extra_s=6.0" in command
    assert "--set swarm.num_vehicles=6" in command


def test_the_command_that_replays_an_episode_takes_a_trainings_tables(tmp_path):
    tables = {"task": {"name": "reach", "near_m": 20.0}, "timing": {"decision_period_s": 0.5}}
    training = small(overrides={**tables, "sonar": {"channels": []}})
    words = shlex.split(replay_command(tmp_path, training, Worst(training.scenario, 3, 900_000)))
    sets = [word for word, before in zip(words[1:], words, strict=False) if before == "--set"]
    assert 'task.name="reach"' in sets
    told = dict(parse_override(each) for each in sets)
    assert load_scenario("starter", overrides=told).task_numbers.near_m == 20.0
    assert "sonar.channels" not in told


def test_what_was_better_is_not_lost_with_a_process(tmp_path, monkeypatch):
    """A validation that was better comes with a checkpoint: time does not repeat, so it might not come again."""
    monkeypatch.setattr(trainings, "validate", lambda *_: GOOD)
    begun(tmp_path, 1, validations=5, checkpoint_every=100)
    assert TrainingFolder(tmp_path, None).record.best == GOOD.score


@pytest.mark.parametrize("law", ["mappo", "mine:Law", "./runs/best"])
def test_a_network_is_around_a_law_that_ships(law, tmp_path):
    with pytest.raises(PolicyError, match=f"base_controller must be one of bio_inspired, .*, got '{law}'"):
        Training(base_controller=law)
    card = card_for(load_scenario("starter")).model_copy(update={"base_controller": law})
    save_checkpoint(tmp_path / WEIGHTS_FILE, card, tensors(card))
    with pytest.raises(PolicyError, match="base_controller must be one of"):
        make_policy(str(tmp_path), load_scenario("starter"))
    with pytest.raises(PolicyError, match="base_controller must not have safety_filter=true.*set filter=true"):
        Training(base_controller="scout,safety_filter=true")


def test_each_gate_of_a_memory_begins_orthogonal():
    actor = Trainer(small()).learner.actor
    for block in np.split(actor.tensors["gru.state_weight"].detach().numpy(), 3, axis=1):
        np.testing.assert_allclose(block.T @ block, np.eye(len(block)), atol=1e-5)


def test_a_folder_that_is_used_or_empty_or_of_another_scenario_is_refused(tmp_path, no_validation):
    mine, folder = tmp_path / "mine.toml", tmp_path / "a"
    mine.write_text('extends = "starter"\nversion = 1\n')
    list(train(folder, small(steps=200, scenario=mine)))
    with pytest.raises(ResultsError, match="not empty; give --resume"):
        next(train(folder, small()))
    config = folder / "config.json"
    config.write_text(config.read_text().replace('"torch": "', '"torch": "0.'))
    assert "earlier parts ran with torch 0." in TrainingFolder(folder, None).resume_note
    mine.write_text('extends = "starter"\nversion = 1\n[arrival]\ndwell_s = 1.0\n')
    with pytest.raises(ResultsError, match=r"with arrival.dwell_s = .*, and arrival.dwell_s is 1.0 now; restore .*"):
        next(resume(folder))
    mine.unlink()
    with pytest.raises(ResultsError, match="can't be loaded here: scenario file .* does not exist.*resume it where"):
        next(resume(folder))
    with pytest.raises(ResultsError, match="holds no training to resume"):
        next(resume(tmp_path / "b"))


def test_an_expert_whose_file_has_changed_is_refused(tmp_path, no_validation):
    """Behind a prefix of its name, too; a folder from before files were noted goes on."""
    expert = tmp_path / "expert"
    card = card_for(small().loaded)
    weights = {name: 0.1 * array for name, array in tensors(card).items()}
    save_checkpoint(expert / WEIGHTS_FILE, card, weights)
    for k, name in enumerate((f"{expert}", f"{expert},safety_filter=true")):
        begun(tmp_path / f"{k}", 3, expert=name)
    shutil.copytree(tmp_path / "0", tmp_path / "same")
    assert list(resume(tmp_path / "same"))
    save_checkpoint(expert / WEIGHTS_FILE, card, {name: 2.0 * array for name, array in weights.items()})
    for k, name in enumerate((f"{expert}", f"{expert},safety_filter=true")):
        told = rf"started with expert = {name} \(\w+\), and expert is {name} \(\w+\) now; restore {name}, or start"
        with pytest.raises(ResultsError, match=told):
            next(resume(tmp_path / f"{k}"))
    config = tmp_path / "0" / "config.json"
    noted = json.loads(config.read_text())
    del noted["scenarios"][f"{expert}"]
    config.write_text(json.dumps(noted))
    assert list(resume(tmp_path / "0"))
    shutil.rmtree(expert)
    with pytest.raises(ResultsError, match="can't be loaded here: policy .* can't be read"):
        next(resume(tmp_path / "1"))


def test_a_training_that_is_asked_to_stop_ends_with_a_checkpoint(tmp_path, no_validation, uninterrupted):
    """After the iteration under way, and a resume goes on exactly, though no checkpoint was due."""
    stop = 3
    asked, said = iter(range(1, 9)), []
    first = list(train(tmp_path / "a", small(), stop=lambda: next(asked) == stop))
    assert [record.iteration for record in first] == list(range(1, stop + 1))
    rest = list(resume(tmp_path / "a", say=said.append))
    assert [record.iteration for record in rest] == list(range(stop + 1, 6))
    assert said[0] == f"resuming from iteration {stop}, {168 * stop:,} agent-steps"
    assert files(tmp_path / "a") == uninterrupted


def test_a_first_start_that_was_cut_off_can_be_started_again(tmp_path, no_validation):
    """By a kill before the settings were written, and between them and the first checkpoint."""
    (tmp_path / "a").mkdir()
    for name in (".lock", ".owner", "config.partial.json"):
        (tmp_path / "a" / name).write_text("")
    begun(tmp_path / "a", 1)
    assert not list((tmp_path / "a" / "checkpoints").iterdir())
    said = []
    assert len(list(resume(tmp_path / "a", say=said.append))) == 5
    assert "holds no checkpoint yet: starting from the beginning" in said[0]
    assert len(rows(tmp_path / "a")) == 5


def test_a_start_without_a_checkpoint_leaves_the_folder_to_another(tmp_path, no_validation):
    """As after an error in a reward of one's own, which another training may replace."""
    begun(tmp_path / "a", 1)
    done = list(train(tmp_path / "a", small(seed=7)))
    assert [record.iteration for record in done] == [1, 2, 3, 4, 5]
    assert json.loads((tmp_path / "a" / "config.json").read_text())["training"]["seed"] == 7
    list(train(tmp_path / "b", small(seed=7)))
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_what_is_not_its_own_stays(tmp_path, no_validation):
    begun(tmp_path, 2)
    own = tmp_path / "checkpoints"
    shutil.copytree(own / "000002", own / "keep_000002")
    (own / "README").write_text("mine")
    (own / "mine").mkdir()
    (own / "000001.partial").mkdir()
    list(resume(tmp_path))
    assert sorted(path.name for path in own.iterdir()) == ["000005", "README", "keep_000002", "mine"]


def test_an_incomplete_last_checkpoint_is_named(tmp_path, no_validation):
    begun(tmp_path / "a", 2)
    own = tmp_path / "a" / "checkpoints"
    shutil.copytree(own / "000002", tmp_path / "earlier")
    list(resume(tmp_path / "a"))
    (own / "000005" / "record.json").unlink()
    with pytest.raises(ResultsError, match="000005 is incomplete .record.json: No such file.*copy the whole"):
        next(resume(tmp_path / "a"))
    (own / "000005").rename(own / "000003.partial")
    shutil.copytree(tmp_path / "earlier", own / "000002")
    assert [record.iteration for record in resume(tmp_path / "a")] == [3, 4, 5]
    assert [path.name for path in own.iterdir()] == ["000005"]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_a_checkpoint_that_cannot_be_written_leaves_the_one_before(
    error, tmp_path, no_validation, monkeypatch, uninterrupted
):
    first = train(tmp_path / "a", small(validations=1))
    for _ in range(3):
        next(first)
    with monkeypatch.context() as full:
        full.setattr(trainings.json, "dumps", lambda *_: (_ for _ in ()).throw(error))
        kind, message = (ResultsError, "can't be written .No space left") if error.args else (type(error), None)
        with pytest.raises(kind, match=message):
            next(first)
    assert sorted(path.name for path in (tmp_path / "a" / "checkpoints").iterdir()) == ["000002", "000004.partial"]
    assert [record.iteration for record in resume(tmp_path / "a")] == [3, 4, 5]
    assert files(tmp_path / "a") == uninterrupted


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept") / "a"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trainings, "validate", lambda *_: GOOD)
        begun(folder, 2)
    return folder


DAMAGES = {
    "empty": lambda data: b"", "cut off": lambda data: data[: len(data) // 2], "no JSON object": lambda data: b"[]",
    "another's": lambda data: safetensors.numpy.save({"x": np.zeros(3)}),
}  # fmt: skip


def spoilt(change):
    """A file of arrays in which some are others, or missing."""
    return lambda data: safetensors.numpy.save(change(safetensors.numpy.load(data)))


@pytest.mark.parametrize(("name", "damage"), [
    *itertools.product(("learner.safetensors", "random.json", "config.json"), DAMAGES.values()),
    ("worlds.safetensors", DAMAGES["cut off"]),
    ("record.json", DAMAGES["no JSON object"]),
    ("learner.safetensors", spoilt(lambda a: a | {"actor.0.weight": np.full_like(a["actor.0.weight"], np.nan)})),
    ("learner.safetensors", spoilt(lambda a: a | {"actor.0.weight": a["actor.0.weight"][:3]})),
    ("learner.safetensors", spoilt(lambda a: a | {"state": a["state"][:3]})),
    ("learner.safetensors", spoilt(lambda a: {k: v for k, v in a.items() if k != "adam.3.exp_avg"})),
    ("worlds.safetensors", spoilt(lambda a: {k: v for k, v in a.items() if not k.startswith("1.")})),
    ("worlds.safetensors", spoilt(lambda a: a | {"0.eta": a["0.eta"][:, :2]})),
])  # fmt: skip
def test_a_damaged_file_is_named_with_the_remedy(name, damage, kept, tmp_path):
    shutil.copytree(kept, tmp_path / "a")
    path = tmp_path / "a" / name if name == "config.json" else tmp_path / "a" / "checkpoints" / "000002" / name
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ResultsError, match=f"{name}.*(copy|leave out --resume)"):
        next(resume(tmp_path / "a"))


def test_a_damaged_table_loses_only_what_is_damaged(kept, tmp_path, no_validation):
    shutil.copytree(kept, tmp_path / "a")
    table = tmp_path / "a" / "progress.csv"
    table.write_bytes(table.read_bytes() + b"\r\n\xff\r\n3,12")
    list(resume(tmp_path / "a"))
    assert [row["iteration"] for row in rows(tmp_path / "a")] == ["1", "2", "3", "4", "5"]


def test_a_training_fills_in_what_is_left_out(tmp_path):
    plain = Training()
    assert (plain.scenario, plain.minutes, plain.budget) == ("starter", 5.0, 300.0)
    assert [(part.vehicles, part.worlds) for part in plain.parts] == [(5, 128)]
    assert plain.loaded == load_scenario("starter"), "which fixes period and inner loop"
    assert plain.card.policy_class == "end to end"
    mixed = Training(scenario="hard_water", extra_scenarios=["hard_water_hard"], sizes=[10, (54, 2)])
    assert [(part.name, part.vehicles, part.worlds) for part in mixed.parts] == [
        ("hard_water", 10, 16), ("hard_water", 54, 2), ("hard_water_hard", 10, 16), ("hard_water_hard", 54, 2),
    ]  # fmt: skip
    free = Training(scenario="random_field", steps=100).loaded
    assert (free.timing.decision_period_s, free.actuators.yaw_damping_nms) == (0.5, 600.0)
    assert Training(scenario="starter", base_controller="scout,preset=wary").loaded.actuators.yaw_damping_nms == 600.0
    (tmp_path / "mine.toml").write_text('extends = "random_field"\n[swarm]\nnum_vehicles = 20\n')
    (tmp_path / "recipe.toml").write_text('scenario = "hard_water"\n[ppo]\ngamma = 0.98\n')
    mine = Training(**recipe_fields(str(tmp_path / "mine.toml")))
    assert [(part.vehicles, part.worlds) for part in mine.parts] == [(20, 32)]
    assert Training(**recipe_fields(str(tmp_path / "recipe.toml"))).ppo.gamma == 0.98
    assert recipe_fields("starter") == {"scenario": "starter"}


def test_changed_channels_are_those_of_all_scenarios_and_other_changes_of_the_first_alone():
    changes = {"sonar.channels": ["identity"], "time_limit.extra_s": 9.0}
    training = Training(scenario="silent_targets", extra_scenarios=["silent_targets_easy"], overrides=changes)
    first, second = (part.scenario for part in training.parts)
    assert first.sonar.channels == second.sonar.channels == ("identity",)
    assert (first.time_limit.extra_s, second.time_limit.extra_s) == (9.0, 0.0)


@pytest.mark.parametrize(("wrong", "message"), [
    ({"ppo": {"learning_rate": (np.inf, 0.1)}}, "ppo.learning_rate.0 must be a finite number, got inf"),
    ({"ppo": {"noize": 0.1}}, "ppo.noize is unknown; did you mean 'ppo.noise'"),
    ({"network": {"kind": "cnn"}}, "network.kind must be 'mlp', 'sectors' or 'moments', got 'cnn'"),
    ({"minutes": 1, "steps": 100}, "minutes = 1 and steps = 100 are both given; leave one out"),
    ({"reward": "geodesic"}, "reward must be one of dense, sparse, team, the rewards of task 'follow'"),
    ({"base_controller": "scoot"}, "policy 'scoot' is unknown; did you mean 'scout'?"),
    ({"base_controller": "scout", "expert": "scout"}, "and base_controller 'scout' are both given; leave one out"),
    ({"imitation_weight": 2.0}, "imitation_weight = 2 needs an expert, and none is given; name one, or leave"),
    ({"sizes": [[5, -1]]}, "sizes.0.1 must be greater than or equal to 0, got -1"),
    ({"extra_scenarios": ["few_informed"]}, "has 'few_informed' with another percept than 'starter', and one"),
])  # fmt: skip
def test_fields_that_cannot_be_trained_with_are_named_with_the_remedy(wrong, message):
    with pytest.raises((TrainingError, ScenarioError, PolicyError), match=re.escape(message)):
        _ = Training(**wrong).loaded


def test_what_is_written_is_what_was_told():
    numpys = {"timing.decision_period_s": np.float64(0.5), "obstacles": np.array([])}
    told = Training(network={"memory": True}, seed=np.int64(2), overrides=numpys)
    written = json.loads(told.model_dump_json())
    assert (written["network"]["memory"], written["seed"], written["overrides"]["obstacles"]) == (True, 2, [])
    assert Training(**written) == told


def test_a_file_that_is_no_recipe_is_named(tmp_path):
    (tmp_path / "bad.toml").write_text("steps = \n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"bad.toml is not valid TOML"):
        recipe_fields(str(tmp_path / "bad.toml"))
    with pytest.raises(ScenarioError, match=r"gone.toml can't be read \(No such file or directory\); give"):
        recipe_fields(str(tmp_path / "gone.toml"))


def test_the_command_says_what_to_train_and_can_be_stopped(tmp_path, monkeypatch):
    before = signal.getsignal(signal.SIGINT)  # ignored where the tests run in the background
    calls, interrupts = [], 0

    def fake(output, given, *, say, stop):
        calls.append(given)
        yield Record(1, 500, 2.0, -1.5, 0.01, 0.5, 0.25, 0.75, 0.9, 0.5, 30.0)
        for _ in range(interrupts):
            os.kill(os.getpid(), signal.SIGINT)
        assert stop() is bool(interrupts)

    monkeypatch.setattr(trainings, "train", fake)
    command = ["train", "hard_water", "--steps=1e3", "--seed=3", f"--output={tmp_path}", "--set=network.memory=true"]
    command += ["--set=sizes=[5,20]", "--set=ppo.noise=[0.3, 0.1]", "--set=sonar.echo_reports=centre"]
    output = succeeds(*command)
    assert "swarm success 75%, vehicles 90%, collisions 0.5 per episode, time 30 s" in output
    assert "250 agent-steps/s" in output
    assert calls == [
        Training(
            scenario="hard_water", steps=1000, seed=3, sizes=(5, 20), network={"memory": True},
            ppo={"noise": (0.3, 0.1)}, overrides={"sonar.echo_reports": "centre"},
        )
    ]  # fmt: skip
    for pressed, said in ((1, "Stopping after this iteration"), (2, "Nothing was written yet")):
        interrupts = pressed
        status, output = cli(*command)
        assert status == 130
        assert said in output
    assert signal.getsignal(signal.SIGINT) is before


def test_the_command_goes_on_with_what_the_folder_holds(tmp_path, no_validation):
    list(train(tmp_path, small(steps=168)))
    here = "train", "--resume", f"--output={tmp_path}"
    refused("continues the training in the folder; leave out the scenario", *here, "hard_water")
    output = succeeds(*here, "--steps=336")
    assert "Best validation: swarm success" in output
    assert f"uuv-marl replay --scenario starter --policy {tmp_path}/best --seed 900000" in output
    assert [row["agent_steps"] for row in rows(tmp_path)] == ["168", "336"]
    assert "the budget was already spent" in cli(*here)[1]


def how_torch_computes():
    """What ``fixed_torch`` fixes; the last is whether there are numbers below the normal ones."""
    modes = torch.is_grad_enabled(), torch.is_inference_mode_enabled(), torch.is_autocast_enabled("cpu")
    numbers = torch.get_default_dtype(), torch.get_default_device(), torch.backends.mkldnn.enabled
    return torch.get_num_threads(), *modes, *numbers, sys.float_info.min / 2.0 > 0.0


FIXED = 1, True, False, False, torch.float32, torch.device("cpu"), False, True


def global_state():
    """What a training may change of the process."""
    numpys = str(np.random.get_state()), np.geterr()  # noqa: NPY002 - that of others
    flags = torch.get_float32_matmul_precision(), torch.get_deterministic_debug_mode()
    return *how_torch_computes(), *flags, torch.get_rng_state().tolist(), random.getstate(), *numpys


@contextlib.contextmanager
def put(set_to, value, before):
    set_to(value)
    try:
        yield
    finally:
        set_to(before)


SETTINGS = {
    "none": contextlib.nullcontext,
    "float64": lambda: put(torch.set_default_dtype, torch.float64, torch.float32),
    "half": lambda: put(torch.set_default_dtype, torch.bfloat16, torch.float32),
    "device": lambda: put(torch.set_default_device, "meta", None),
    "no gradients": lambda: put(torch.set_grad_enabled, False, True),
    "inference": torch.inference_mode,
    "autocast": lambda: torch.autocast("cpu", torch.bfloat16),
    "precision": lambda: put(torch.set_float32_matmul_precision, "medium", "highest"),
    "oneDNN": lambda: put(lambda on: setattr(torch.backends.mkldnn, "enabled", on), True, False),
    "deterministic": lambda: put(torch.use_deterministic_algorithms, True, False),
    "denormals": lambda: put(torch.set_flush_denormal, True, False),
    "threads": lambda: put(torch.set_num_threads, 2, 1),
    "numpy raises": lambda: np.errstate(all="raise"),
    "warnings raise": lambda: warnings.catch_warnings(action="error"),
}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """Files of a training that nothing has stopped and nothing outside has changed."""
    folder = tmp_path_factory.mktemp("uninterrupted") / "a"
    with pytest.MonkeyPatch.context() as patch, trainings.fixed_torch():
        patch.setattr(trainings, "validate", lambda *_: GOOD)
        list(train(folder, small()))
    return files(folder)


@pytest.mark.parametrize("setting", SETTINGS)
def test_what_others_set_changes_no_training_and_holds_between_its_iterations(
    setting, uninterrupted, tmp_path, no_validation
):
    inside = []
    with SETTINGS[setting]():
        before = global_state()
        for _ in train(tmp_path, small(), stop=lambda: inside.append(how_torch_computes())):
            assert global_state() == before
        assert global_state() == before
    assert inside == [FIXED] * 5
    assert files(tmp_path) == uninterrupted


def test_a_training_that_fails_gives_global_state_back(tmp_path, no_validation):
    torch.set_num_threads(2)
    before = global_state()
    with pytest.raises(ZeroDivisionError):
        list(train(tmp_path, small(), stop=lambda: 1 / 0))
    assert global_state() == before


def test_what_is_annealed_goes_in_equal_ratios_or_evenly_from_nothing():
    assert [annealed((1.0, 100.0), share) for share in (0.0, 0.5, 1.0, 2.0)] == pytest.approx([1.0, 10.0, 100.0, 100.0])
    assert [annealed((0.0, 8.0), share) for share in (0.0, 0.5, 2.0)] == [0.0, 4.0, 8.0]
    assert annealed((0.0, 0.0), 0.5) == 0.0
