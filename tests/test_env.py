"""The PettingZoo environments: conformance, contract, determinism, errors."""

import warnings
from dataclasses import dataclass

import gymnasium
import numpy as np
import pytest

import uuv_marl
from tests.contract import ARRIVES, WIDE
from uuv_marl import load_scenario, uuv_swarm_v2
from uuv_marl.baselines import make_policy
from uuv_marl.percept import Percept

with warnings.catch_warnings():
    # PettingZoo 1.27's own tests import its own environments in a way that it deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, render_test
    from pettingzoo.test.state_test import state_test


def test_parallel_api(scenario_name):
    parallel_api_test(uuv_marl.parallel_env(scenario_name), num_cycles=60)


def test_parallel_api_to_the_end_with_losses():
    overrides = {"losses.times_s": [1.0, 2.0], "time_limit.factor": 0.01, "time_limit.extra_s": 4.0}
    parallel_api_test(uuv_marl.parallel_env("lossy", num_vehicles=8, overrides=overrides), num_cycles=100)


def test_aec_api(scenario_name):
    api_test(uuv_marl.env(scenario=scenario_name, num_vehicles=8), num_cycles=30)


def test_parallel_seed(scenario_name):
    parallel_seed_test(lambda: uuv_marl.parallel_env(scenario_name))


def test_max_cycles():
    max_cycles_test(uuv_swarm_v2)


def test_state(scenario_name):
    state_test(uuv_marl.env(scenario=scenario_name), uuv_marl.parallel_env(scenario_name))


def test_render():
    render_test(lambda **kwargs: uuv_marl.env(scenario="lossy", num_vehicles=8, **kwargs))


def test_observations_are_within_finite_bounds_and_lose_nothing():
    told = {"sonar.channels": ["compass", "link"]}
    env = uuv_marl.parallel_env("random_field", num_vehicles=20, overrides=told)
    space = env.observation_space("uuv_0")
    assert space.shape == (98 + 2 + 63,)
    assert space.dtype == np.float32
    assert np.isfinite(space.low).all()
    assert np.isfinite(space.high).all()
    observations, _ = env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(200):
        assert all(space.contains(o) for o in observations.values())
        rows = np.stack(list(observations.values()))[None]
        back = Percept.from_observation(rows, env.swarm.layout)
        assert back.flat.tobytes() == env.swarm.percept.flat.tobytes()
        observations, *_ = env.step({a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents})


@dataclass
class Spacing:
    """A user's reward with a setting; a dataclass has no hash."""

    weight: float

    def __call__(self, swarm):
        return -self.weight * swarm.facts.spacing


def test_bad_input_names_the_agent_and_the_remedy():
    env = uuv_marl.parallel_env(num_vehicles=3)
    for call in (env.state, uuv_marl.parallel_env(render_mode="rgb_array").render):
        with pytest.raises(RuntimeError, match="was called before reset"):
            call()
    env.reset(seed=0)
    good = dict.fromkeys(env.agents, np.zeros(2, np.float32))
    few, many = {"uuv_0": good["uuv_0"]}, {**good, "x": 0}
    for actions, message in ((few, "of uuv_1 is missing"), (many, "agent 'x' is unknown")):
        with pytest.raises(ValueError, match=message):
            env.step(actions)
    for told, message in (
        ({"render_mode": "ascii"}, "render_mode must be one of"),
        ({"max_cycles": 0}, "max_cycles must be a whole number from 1"),
        ({"reward": "individual"}, "reward must be 'dense', 'sparse', 'team'"),
    ):
        with pytest.raises(ValueError, match=message):
            uuv_marl.parallel_env(**told)
    lone = uuv_marl.parallel_env(num_vehicles=1, reward=Spacing(1.0))
    lone.reset(seed=0)
    with pytest.raises(ValueError, match="must hold finite numbers"):
        lone.step({"uuv_0": np.zeros(2)})
    huge = uuv_marl.parallel_env(num_vehicles=1, reward=lambda swarm: np.full(swarm.facts.spacing.shape, 1e300))
    huge.reset(seed=0)
    with pytest.raises(ValueError, match=r"must hold finite numbers of at most 1e\+09"):
        huge.step({"uuv_0": np.zeros(2)})


def test_stepping_nobody_after_the_end_gives_nothing():
    """As PettingZoo's own environments do, and SuperSuit's black_death needs; but never before the first reset."""
    env = uuv_marl.parallel_env(num_vehicles=2, max_cycles=1)
    with pytest.raises(RuntimeError, match="step was called before reset; call reset"):
        env.step({})
    env.reset(seed=0)
    with pytest.raises(ValueError, match="the action of uuv_0 is missing"):
        env.step({})
    env.step(dict.fromkeys(env.agents, (0.0, 0.0)))
    eta = env.swarm.state.eta.copy()
    for _ in range(2):
        assert env.step({}) == ({}, {}, {}, {}, {})
    np.testing.assert_array_equal(env.swarm.state.eta, eta)
    assert len(env.reset()[0]) == 2


class Tensor:
    """As torch's with a gradient: NumPy can't read it."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")


@pytest.mark.parametrize(("action", "message"), [
    ({}, "must hold real numbers, got {}"),
    ({0.1, 0.2}, "must hold real numbers, got {0.1, 0.2}"),
    ("ab", "must hold real numbers, got 'ab'"),
    ([[0.1], [0.2, 0.3]], r"must hold real numbers, got \[\[0.1\], \[0.2, 0.3\]\] \(setting an array element"),
    ([10**400, 0], "must hold real numbers, got"),
    ([0.1, None], "must hold real numbers"),
    (Tensor(), r"must hold real numbers, got .* \(Can't call numpy\(\) on Tensor .* Use tensor.detach"),
    ([0.1 + 1j, 0.2], "must hold real numbers"),
    (np.ma.masked_array([0.1, 0.2], [True, False]), "must hold real numbers, got a masked array"),
    ([1e300, 0.0], r"must be finite, got \[inf, 0.0\]"),
    ([[0.1, 0.2]], r"must have shape \(2,\), got \(1, 2\)"),
    (0.1, r"must have shape \(2,\), got \(\)"),
], ids=range(12))  # fmt: skip
def test_what_is_no_action_is_refused_by_name(action, message):
    env = uuv_marl.parallel_env(num_vehicles=3)
    env.reset(seed=0)
    good = dict.fromkeys(env.agents, np.zeros(2, np.float32))
    with pytest.raises(ValueError, match=f"the action of uuv_1 {message}"):
        env.step({**good, "uuv_1": action})
    assert env.swarm.facts.time_s[0] == 0.0
    alone = gymnasium.make("uuv_marl/Solo-v2", num_vehicles=3).unwrapped
    alone.reset(seed=0)
    with pytest.raises(ValueError, match=f"the action {message}"):
        alone.step(action)
    with pytest.raises(TypeError, match="actions must be a dictionary"):
        env.step(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="agent 5 is unknown"):
        env.step({**good, 5: np.zeros(2)})


def test_np_random_is_seeded_and_touches_nothing():
    env, twin = uuv_marl.parallel_env(num_vehicles=3), uuv_marl.parallel_env(num_vehicles=3)
    env.np_random.random()
    env.reset(seed=5)
    first = env.np_random.random(4)
    assert not np.isin(first, np.random.default_rng(5).random(200)).any(), "not the stream of the start"
    twin.reset(seed=5)
    np.testing.assert_array_equal(env.reset()[0]["uuv_0"], twin.reset()[0]["uuv_0"])
    assert not np.array_equal(env.np_random.random(4), first), "goes on where no seed is given"
    env.reset(seed=5)
    np.testing.assert_array_equal(env.np_random.random(4), first)


ENDINGS = {
    "arrival": {**ARRIVES, "losses.times_s": [1.0]},
    "time_limit": {**WIDE, "time_limit.factor": 0.05, "time_limit.extra_s": 30.0},
    "lost": {**WIDE, "collision.ends_vehicle": True, "time_limit.extra_s": 60.0},
}


@pytest.mark.parametrize("reason", ENDINGS)
def test_the_last_info_tells_how_it_ended(reason):
    scenario = load_scenario("lossy", num_vehicles=4, overrides={**ENDINGS[reason], "timing.decision_period_s": 0.5})
    env, whole = uuv_marl.parallel_env(scenario), uuv_marl.vector_env(1, scenario)
    solo = gymnasium.make("uuv_marl/Solo-v2", scenario=scenario, others="bio_inspired").unwrapped
    policy = make_policy("bio_inspired", env)
    observations, _ = env.reset(seed=4)
    whole.reset(seed=4)
    alone = solo.reset(seed=4)[1]
    policy.reset(4)
    last, collisions = {}, 0
    assert alone == {"is_success": False, "ending": "running", "arrived": False, "time_s": 0.0, "collisions": 0}
    while env.agents:
        acted, actions = list(env.agents), policy(observations)
        observations, *_, infos = env.step(actions)
        observations = {agent: observations[agent] for agent in env.agents}
        everyone = np.array([[actions.get(agent, np.zeros(2)) for agent in env.possible_agents]])
        final = whole.step(everyone)[-1]
        if alone["ending"] == "running":
            alone = solo.step(actions["uuv_0"])[-1]
            assert alone == infos["uuv_0"] or (alone["ending"], infos["uuv_0"]) == ("running", {})
        collisions += int(env.swarm.facts.collisions[0])
        for agent in acted:
            assert bool(infos[agent]) == (agent not in env.agents), "only the last info tells"
        last |= {agent: info for agent, info in infos.items() if info}
    assert set(last) == set(env.possible_agents)
    assert {info["ending"] for info in last.values()} == {"lost", reason}
    world = max(last.values(), key=lambda info: (info["time_s"], info["ending"] == reason))
    time_s = pytest.approx(env.swarm.facts.time_s[0])
    arrived = dict.fromkeys(("is_success", "arrived"), reason == "arrival")
    assert world == {**arrived, "ending": reason, "time_s": time_s, "collisions": collisions}
    assert all(info["is_success"] == (info["ending"] == "arrival") for info in last.values())
    assert {key: final["final_info"][key][0] for key in world} == world
    assert alone["ending"] == last["uuv_0"]["ending"]
    if reason == "time_limit":
        assert collisions > 0, "else the test shows nothing"


def test_any_vehicle_can_be_the_learner():
    scenario = load_scenario("starter", overrides={"losses.times_s": [4.0]})
    env, solo = uuv_marl.parallel_env(scenario), gymnasium.make("uuv_marl/Solo-v2", scenario=scenario).unwrapped
    policy, own = make_policy("bio_inspired", env), make_policy("bio_inspired", solo)
    for vehicle in (3, np.int64(4), None):
        agent, options = f"uuv_{vehicle or 0}", None if vehicle is None else {"vehicle": vehicle}
        observations, observation = env.reset(seed=2)[0], solo.reset(seed=2, options=options)[0]
        running = True
        while running:
            np.testing.assert_array_equal(observation, observations[agent])
            actions, action = policy(observations), own(observation)
            np.testing.assert_array_equal(action, actions[agent])
            observations, *expected, _ = env.step(actions)
            observation, *rest, info = solo.step(action)
            assert rest == [each[agent] for each in expected]
            observations = {name: observations[name] for name in {*env.agents, agent}}
            running = agent in env.agents
        assert info["ending"] in ("lost", "arrival")
    for wrong, error in ((5, ValueError), (-1, ValueError), ("uuv_1", TypeError)):
        with pytest.raises(error, match=rf"options\['vehicle'\] must be .* got {wrong!r}"):
            solo.reset(options={"vehicle": wrong})
