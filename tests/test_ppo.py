"""Stable-Baselines3's PPO on problems with known answers, through the rows of several SwarmVecEnv."""

import itertools
import random

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3.common.vec_env import VecEnv

from uuv_marl import load_scenario
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, load_checkpoint
from uuv_marl.baselines.learned.network import forward
from uuv_marl.sim.streams import packed, unpacked
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train import ppo as ppos
from uuv_marl.train import training as trainings
from uuv_marl.train.env import TRAINING_SEEDS, TrainingEnv
from uuv_marl.train.group import Problem
from uuv_marl.train.ppo import Hyperparameters, Ppo
from uuv_marl.train.settings import Settings
from uuv_marl.train.shaping import Weights
from uuv_marl.train.training import train
from uuv_marl.train.validation import validation_result
from uuv_marl.train.vec_env import TrainingVecEnv

OPEN_WATER = {
    "timing.decision_period_s": 0.5,
    "actuators.yaw_damping_nms": 600.0,
    "trajectory.waypoints_m": [[0.0, 0.0], [160.0, 0.0]],
}
SIZES = ((3, 3), (6, 2))
TINY = Hyperparameters(hidden=(16, 16), horizon=8, minibatch=84)


@pytest.fixture(autouse=True)
def one_thread():
    with trainings.one_thread():
        yield


def open_water(**overrides):
    return load_scenario("tracking", overrides={**OPEN_WATER, **overrides})


class OneStep(VecEnv):
    """Rows see two numbers (x1, x2) and are paid most where the action is (x1, -x2) / 2; every step ends them."""

    def __init__(self, *_):
        self.render_mode, self.reward_sum, self._rng = None, 0.0, np.random.default_rng(1)
        super().__init__(64, Box(-1.0, 1.0, (2,)), Box(-8.0, 8.0, (2,), np.float32))

    def reset(self):
        self.observation = self._rng.uniform(-1, 1, (64, 2)).astype(np.float32)
        return self.observation

    def step_async(self, actions):
        self._reward = -10.0 * np.sum((actions - self.observation * (0.5, -0.5)) ** 2, axis=1)

    def step_wait(self):
        self.reward_sum += float(self._reward.mean())
        infos = [{"terminal_observation": row, "TimeLimit.truncated": False} for row in self.observation]
        return self.reset(), self._reward.astype(np.float32), np.ones(64, np.bool_), infos

    def close(self): ...
    def get_attr(self, attr_name, indices=None):
        return [getattr(self, attr_name)] * 64

    def set_attr(self, *_): ...
    def env_method(self, *_): ...
    def env_is_wrapped(self, *_):
        return [False] * 64


def test_a_one_step_task_is_solved(monkeypatch):
    """Seeds 0 to 4 miss by 0.007 to 0.011, the same with AVX-512 and with torch's default kernels."""
    monkeypatch.setattr(ppos, "TrainingVecEnv", OneStep)
    by = Hyperparameters(hidden=(32,), horizon=8, minibatch=128, kl_stop=0.05, learning_rate=(3e-3, 5e-4))
    algorithm = Ppo(by, Problem(open_water(), SIZES, Weights()), 0)
    rewards = [algorithm.iterate(k / 100)[0] for k in range(100)]
    assert np.mean(rewards[:5]) < -2.0
    x = np.random.default_rng(5).uniform(-1, 1, (500, 2)).astype(np.float32)
    error = forward(algorithm.layers, x) - x * (0.5, -0.5)
    assert np.sqrt(np.mean(error**2)) < 0.1


def test_a_checkpoint_acts_as_the_model_does():
    """Whatever was learned: the layers that are kept give the mean of Stable-Baselines3's own distribution."""
    algorithm = Ppo(TINY, Problem(open_water(), SIZES, Weights()), 0)
    algorithm.iterate(0.0)
    x = np.random.default_rng(5).standard_normal((50, algorithm.model.observation_space.shape[0]), np.float32)
    with torch.no_grad():
        mean = algorithm.model.policy.get_distribution(torch.from_numpy(x)).distribution.mean.numpy()
    np.testing.assert_allclose(forward(algorithm.layers, x), mean, atol=1e-5)
    assert np.abs(mean).max() > 1e-3


def test_endings_are_told_as_sb3_wants_them():
    """A cut-off row tells what it would have seen next, an arrived one that nothing comes after."""
    arrives = {
        "trajectory.waypoints_m": [[0.0, 0.0], [4.0, 0.0]],
        "arrival.radius_m": 500.0,
        "arrival.spread_m": 500.0,
    }
    for overrides, arrived in (
        (arrives, True),
        ({**arrives, "arrival.radius_m": 1e-3, "time_limit.extra_s": 5.0}, False),
    ):
        vec_env = TrainingVecEnv(Problem(open_water(**overrides), [(1, 1), (3, 1)], Weights()))
        vec_env.seed(0)
        start = vec_env.reset()
        for _ in range(12):
            observation, _, dones, infos = vec_env.step(np.zeros((4, 2), np.float32))
        assert dones.all()
        for row in range(4):
            assert infos[row].get("TimeLimit.truncated", False) is not arrived
            if not arrived:
                last = infos[row]["terminal_observation"]
                assert last.shape == start[row].shape
                assert np.abs(last - observation[row]).max() > 0.01, "what comes next is another episode's start"
        episodes = vec_env.env.pop_episode_stats()
        assert (episodes.number, episodes.arrived, episodes.decisions) == (2, 2 * arrived, 24)


def test_training_worlds_are_not_those_of_validation():
    """Seeds that count on beyond the training range begin again at its start."""
    env = TrainingVecEnv(Problem(open_water(), SIZES, Weights()))
    low, high = TRAINING_SEEDS
    env.seed(high - 2)
    assert [*env._draw(3)] == [high - 2, high - 1, low]
    assert [*env._draw(2)] == [low + 1, low + 2]


def test_streams_go_on_from_a_snapshot():
    streams = [np.random.default_rng(3), None]
    streams[0].integers(2, dtype=np.uint32)  # leaves half a number behind
    again = unpacked(packed(streams), len(streams))
    assert again[1] is None
    assert list(again[0].integers(9, size=5, dtype=np.uint32)) == list(streams[0].integers(9, size=5, dtype=np.uint32))
    swarm = Swarm(load_scenario("random_field", num_vehicles=3), 2)
    swarm.reset(5)
    kept = swarm.snapshot()
    swarm.reset()
    later = swarm.snapshot()
    swarm.restore(kept)
    swarm.reset()
    assert all(np.array_equal(array, later[name], equal_nan=True) for name, array in swarm.snapshot().items())


def settings(**changes):
    overrides = {
        "timing.decision_period_s": 0.5,
        "actuators.yaw_damping_nms": 600.0,
        "trajectory.waypoints_m": [[0.0, 0.0], [36.0, 0.0]],
        "time_limit.extra_s": 0.0,
    }
    few = {"sizes": SIZES, "validation": ((3, 1),), "checkpoint_every": 2, "validate_every": 3}
    return Settings(
        **{"scenario": "tracking", "steps": 5 * 168, "overrides": overrides, "algorithm": TINY, **few, **changes}
    )


def files(folder):
    return {
        path.name: path.read_bytes()
        for path in (folder / "checkpoints" / "000005").iterdir()
        if path.name not in ("record.json", WEIGHTS_FILE)
    }


def test_a_resumed_training_equals_an_uninterrupted_one(tmp_path, monkeypatch):
    """Bit for bit, with episodes that end all the time, whatever others draw from the global generators meanwhile."""
    scores = itertools.cycle([-1.0, -0.5])
    result = validation_result([{"task_time_s": None, "duration_s": 1.0, "collisions": 0, "min_spacing_m": 7.0,
                      "min_obstacle_distance_m": None}])  # fmt: skip
    monkeypatch.setattr(trainings, "validate", lambda *_: result._replace(score=next(scores)))
    before = torch.get_rng_state(), random.getstate()
    records = list(train(tmp_path / "whole", settings()))
    assert torch.equal(torch.get_rng_state(), before[0]), "the global generators are left as they were"
    assert random.getstate() == before[1]
    for stop in (2, 3):
        first = train(tmp_path / f"{stop}", settings())
        for _ in range(stop):
            next(first)
        first.close()
        torch.rand(3)
        rest = list(train(tmp_path / f"{stop}", settings(), resume=True))
        assert [record.iteration for record in rest] == [3, 4, 5]
        assert [record.reward for record in rest] == [record.reward for record in records[2:]]
        assert files(tmp_path / f"{stop}") == files(tmp_path / "whole")
    other = list(train(tmp_path / "other", settings(seed=1)))
    assert other[0].reward != records[0].reward
    assert load_checkpoint(tmp_path / "whole" / "best").card.training["algorithm"]["name"] == "ppo"


def test_a_short_training_beats_random_by_far():
    """Random vehicles are paid -6.09, idle ones -3.67. Seeds 0 to 6 reached -1.46 to -1.80; at least -3.05 is asked.
    Torch's default kernels gave -1.43 to -2.03 for seeds 0 to 4."""
    sizes = [(4, 8), (9, 4)]
    by = Hyperparameters(hidden=(32, 32), horizon=32, minibatch=272, epochs=6, kl_stop=0.1, learning_rate=(3e-3, 3e-4))
    algorithm = Ppo(by, Problem(open_water(), sizes, Weights()), 0)
    rewards = [algorithm.iterate(k / 60)[0] for k in range(60)]
    env = TrainingEnv(Problem(open_water(), sizes, Weights()), lambda num: range(100_000, 100_000 + num))
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (60, env.rows, 2)).astype(np.float32)
    floor = np.mean([env.step(action).reward for action in actions])
    assert np.mean(rewards[-8:]) > floor / 2, "rewards are negative: less than half of the cost"
