"""A policy acts the same through every interface, over several episodes, although nobody resets it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import uuv_marl
from tests.players import CYCLES, PLAYERS, compare, suited
from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, make_policy
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.scenario import ScenarioError

LOSES = {"losses.times_s": [1.0, 2.0], "timing.decision_period_s": 0.5}
KINDS = {
    "bio_inspired": ("starter", {}),  # no memory
    "tangent_bug": ("hard_water", {}),  # a map
    "mappo_few_informed": ("few_informed", {}),  # a recurrent network
    "random": ("lossy", LOSES),  # a random generator
    "random,safety_filter=true": ("starter", {}),
    "leader_follower": ("few_informed", {}),  # observations that others lack
    "leader_broadcast": ("few_informed", {}),  # messages
    "oracle": ("hard_water", {}),
}


@pytest.mark.parametrize("player", PLAYERS, ids=lambda player: player.__name__)
@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**40), pattern=st.integers(0, 2**32))
def test_the_same_actions_through_every_interface(name, player, seed, pattern):
    scenario, overrides = KINDS[name]
    scenario = suited(name, scenario, **overrides, **{"swarm.num_vehicles": 5})
    compare(player, name, scenario, seed, 2 * CYCLES + 3, np.random.default_rng(pattern))


def test_a_second_call_changes_nothing_and_a_left_out_decision_is_refused():
    env = uuv_marl.parallel_env(suited("scout", "starter"))
    policy = make_policy("scout", env)
    observations, _ = env.reset(seed=0)
    first = policy(observations)
    assert all(np.array_equal(first[agent], again) for agent, again in policy(observations).items())
    observations, *_ = env.step(first)
    observations, *_ = env.step(first)
    with pytest.raises(PolicyError, match=r"scout was called at 0 s and then at .* needs a call every"):
        policy(observations)
    env.reset(seed=0)
    policy(env.reset(seed=1)[0])


def test_a_wrapper_that_changes_one_observation_is_obeyed_one_agent_at_a_time():
    """What uuv_1 hears goes, after uuv_0 has acted: as if all had been given at once."""
    scenario = suited("scout", "starter")
    whole, single = (uuv_marl.parallel_env(scenario) for _ in range(2))
    together, alone = make_policy("scout", whole), make_policy("scout", single)
    observations, _ = whole.reset(seed=3)
    single.reset(seed=3)
    for _ in range(40):
        observations["uuv_1"] = np.where(np.arange(98) < 7, observations["uuv_1"], np.float32(0.0))
        actions = together(observations)
        for agent in whole.agents:
            assert alone({agent: observations[agent]})[agent].tobytes() == actions[agent].tobytes()
        observations, *_ = whole.step(actions)
        single.step(actions)


def test_random_actions_follow_the_seed_of_the_episode_unless_they_have_one():
    env = uuv_marl.parallel_env("starter")
    policy = make_policy("random", env)

    def first(seed):
        return policy(env.reset(seed=seed)[0])["uuv_0"].tolist()

    drawn = [first(seed) for seed in (1, 2, 1)]
    assert drawn[0] == drawn[2] != drawn[1]
    policy.reset(2)
    assert first(1) == drawn[1]
    env.step(policy(env.reset(seed=4)[0]))
    assert first(1) == drawn[0], "for one episode only"


def test_what_does_not_fit_is_named():
    env = uuv_marl.vector_env(2, "starter")
    observations, _ = env.reset(seed=0)
    policy = make_policy("bio_inspired", env)
    with pytest.raises(PolicyError, match=r"shape that the environment gives them, for instance \(2, 5, 98\)"):
        policy(observations[0])
    with pytest.raises(PolicyError, match="no agent 'uuv_0'; it takes an array"):
        policy({"uuv_0": observations[0, 0]})
    env = uuv_marl.parallel_env("starter")
    with pytest.raises(PolicyError, match="no agent 'x'; agents are uuv_0 to uuv_4"):
        make_policy("bio_inspired", env)({"x": env.reset()[0]["uuv_0"]})
    with pytest.raises(PolicyError, match="make the environment with observe='positions'"):
        make_policy("bio_inspired", uuv_marl.vector_env(2, observe="closeness"))


def test_evaluate_gives_a_dictionary_of_metrics_for_each_seed_in_their_order():
    short = {"time_limit.factor": 0.01, "time_limit.extra_s": 3.0}
    results = uuv_marl.evaluate("sdc", "starter", [5, 3], num_vehicles=3, overrides=short)
    assert [result["seed"] for result in results] == [5, 3]
    scenario = load_scenario("starter", num_vehicles=3, overrides=short)
    runs = episodes(uuv_marl.with_policy_requirements("sdc", scenario), "sdc", [3])
    assert [results[1]] == [{"seed": 3, **run.metrics} for run in runs]
    with pytest.raises(ScenarioError, match="yaw_damping_nms can't be 7: policy 'sdc' requires 600; leave it out"):
        uuv_marl.evaluate("sdc", "tracking", [0], overrides={"actuators.yaw_damping_nms": 7.0})
    with pytest.raises(ScenarioError, match="^scenario 'none' is unknown"):
        uuv_marl.evaluate("research.blind:Blind,inner=mappo", "none")
    with pytest.raises(ValueError, match="^seed must be a whole number from 0, got -1"):
        uuv_marl.evaluate("research.blind:Blind,inner=mappo", "starter", [-1])
