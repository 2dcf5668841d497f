"""Stable-Baselines3 itself: its PPO and SAC, its wrappers, its checks, on our environments."""

import gymnasium
import numpy as np
import pytest
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.vec_env import VecCheckNan, VecFrameStack, VecMonitor, VecNormalize

from tests.contract import ARRIVES
from tests.processes import ROOT, python
from uuv_marl import load_scenario, parallel_env
from uuv_marl.baselines import PolicyError, make_policy, with_policy_requirements
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.train import run
from uuv_marl.train.sb3 import save_sb3

SHORT = {"time_limit.factor": 0.01, "time_limit.extra_s": 5.0}


@pytest.fixture(autouse=True)
def fixed_torch():
    """Sums in another order give other bits."""
    with run.fixed_torch():
        yield


def swarm(num_worlds=2, scenario="random_field", overrides=SHORT, **kwargs):
    return SwarmVecEnv(scenario, num_worlds, num_vehicles=4, decision_period=0.5, overrides=overrides, **kwargs)


def weights(model):
    return np.concatenate([p.detach().numpy().ravel() for p in model.policy.parameters()])


def learn(env, seed=3):
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=64, n_epochs=2, seed=seed, device="cpu")
    before = weights(model)
    model.learn(3 * 32 * env.num_envs)
    assert np.isfinite(weights(model)).all()
    assert not np.array_equal(before, weights(model))
    return model


def test_ppo_learns_and_a_seed_fixes_it():
    first, second = learn(swarm()), learn(swarm())
    assert weights(first).tobytes() == weights(second).tobytes()
    assert weights(first).tobytes() != weights(learn(swarm(), seed=4)).tobytes()
    assert first.num_timesteps == 3 * 32 * 8
    mean, _ = evaluate_policy(first, swarm(), n_eval_episodes=8)
    assert np.isfinite(mean)


def test_recurrent_ppo_forgets_where_an_episode_begins():
    """All rows of a world start together, one step after their end, and then act as a policy that remembers nothing."""
    env = swarm(overrides={**SHORT, "time_limit.extra_s": 4.0})
    model = RecurrentPPO("MlpLstmPolicy", env, n_steps=40, batch_size=80, n_epochs=1, seed=3, device="cpu")
    model.learn(40 * env.num_envs)
    starts = model.rollout_buffer.episode_starts.reshape(2, 4, 40)  # row after row, each in the order of time
    assert (starts == starts[:, :1]).all()
    assert starts[..., 0].all()
    assert 2 <= starts[:, 0, 1:].sum() < 40
    env.seed(0)
    observation, state, start = env.reset(), None, np.ones(8, bool)
    began = 0
    for _ in range(40):
        action, state = model.predict(observation, state, start, deterministic=True)
        fresh, _ = model.predict(observation, deterministic=True)
        same = (action == fresh).all(axis=1)
        np.testing.assert_array_equal(same, start)
        observation, _, start, _ = env.step(action)
        began += start.sum()
    assert began >= 16


def test_normalising_and_stacking_wrappers():
    learn(VecNormalize(VecCheckNan(swarm(), raise_exception=True)))
    learn(VecFrameStack(swarm(), 2))


def test_episode_statistics_agree_with_vecmonitor():
    with pytest.warns(UserWarning, match="already wrapped with a `Monitor`"):
        ours, theirs = swarm(), VecMonitor(swarm())
    for env in (ours, theirs):
        env.seed(5)
        env.reset()
    rng, ended = np.random.default_rng(0), 0
    for _ in range(60):
        actions = rng.uniform(-1, 1, (8, 2)).astype(np.float32)
        _, _, done, mine = ours.step(actions)
        *_, monitored = theirs.step(actions)
        for row in np.flatnonzero(done):
            assert mine[row]["episode"]["r"] == pytest.approx(monitored[row]["episode"]["r"], abs=1e-5)
            assert mine[row]["episode"]["l"] == monitored[row]["episode"]["l"]
            ended += 1
    assert ended >= 24


def test_time_limits_are_bootstrapped_and_arrivals_are_not(monkeypatch):
    """What SB3 puts into its buffer: at a time limit the value of ``terminal_observation`` is added, at arrival not."""
    for overrides, scenario, truncated in ((SHORT, "random_field", True), (ARRIVES, "single_obstacle", False)):
        env = swarm(scenario=scenario, overrides=overrides)
        model = PPO("MlpPolicy", env, n_steps=40, batch_size=64, n_epochs=1, seed=0, device="cpu")
        asked = []
        predict = model.policy.predict_values
        monkeypatch.setattr(model.policy, "predict_values", lambda o, p=predict, a=asked: (a.append(o.shape), p(o))[1])
        model.learn(40 * env.num_envs)
        single = [shape for shape in asked if tuple(shape) == (1, 98)]
        assert bool(single) == truncated


@pytest.mark.parametrize("others", ["bio_inspired", "sdc"])
def test_solo_passes_sb3s_check(scenario_name, others):
    check_env(gymnasium.make("uuv_marl/Solo-v2", scenario=scenario_name, num_vehicles=8, others=others))


def test_sac_learns_on_solo():
    env = gymnasium.make("uuv_marl/Solo-v2", num_vehicles=4, decision_period=0.5, overrides=SHORT)
    model = SAC("MlpPolicy", env, learning_starts=40, batch_size=32, seed=1, device="cpu")
    before = weights(model)
    model.learn(120)
    assert np.isfinite(weights(model)).all()
    assert not np.array_equal(before, weights(model))
    assert model.ep_info_buffer


def test_a_monitor_finds_its_keys_where_a_wrapper_ends_the_episode():
    env = gymnasium.make("uuv_marl/Solo-v2", scenario="starter", max_episode_steps=5)
    env = Monitor(env, info_keywords=("is_success", "ending", "arrived", "time_s", "collisions"))
    told = env.reset(seed=0)[1]
    assert told["ending"] == "running"
    for _ in range(5):
        *_, truncated, info = env.step(np.zeros(2, np.float32))
        assert info.keys() >= told.keys()
    assert truncated
    assert info["episode"]["ending"] == "running"
    assert info["episode"]["is_success"] is False


def actors(**more):
    damped = {"actuators.yaw_damping_nms": 600.0, "time_limit.factor": 0.02, "time_limit.extra_s": 2.0}
    return swarm(overrides=damped, observe="closeness", **more)


def test_a_checkpoint_acts_as_the_model_does(tmp_path):
    """In NumPy, from the percepts of the swarm: the model's mean action within its bounds, at each decision."""
    env = actors()
    model = learn(VecNormalize(env, norm_obs=False))
    save_sb3(model, tmp_path / "policy.safetensors")
    policy, observation = make_policy(str(tmp_path), env.scenario, 2), env.reset()
    for _ in range(20):
        output = model.predict(observation, deterministic=True)[0]
        within = output / np.maximum(1.0, np.linalg.norm(output, axis=1, keepdims=True))
        np.testing.assert_allclose(policy.act(env.swarm.percept).reshape(-1, 2), within, atol=1e-5)
        observation, *_ = env.step(output)


class Doubled(FlattenExtractor):
    """Features that are not the observation."""

    def forward(self, observations):
        return 2.0 * super().forward(observations)


def test_a_model_that_makes_no_checkpoint_is_refused(tmp_path):
    other_input, other_network = "train on SwarmVecEnv.*observe='closeness'", "tanh layers before its last.*leave"
    for env, options, message in (
        (swarm(), {}, other_input),
        (VecNormalize(actors()), {}, other_input),
        (VecFrameStack(actors(), 2), {}, other_input),
        (actors(), {"activation_fn": torch.nn.ReLU}, other_network),
        (actors(), {"squash_output": True}, other_network),
        (actors(), {"features_extractor_class": Doubled}, other_network),
        (actors(), {"net_arch": []}, other_network),
    ):
        model = PPO("MlpPolicy", env, use_sde="squash_output" in options, policy_kwargs=options, device="cpu")
        with pytest.raises(PolicyError, match=message):
            save_sb3(model, tmp_path / "a")


def test_the_example_trains_a_policy(tmp_path):
    words = ["--worlds=1", "--steps=100", f"--output={tmp_path}"]
    said = python(ROOT / "examples" / "training" / "sb3.py", *words)
    assert f"--scenario starter --policy {tmp_path}" in said
    assert PPO.load(tmp_path / "model").num_timesteps > 100
    scenario = with_policy_requirements(str(tmp_path), load_scenario("starter"))
    assert make_policy(str(tmp_path), scenario).requirements.yaw_damping_nms == 600.0


def test_a_reset_or_a_refusal_leaves_no_action_behind():
    env = swarm()
    env.reset()
    env.step_async(np.ones((8, 2)))
    env.reset()
    with pytest.raises(RuntimeError, match="step_wait was called before step_async"):
        env.step_wait()
    with pytest.raises(ValueError, match="must be finite, got nan"):
        env.step(np.full((8, 2), np.nan))
    with pytest.raises(RuntimeError, match="step_wait was called before step_async"):
        env.step_wait()
    with pytest.raises(NotImplementedError, match="a reset has no options"):
        env.set_options({"a": 1})


def test_a_row_succeeds_by_itself():
    task = {"name": "reach", "near_m": 133.95}  # some vehicles start there
    env = SwarmVecEnv("starter", 1, task=task, max_cycles=1)
    env.seed(0)
    env.reset()
    *_, infos = env.step(np.zeros((5, 2)))
    single = parallel_env("starter", task=task, max_cycles=1)
    single.reset(seed=0)
    *_, told = single.step(dict.fromkeys(single.agents, np.zeros(2)))
    there = [told[f"uuv_{i}"]["is_success"] for i in range(5)]
    assert [info["is_success"] for info in infos] == there
    assert 0 < sum(there) < 5


def test_sb3_evaluates_rows_without_a_wrapper():
    env = swarm()
    model = PPO("MlpPolicy", env, device="cpu")
    _, lengths = evaluate_policy(model, env, 8, return_episode_rewards=True)  # a warning would be an error
    assert len(lengths) == 8
    assert min(lengths) > 1
    assert env.env_is_wrapped(Monitor) == [True] * 8
    assert not any(env.env_is_wrapped(gymnasium.wrappers.TimeLimit))
