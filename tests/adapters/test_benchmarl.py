"""BenchMARL and the TorchRL that it pins, in their own environment: make test-adapters."""

import re
import warnings

import pytest
import torch

from tests import contract
from tests.processes import page_block
from uuv_marl.scenario import ScenarioError, load_scenario, scenario_names

# Others' own: BenchMARL, TorchRL and torch deprecate parts of each other.
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from benchmarl.algorithms import IppoConfig, MappoConfig
    from benchmarl.environments import Task
    from benchmarl.experiment import Experiment, ExperimentConfig
    from benchmarl.models.mlp import MlpConfig

    from uuv_marl.envs.benchmarl import SwarmTask
pytestmark = pytest.mark.filterwarnings("ignore")
SMALL = {"num_vehicles": 4, "decision_period": 0.5, "overrides": {"time_limit.factor": 0.01, "time_limit.extra_s": 5.0}}


def experiment(folder, task, algorithm=MappoConfig, seed=100_000):
    config = ExperimentConfig.get_from_yaml()
    config.save_folder = str(folder)
    config.loggers = []
    config.create_json = False
    config.render = False
    config.checkpoint_at_end = False
    config.max_n_iters = 2
    config.on_policy_n_envs_per_worker = 4
    config.on_policy_collected_frames_per_batch = 160
    config.on_policy_minibatch_size = 80
    config.on_policy_n_minibatch_iters = 2
    config.evaluation_interval = 160
    config.evaluation_episodes = 2
    config.parallel_collection = False
    model = MlpConfig(num_cells=[32, 32], layer_class=torch.nn.Linear, activation_class=torch.nn.Tanh)
    return Experiment(
        task=task, algorithm_config=algorithm.get_from_yaml(), model_config=model, critic_model_config=model, seed=seed,
        config=config,
    )  # fmt: skip


def weights(running):
    return torch.nn.utils.parameters_to_vector(running.policy.parameters()).detach().clone()


AT_SEA = {**SMALL, "overrides": {**SMALL["overrides"], **contract.SEA}}
OWN = {**SMALL, "task": contract.OWN_TASK}


@pytest.mark.parametrize(
    ("algorithm", "how"), [(MappoConfig, SMALL), (IppoConfig, SMALL), (MappoConfig, AT_SEA), (MappoConfig, OWN)]
)
def test_it_trains(tmp_path, algorithm, how):
    running = experiment(tmp_path, SwarmTask.RANDOM_FIELD.get_task(how), algorithm)
    before = weights(running)
    running.run()
    assert running.total_frames == 320
    assert torch.isfinite(weights(running)).all()
    assert not torch.equal(before, weights(running))


def test_the_centralised_critic_reads_the_state(tmp_path):
    running = experiment(tmp_path, SwarmTask.SINGLE_OBSTACLE.get_task(SMALL))
    assert running.state_spec["state"].shape == (48,)
    assert running.observation_spec["uuv", "observation"].shape == (4, 98)
    assert running.max_steps == 14
    running.close()


def test_every_scenario_is_a_task_or_refused(tmp_path):
    names = {task.name.lower() for task in SwarmTask}
    assert names == {name for name in scenario_names() if not load_scenario(name).loses_vehicles}
    assert issubclass(SwarmTask, Task)
    for task in SwarmTask:
        made = task.get_from_yaml()
        env = made.get_env_fun(2, continuous_actions=True, seed=0, device="cpu")()
        assert env.scenario.name == task.name.lower()
        entries = 98 + {"few_informed": 1, "silent_targets": 2}.get(env.scenario.task.name, 0)  # what tasks tell
        assert env.reset()["uuv", "observation"].shape == (2, env.scenario.swarm.num_vehicles, entries)
    lossy = SwarmTask.TRACKING.get_task({**SMALL, "scenario": "lossy", "num_vehicles": 8})
    with pytest.raises(ScenarioError, match="BenchMARL can't represent the loss of a vehicle"):
        experiment(tmp_path, lossy)


def test_arguments_come_from_yaml(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("num_vehicles: 3\nscenario: tracking\n")
    made = SwarmTask.TRACKING.get_from_yaml(str(file))
    assert made.config == {"num_vehicles": 3, "scenario": "tracking"}


@pytest.mark.parametrize("case", contract.cases(), ids=lambda case: case.name)
def test_the_contract_holds_with_this_torchrl(case):
    contract.torchrl(case).equals(contract.parallel(case))


def test_the_pages_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    block, count = re.subn(r"max_n_iters, config.lr = \d+", "max_n_iters, config.lr = 1", page_block("benchmarl"))
    assert count == 1
    exec(block, {"__name__": "example"})
