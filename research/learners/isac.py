"""BenchMARL's ISAC as a learner, the only one without PPO. Runs in the environment of ``make test-benchmarl``."""

# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownParameterType=false, reportUntypedBaseClass=false
# BenchMARL lives in an environment of its own.

import warnings
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

import safetensors.numpy
import torch

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # BenchMARL, TorchRL and torch deprecate parts of each other
    from benchmarl.algorithms import IsacConfig
    from benchmarl.experiment import Callback, Experiment, ExperimentConfig
    from benchmarl.models.mlp import MlpConfig

    from uuv_marl.envs.benchmarl import SwarmTask

from research.episodes import Row
from research.learners.protocol import Task
from research.learners.squashed import squashed
from research.learners.watch import TrainingRequest, Watch
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.train.rows import TRAINING_SEEDS

REPLAYED = 500_000
"""Size of the replay buffer, in agent-steps."""


class _SpentError(Exception):
    """The budget is spent."""


class _Measured(Callback):
    """Measures the policy when due, and ends the training when the budget is spent."""

    def __init__(self, watch: Watch, folder: Path, task: Task) -> None:
        super().__init__()
        self._watch, self._folder, self._task = watch, folder, task

    def __getstate__(self) -> dict[str, object]:
        return {}  # BenchMARL pickles callbacks into the experiment's folder

    def on_train_end(self, training_td: object, group: str) -> None:  # noqa: ARG002
        """After the updates of an iteration."""
        steps = self.experiment.total_frames * self._task.num_vehicles
        if self._watch.due(steps):
            candidate = self._folder / "candidate.safetensors"
            candidate.write_bytes(safetensors.numpy.save(tensors_of(self.experiment.group_policies[group])))
            if self._watch.measure(squashed(candidate, self._task.channels), steps):
                candidate.replace(self._folder / WEIGHTS_FILE)
        if self._watch.share(steps) >= 1.0:
            raise _SpentError


def tensors_of(actor: Any) -> dict[str, Any]:
    """The layers of BenchMARL's actor by name, as ``squashed.Squashed`` reads them: weights (in, out), and biases."""
    layers = [x.detach().numpy() for x in actor.parameters()]
    return {f"{k // 2}.{'bias' if k % 2 else 'weight'}": x.T.copy() for k, x in enumerate(layers)}


def learn(asked: TrainingRequest) -> list[Row]:
    """A ``watch.Trainer``."""
    torch.set_num_threads(1)
    settings, task, folder, watch = asked.settings, asked.task, asked.folder, Watch(asked)
    config = ExperimentConfig.get_from_yaml()
    config.save_folder, config.loggers, config.create_json, config.render = str(folder), [], False, False
    config.evaluation = False
    config.lr, config.gamma, config.max_n_frames = settings["lr"], settings["gamma"], 10**9

    def frames(agent_steps: int) -> int:
        """Decisions of all vehicles at once."""
        return max(1, round(agent_steps / task.num_vehicles))

    config.off_policy_n_envs_per_worker = frames(settings["rows"])
    config.off_policy_collected_frames_per_batch = frames(settings["rows"]) * settings["decisions"]
    config.off_policy_n_optimizer_steps = settings["optimizer_steps"]
    config.off_policy_train_batch_size = frames(settings["batch"])
    config.off_policy_memory_size = frames(REPLAYED)
    config.off_policy_init_random_frames = frames(settings["random_steps"])
    algorithm = IsacConfig.get_from_yaml()
    algorithm.alpha_init = settings["alpha_init"]
    model = MlpConfig(num_cells=[64, 64], layer_class=torch.nn.Linear, activation_class=torch.nn.Tanh)
    options = {"observe": "closeness", "num_vehicles": task.num_vehicles, "overrides": task.overrides}
    with (folder / "benchmarl.log").open("w") as log, redirect_stderr(log), redirect_stdout(log), suppress(_SpentError):
        Experiment(
            task=getattr(SwarmTask, task.name.upper()).get_task(options), algorithm_config=algorithm,
            model_config=model, critic_model_config=model, seed=TRAINING_SEEDS[0] + 1000 * asked.seed, config=config,
            callbacks=[_Measured(watch, folder, task)],
        ).run()  # fmt: skip
    return watch.curve
