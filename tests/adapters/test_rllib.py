"""RLlib: the same environment bit for bit, and its example."""

import os
import warnings

# Before imports, as in the example: Ray stays on 127.0.0.1 and reports nothing to anybody; a process has one core.
os.environ["NUMBA_NUM_THREADS"] = "1"
os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import numpy as np
import pytest

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    ray = pytest.importorskip("ray")
    from ray.rllib.env.multi_agent_episode import MultiAgentEpisode
    from ray.rllib.utils.pre_checks.env import check_multiagent_environments

import uuv_marl
from tests import contract
from tests.processes import ROOT, module_of, page_block, python
from uuv_marl.envs.rllib import ENV_NAME, SwarmMultiAgentEnv, register

SHORT = {"time_limit.factor": 0.01, "time_limit.extra_s": 4.0}
LOSSY = {"scenario": "lossy", "num_vehicles": 5, "overrides": {**SHORT, **contract.LOSES}}
EXAMPLE = ROOT / "examples" / "training" / "rllib.py"
example = module_of(EXAMPLE)  # not in sys.modules, so that Ray takes its functions along

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning:ray"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # Ray leaves sockets and processes to the interpreter's end
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def started():
    example.start_ray(2)
    yield
    ray.shutdown()


class Flagged:
    """Flags of truncation per agent, which the contract compares and RLlib must not get."""

    def __init__(self, env):
        self.env, self.possible_agents, self.reset = env, env.possible_agents, env.reset

    @property
    def agents(self):
        return self.env.agents

    def step(self, actions):
        observations, rewards, terminateds, truncateds, infos = self.env.step(actions)
        late = {agent: truncateds["__all__"] and not terminateds[agent] for agent in observations}
        return observations, rewards, terminateds, late, infos


@pytest.mark.parametrize("case", contract.cases(), ids=lambda case: case.name)
def test_the_run_is_that_of_the_parallel_environment(case):
    actions = case.actions()
    expected = contract.parallel(case)
    run = contract.empty(len(actions), expected.observation.shape[-1])
    for w in range(contract.WORLDS):
        contract.play_dictionaries(Flagged(SwarmMultiAgentEnv(case.kwargs)), run, w, actions[:, w])
    run.equals(expected)


def play(env, seed=0):
    """Outcomes of an episode with random actions."""
    rng = np.random.default_rng(seed)
    observations, _ = env.reset(seed=seed)
    outcomes = []
    while env.agents:
        actions = {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in observations if agent in env.agents}
        outcomes.append((actions, *env.step(actions)))
        observations = outcomes[-1][1]
    return outcomes


def test_a_lost_vehicle_leaves_alone_and_the_time_limit_truncates_the_others():
    outcomes = play(SwarmMultiAgentEnv(LOSSY))
    lost = [[agent for agent, flag in outcome[3].items() if flag] for outcome in outcomes]
    times = [t for t, names in enumerate(lost) for _ in names]
    assert len(times) == 2
    for t, (_, observations, rewards, terminateds, truncateds, infos) in enumerate(outcomes):
        living = 5 - sum(time < t for time in times)
        assert observations.keys() == rewards.keys() == infos.keys() == terminateds.keys() - {"__all__"}
        assert len(observations) == living
        assert set(lost[t]) <= observations.keys()
        assert terminateds["__all__"] is False
        assert truncateds == {"__all__": t == len(outcomes) - 1}


def test_the_loss_of_everybody_terminates_all():
    env = SwarmMultiAgentEnv({"num_vehicles": 2, "overrides": {"collision.ends_vehicle": True}})
    env.reset(seed=0)
    swarm = env._env.swarm
    north, east, radius = swarm.world_map.obstacles[0, 0]
    swarm.state.eta[0] = north - radius - 1.05, east, 0.0  # about to touch
    swarm.state.nu[0] = 2.0, 0.0, 0.0
    _, _, terminateds, truncateds, _ = env.step(dict.fromkeys(env.agents, np.zeros(2)))
    assert terminateds == {"uuv_0": True, "uuv_1": True, "__all__": True}
    assert truncateds == {"__all__": False}
    assert env.agents == []


def test_rllib_bootstraps_at_the_time_limit_and_not_after_a_loss():
    env = SwarmMultiAgentEnv(LOSSY)
    episode = MultiAgentEpisode(agent_to_module_mapping_fn=lambda *_: "shared")
    episode.add_env_reset(observations=env.reset(seed=0)[0])
    for actions, observations, rewards, terminateds, truncateds, infos in play(env):
        episode.add_env_step(observations, actions, rewards, infos, terminateds=terminateds, truncateds=truncateds)
    ends = [(one.is_terminated, one.is_truncated) for one in episode.agent_episodes.values()]
    assert sorted(ends) == [(False, True)] * 3 + [(True, False)] * 2
    assert (episode.is_terminated, episode.is_truncated) == (False, True)


def test_rllib_accepts_the_environment_and_it_renders():
    env = SwarmMultiAgentEnv({"num_vehicles": 3, "render_mode": "rgb_array"})
    check_multiagent_environments(env)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    env.close()
    assert SwarmMultiAgentEnv().possible_agents == uuv_marl.parallel_env().possible_agents


def config(scenario, seed=100_000):
    """The example's, with five vehicles, two runners and small batches."""
    made = example.ppo_config(scenario, 5, 2, seed)
    return made.training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=1)


def weights(algorithm):
    return {name: np.array(value) for name, value in algorithm.get_module("shared").get_state().items()}


def same(one, other):
    return all(np.array_equal(one[name], other[name]) for name in one)


def test_ppo_trains_by_the_registered_name_on_remote_runners_at_sea(started):
    how = {"num_vehicles": 5, "overrides": contract.MEDIUM}
    chosen = config("tracking").environment(register(), env_config=how)
    assert chosen.env == ENV_NAME
    algorithm = chosen.build_algo()
    try:
        before = weights(algorithm)
        for _ in range(2):
            result = algorithm.train()
        assert not same(weights(algorithm), before)
        assert sum(result["env_runners"]["num_agent_steps_sampled"].values()) >= 200
        on_runners = algorithm.env_runner_group.foreach_env_runner(
            lambda it: it.module["shared"].get_state(inference_only=True), local_env_runner=False
        )
        assert len(on_runners) == 2
        assert all(same(state, weights(algorithm)) for state in on_runners)
    finally:
        algorithm.stop()


def test_every_runner_starts_from_its_own_world(started):
    assert ray.nodes()[0]["NodeManagerAddress"] == "127.0.0.1"
    algorithm = config("training_field", 123_000).build_algo()
    try:
        algorithm.train()
        fields = algorithm.env_runner_group.foreach_env_runner(
            lambda it: it.env.envs[0].unwrapped._env.swarm.world_map.obstacles.copy(), local_env_runner=False
        )
    finally:
        algorithm.stop()
    expected = []
    for seed in (123_001, 123_002):
        env = uuv_marl.parallel_env("training_field", num_vehicles=5)
        env.reset(seed=seed)
        expected.append(env.swarm.world_map.obstacles)
    assert sorted(field.tobytes() for field in fields) == sorted(field.tobytes() for field in expected)


def test_the_example_trains_and_goes_on(tmp_path):
    text = EXAMPLE.read_text(encoding="utf-8")
    assert text.count("16_384") == 1
    (tmp_path / "example.py").write_text(text.replace("16_384", "4_096"), encoding="utf-8")
    command = [tmp_path / "example.py", "--steps=100", "--runners=1", f"--output={tmp_path}"]
    for more in ([], ["--resume"]):
        said = python(*command, *more, PYTHONPATH=str(ROOT))
        assert "agent-steps, return of all vehicles" in said
        assert f"The checkpoint is in {tmp_path}." in said


def test_the_example_of_the_page_runs(tmp_path):
    block = page_block("ray.rllib")
    assert block.count("range(50)") == 1
    block = block.replace("range(50)", "range(1)").replace("16_384", "4_096")
    python("-c", block, folder=tmp_path, PYTHONPATH=str(ROOT))
