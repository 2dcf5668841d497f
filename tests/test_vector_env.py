"""Gymnasium's APIs: many worlds, one learner among others, the registries."""

import importlib
import pickle
import warnings
from functools import partial

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as wrappers
from packaging.version import Version

import uuv_marl
from tests.golden import STARTER
from uuv_marl import baselines
from uuv_marl.envs.solo import SoloEnv
from uuv_marl.scenario import ScenarioError

SHORT = {"time_limit.factor": 0.01, "time_limit.extra_s": 5.0}
SLOW_LAUV = {"vehicle": "lauv", "trajectory.speed_mps": 1.5, "start.speed_max_mps": 1.5}


def short(num_envs=3, **kwargs):
    return uuv_marl.vector_env(num_envs, "random_field", num_vehicles=5, decision_period=0.5, overrides=SHORT, **kwargs)


def random_actions(env, steps=40):
    return np.random.default_rng(1).uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)


def test_seeds_per_world_and_masks():
    env = short()
    first = env.reset(seed=[4, None, 5])[0]
    np.testing.assert_array_equal(env.reset(seed=4)[0][0], first[0])
    again = env.reset(seed=[5, 6, 7], options={"reset_mask": np.array([True, False, False])})[0]
    np.testing.assert_array_equal(again[0], first[2])
    np.testing.assert_array_equal(again[1], short(1).reset(seed=5)[0][0])  # as reset(seed=4) left it
    for mask in (np.zeros(3, bool), np.ones(2, bool), np.ones(3, int)):
        with pytest.raises(ValueError, match=r"reset_mask'\] must be a bool array of shape \(3,\)"):
            env.reset(options={"reset_mask": mask})
    for large in (2**63 - 1, 2**64):
        assert env.reset(seed=large)[0].tobytes() == env.reset(seed=large)[0].tobytes()
    assert env.reset(seed=np.int64(4))[0].tobytes() == env.reset(seed=np.array([4, 5, 6]))[0].tobytes()


def test_without_autoreset_an_ended_world_waits_unpaid():
    env, resetting = short(autoreset_mode="Disabled", max_cycles=9), short(max_cycles=9)
    assert env.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    shaped = wrappers.FlattenObservation(env)
    shaped.reset(seed=0)
    resetting.reset(seed=0)
    for action in random_actions(env, 9):
        shaped.step(action.reshape(shaped.action_space.shape))
        *_, infos = resetting.step(action)
    observation, reward, _, truncated, infos_after = env.step(random_actions(env, 1)[0])
    assert truncated.all()
    assert not reward.any()
    assert not infos_after["agent_mask"].any()
    for world in range(3):
        np.testing.assert_array_equal(observation[world], infos["final_obs"][world])
    mask = np.array([False, True, False])
    again, infos_after = env.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(infos_after["agent_mask"].any(axis=1), mask)
    np.testing.assert_array_equal(again[1], resetting.swarm.percept.to_observation()[1])
    np.testing.assert_array_equal(again[0], observation[0])
    *_, truncated, _ = env.step(random_actions(env, 1)[0])
    np.testing.assert_array_equal(truncated, ~mask)


def test_a_reset_by_hand_comes_before_the_next_steps():
    env = short(autoreset_mode=AutoresetMode.NEXT_STEP, max_cycles=1)
    env.reset(seed=0)
    actions = np.zeros((3, 5, 2), np.float32)
    env.step(actions)
    begun, _ = env.reset(seed=[7, 8, 9], options={"reset_mask": np.array([False, True, False])})
    _, _, _, truncated, _ = env.step(actions)
    assert truncated.tolist() == [False, True, False], "world 1 was stepped, the others were reset"
    np.testing.assert_array_equal(begun[1], short(1).reset(seed=8)[0][0])


class Alone(gymnasium.Env):
    """One world as a plain Gymnasium environment, for Gymnasium's own ``SyncVectorEnv``."""

    def __init__(self):
        self.env = short(1, max_cycles=4, autoreset_mode="Disabled")
        self.observation_space, self.action_space = self.env.single_observation_space, self.env.single_action_space

    def reset(self, *, seed=None, options=None):
        return self.env.reset(seed=seed)[0][0], {}

    def step(self, action):
        observation, reward, terminated, truncated, infos = self.env.step(action[None])
        info = {"ending": infos["ending"][0]} if "ending" in infos else {}
        return observation[0], reward[0], terminated[0], truncated[0], info


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_resets_come_when_gymnasiums_own_vectoriser_makes_them(mode):
    ours = short(2, max_cycles=4, autoreset_mode=mode)
    theirs = gymnasium.vector.SyncVectorEnv([Alone, Alone], autoreset_mode=mode)
    np.testing.assert_array_equal(ours.reset(seed=6)[0], theirs.reset(seed=6)[0])
    for actions in random_actions(ours, 20):
        *mine, my_infos = ours.step(actions)
        *given, infos = theirs.step(actions)
        for a, b in zip(mine, given, strict=True):
            np.testing.assert_array_equal(a, b)
        if mode is AutoresetMode.SAME_STEP:
            assert ("final_obs" in my_infos) == ("final_obs" in infos)
            my_infos, infos = my_infos.get("final_info", {}), infos.get("final_info", {})
        assert ("ending" in my_infos) == ("ending" in infos)
        if "ending" in infos:
            assert my_infos["ending"].tolist() == infos["ending"].tolist()


def test_observations_handed_out_stay_as_they_are():
    env = short()
    first, _ = env.reset(seed=0)
    kept = first.copy()
    actions = random_actions(env)
    second, reward, *_, infos = env.step(actions[0])
    kept_second, kept_reward, kept_mask = second.copy(), reward.copy(), infos["agent_mask"].copy()
    endings = []
    for action in actions[1:]:
        *_, later = env.step(action)
        if "final_obs" in later:
            endings.append((later, pickle.dumps(later)))
    assert all(pickle.dumps(later) == as_it_was for later, as_it_was in endings)
    mask = np.array([True, False, False])
    _, begun = env.reset(options={"reset_mask": mask})
    mask[:] = False
    assert begun["_agent_mask"].tolist() == [True, False, False]
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(second, kept_second)
    np.testing.assert_array_equal(reward, kept_reward)
    np.testing.assert_array_equal(infos["agent_mask"], kept_mask)


@pytest.mark.skipif(
    Version(gymnasium.__version__) < Version("1.4"),
    reason="before Gymnasium 1.4 RecordEpisodeStatistics counts as if every world were reset in the next step",
)
def test_gymnasium_wrappers_work():
    env = wrappers.DictInfoToList(wrappers.NormalizeReward(wrappers.RecordEpisodeStatistics(short(info_terms=True))))
    env.reset(seed=0)
    plain = short()
    plain.reset(seed=0)
    returns, seen = np.zeros(3), 0
    for action in random_actions(env):
        _, _, terminated, truncated, infos = env.step(action)
        returns += plain.step(action)[1]
        for w in np.flatnonzero(terminated | truncated):
            assert infos[w]["episode"]["r"] == pytest.approx(returns[w])
            assert infos[w]["final_obs"].shape == (5, 98)
            assert infos[w]["final_info"]["time_s"] == pytest.approx(0.5 * infos[w]["episode"]["l"])
            returns[w], seen = 0.0, seen + 1
        assert infos[0]["agent_reward"].shape == (5,)
        assert infos[0]["reward_terms"]["effort"].shape == (5,)
    assert seen >= 6


def test_what_cannot_be_done_is_named():
    env = short(render_mode="rgb_array")
    with pytest.raises(RuntimeError, match="call reset"):
        env.step(np.zeros((3, 5, 2)))
    for early in (env.render, env.state, SoloEnv(render_mode="rgb_array").render):
        with pytest.raises(RuntimeError, match="was called before reset"):
            early()
    env.reset(seed=0)
    assert [picture.shape for picture in env.render()] == [(800, 800, 3)] * 3
    bad = np.zeros((3, 5, 2))
    bad[1, 2] = np.nan
    for wrong, message in (
        (np.zeros((3, 4, 2)), r"shape \(3, 5, 2\)"), (bad, "vehicle 2 of world 1"), ({}, "must hold real numbers, got")
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            env.step(wrong)
    with pytest.raises(ValueError, match=r"render_mode must be one of \['rgb_array'\] or None, got 'human'"):
        short(render_mode="human")
    assert short(autoreset_mode="NEXT_STEP").metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    with pytest.raises(ValueError, match="autoreset_mode must be one of 'NextStep', 'SameStep', 'Disabled', got 'no'"):
        short(autoreset_mode="no")


def test_registries():
    made = gymnasium.make_vec("uuv_marl/Swarm-v2", num_envs=2, scenario="tracking", num_vehicles=3)
    assert made.observation_space.shape == (2, 3, 98)
    assert made.spec.id == "uuv_marl/Swarm-v2"
    solo = gymnasium.make("uuv_marl/Solo-v2", num_vehicles=3)
    assert solo.observation_space.shape == (98,)
    parallel = pettingzoo.make("parallel", "uuv_marl/uuv_swarm_v2", num_vehicles=3, max_cycles=7)
    assert parallel.max_cycles == 7
    assert pettingzoo.make("aec", "uuv_marl/uuv_swarm_v2", num_vehicles=3).max_num_agents == 3


def solo(others="bio_inspired", **kwargs):
    return gymnasium.make("uuv_marl/Solo-v2", others=others, **{"num_vehicles": 6, **kwargs})


def test_solo_passes_gymnasiums_check(scenario_name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(solo("sdc", scenario=scenario_name, num_vehicles=8, render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize("others", ["bio_inspired", "sdc", "random"])
def test_solo_is_one_agent_of_the_parallel_environment(others, scenario_name):
    """The learner's action and the policy's for all others give the run of ``parallel_env``, bit for bit."""
    losses = {"losses.times_s": [2.0, 3.0]} if scenario_name == "lossy" else {}
    scenario = uuv_marl.load_scenario(scenario_name, num_vehicles=6, overrides={**SHORT, **losses})
    env = solo(others, scenario=scenario, num_vehicles=None, info_terms=True)
    whole = uuv_marl.parallel_env(baselines.with_policy_requirements(others, scenario), info_terms=True)
    policy = baselines.make_policy(others, whole)
    rng = np.random.default_rng(0)
    observation, _ = env.reset(seed=8)
    observations, _ = whole.reset(seed=8)
    policy.reset(8)
    steps = 0
    while "uuv_0" in whole.agents:
        assert observation.tobytes() == observations["uuv_0"].tobytes()
        own = rng.uniform(-1, 1, 2).astype(np.float32)
        observation, *outcome = env.step(own)
        observations, *theirs = whole.step({**policy(observations), "uuv_0": own})
        running = {"is_success": False, "ending": "running", "arrived": False}
        running |= {key: outcome[-1][key] for key in ("time_s", "collisions")}
        expected = [values["uuv_0"] for values in theirs]
        assert outcome == [*expected[:-1], expected[-1] if any(outcome[1:3]) else {**running, **expected[-1]}]
        steps += 1
    assert steps > 15
    assert outcome[1] != outcome[2]  # terminated where the learner was lost, else truncated
    with pytest.raises(RuntimeError, match="call reset"):
        env.unwrapped.step(own)


@pytest.mark.parametrize(("scenario", "others", "how", "message"), [
    (STARTER, "bio_inspired", {"sonar.channels": ["compass"]}, "can't hold compass: .* 'bio_inspired' requires no"),
    (STARTER, "bio_inspired", {"actuators.yaw_damping_nms": 600.0}, "can't be 600: .* 'bio_inspired' requires 0"),
    (STARTER, "mappo", {"timing.decision_period_s": 0.2}, "can't be 0.2: policy 'mappo' requires 0.5; leave"),
    (STARTER, "mappo", {"timing": {"decision_period_s": 0.1}}, "can't be 0.1: policy 'mappo' requires 0.5; leave"),
    (STARTER, "mappo", {"timing": uuv_marl.load_scenario(STARTER).timing}, "can't be 0.1: .* 'mappo' requires 0.5"),
    ("tracking", "mappo", SLOW_LAUV, "another vehicle"),  # and not for a period that was not asked for
])  # fmt: skip
def test_solo_drops_no_override(scenario, others, how, message):
    with pytest.raises((ScenarioError, baselines.PolicyError), match=message):
        SoloEnv(scenario, others, overrides=how)


def test_solo_drops_no_argument_and_takes_the_modem_for_the_link():
    with pytest.raises(ScenarioError, match="can't be 0.1: policy 'mappo' requires 0.5"):  # though it is usual
        SoloEnv(STARTER, "mappo", decision_period=0.1)
    with pytest.raises(TypeError, match="others must be the name of a policy, or module:Class, got None"):
        SoloEnv(STARTER, None)
    with pytest.raises(TypeError, match="SoloEnv takes no for_policy: the scenario suits others='bio_inspired'"):
        SoloEnv(STARTER, for_policy="sdc")
    both = SoloEnv("starter", "sdc", overrides={"sonar.channels": ["link", "modem"]})
    assert both.scenario.sonar.channels == ("compass", "modem", "identity")


def test_solo_takes_actions_that_can_t_be_written_to(monkeypatch):
    env = SoloEnv("starter")
    env.reset(seed=0)
    act = env._others.act
    monkeypatch.setattr(env._others, "act", lambda percept: np.broadcast_to(act(percept), (1, 5, 2)))
    assert np.isfinite(env.step(np.zeros(2, np.float32))[0]).all()


@pytest.mark.parametrize("make", [partial(uuv_marl.vector_env, 2), SoloEnv])
def test_an_argument_that_is_not_there_is_named(make):
    twice = {"decision_period": 0.2, "overrides": {"timing": {"decision_period_s": 0.5}}}
    for how, message in (
        ({"num_vehicle": 3}, "no argument 'num_vehicle'; did you mean 'num_vehicles'"),
        ({"max_episode_steps": 3}, "no argument 'max_episode_steps'; did you mean 'max_cycles'"),
        (twice, "decision_period = 0.2 and the override timing.decision_period_s = 0.5"),
        ({"overrides": ["a"]}, r"overrides must be a dictionary of fields and values, got \['a'\]"),
    ):
        with pytest.raises((TypeError, ScenarioError), match=message):
            make("starter", **how)


class Three:
    """A whole number as other libraries' are, such as a tensor."""

    def __index__(self):
        return 3


@pytest.mark.parametrize("seed", [np.array(3), np.int64(3), np.uint8(3), Three()], ids=lambda seed: type(seed).__name__)
@pytest.mark.parametrize("make", [uuv_marl.parallel_env, SoloEnv, partial(uuv_marl.vector_env, 2)])
def test_a_seed_is_taken_for_the_number_that_it_is(make, seed):
    plain, env = make(scenario="starter"), make(scenario="starter")
    plain.reset(seed=3)
    env.reset(seed=seed)
    assert snapshot_bytes(env) == snapshot_bytes(plain)
    assert env.np_random.integers(2**62) == plain.np_random.integers(2**62)


@pytest.mark.parametrize(
    "seed",
    [np.array(-3), 1.5, "1", True, {}, [1.5, 2.5], np.array(1.5), np.array("3"), object()],
    ids=lambda seed: type(seed).__name__,
)
@pytest.mark.parametrize("make", [uuv_marl.parallel_env, SoloEnv, partial(uuv_marl.vector_env, 2)])
def test_a_refused_seed_changes_nothing(make, seed):
    env = make(scenario="starter")
    env.reset(seed=3)
    before, random = snapshot_bytes(env), str(env.np_random.bit_generator.state)
    for reset in (env.reset, env.swarm.reset, baselines.make_policy("random", env.swarm.scenario).reset):
        with pytest.raises((TypeError, ValueError), match="seed must"):
            reset(seed=seed)
    assert (snapshot_bytes(env), str(env.np_random.bit_generator.state)) == (before, random)


def snapshot_bytes(env):
    return {name: array.tobytes() for name, array in env.swarm.snapshot().items()}


@pytest.mark.parametrize("action", [1e-300, -1e-46])
def test_numbers_below_float32s_range_are_zero_whatever_numpy_is_told(action):
    with np.errstate(all="raise"):
        env, alone, whole = uuv_marl.parallel_env("starter"), SoloEnv("starter"), uuv_marl.vector_env(2, "starter")
        observations, _ = env.reset(seed=0)
        idle = baselines.make_policy("idle", env)
        assert idle({agent: np.full(seen.shape, action) for agent, seen in observations.items()})
        env.step({agent: np.full(2, action) for agent in env.agents})
        for single, shape in ((alone, 2), (whole, (2, 5, 2))):
            single.reset(seed=0)
            single.step(np.full(shape, action))


def test_a_spec_with_a_scenario_goes_through_json():
    scenario = uuv_marl.load_scenario("starter", overrides={"current.speed_mps": 0.5})
    one = gymnasium.make("uuv_marl/Solo-v2", scenario=scenario, max_episode_steps=5)
    again = gymnasium.make(EnvSpec.from_json(one.spec.to_json()))
    assert again.unwrapped.scenario == one.unwrapped.scenario
    assert again.spec.max_episode_steps == 5
    mode, three = AutoresetMode.NEXT_STEP, np.int64(3)
    many = gymnasium.make_vec("uuv_marl/Swarm-v2", 2, scenario=scenario, autoreset_mode=mode, max_cycles=three)
    again = gymnasium.make_vec(EnvSpec.from_json(many.spec.to_json()))
    assert (again.scenario, again.metadata["autoreset_mode"]) == (scenario, mode)
    with pytest.raises(ScenarioError, match="swarm.num_vehicles must be a valid integer, got 'x'"):
        uuv_marl.load_scenario({**scenario.model_dump(), "swarm": {"num_vehicles": "x"}})


@pytest.mark.parametrize(("place", "given", "message"), [
    ("parallel_env:parallel_env", (10,), "scenario must be .*, got 10"),
    ("vector_env:vector_env", ("starter", 4), "num_envs must be .*, got 'starter'"),
    ("vector_env:vector_env", (4, 2), "scenario must be .*, got 2"),
    ("sb3:SwarmVecEnv", ("starter", "2"), "num_worlds must be .*, got '2'"),
    ("torchrl:SwarmEnv", ("starter", 4), "num_worlds must be .*, got 'starter'"),
])  # fmt: skip
def test_arguments_in_another_order_are_refused(place, given, message):
    module, _, name = place.partition(":")
    pytest.importorskip({"sb3": "stable_baselines3", "torchrl": "torchrl"}.get(module, "gymnasium"))
    make = getattr(importlib.import_module(f"uuv_marl.envs.{module}"), name)
    with pytest.raises((ScenarioError, TypeError), match=message):
        make(*given)


@pytest.mark.parametrize(("place", "first"), [
    ("parallel_env:parallel_env", ()), ("vector_env:vector_env", (2,)), ("sb3:SwarmVecEnv", ()),
    ("torchrl:SwarmEnv", (2,)), ("rllib:SwarmMultiAgentEnv", None),
])  # fmt: skip
def test_every_environment_gives_the_scenario_what_a_policy_requires(place, first):
    module, _, name = place.partition(":")
    pytest.importorskip({"sb3": "stable_baselines3", "torchrl": "torchrl", "rllib": "ray"}.get(module, "gymnasium"))
    cls = getattr(importlib.import_module(f"uuv_marl.envs.{module}"), name)

    def make(**how):
        return cls(how) if first is None else cls(*first, **how)

    how = {"scenario": STARTER, "num_vehicles": 3, "for_policy": "sdc", "overrides": SHORT}
    scenario = uuv_marl.load_scenario(STARTER, num_vehicles=3, overrides=SHORT)
    assert make(**how).scenario == uuv_marl.with_policy_requirements("sdc", scenario) != scenario
    with pytest.raises(ScenarioError, match="decision_period_s can't be 0.1: policy 'mappo' requires 0.5; leave it"):
        make(scenario=STARTER, for_policy="mappo", decision_period=0.1)
    with pytest.raises(ScenarioError, match="can't hold link: policy 'bio_inspired' requires no channels; leave it"):
        make(scenario=STARTER, for_policy="bio_inspired", overrides={"sonar.channels": ["link"]})
