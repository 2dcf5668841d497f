"""Stable-Baselines3's PPO as a learner: vehicles are rows of one environment, and share the policy."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownParameterType=false
# Stable-Baselines3 leaves the types of observations and spaces open.

from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from research.episodes import Row
from research.learners.watch import TrainingRequest, Watch
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.train.rows import TRAINING_SEEDS
from uuv_marl.train.sb3 import save_sb3
from uuv_marl.train.training import ROWS

STEPS = 64
"""Decisions of each world between two updates, as in our own trainer."""


class _Measured(BaseCallback):
    """Measures the policy when due, and ends the training when the budget is spent."""

    def __init__(self, watch: Watch, folder: Path) -> None:
        super().__init__()
        self._watch, self._folder = watch, folder

    def _on_step(self) -> bool:
        return not self._watch.late

    def _on_rollout_start(self) -> None:
        self.measure()

    def measure(self) -> None:
        """Measure the policy if it is due."""
        if self._watch.due(self.num_timesteps):
            candidate = self._folder / "candidate.safetensors"
            save_sb3(self.model, candidate)  # type: ignore[arg-type]
            if self._watch.measure(str(candidate), self.num_timesteps):
                candidate.replace(self._folder / WEIGHTS_FILE)


def learn(asked: TrainingRequest) -> list[Row]:
    """A ``watch.Trainer``."""
    torch.set_num_threads(1)
    settings, task, watch = dict(asked.settings), asked.task, Watch(asked)
    worlds = max(1, round(ROWS / task.num_vehicles))
    env = VecNormalize(SwarmVecEnv(task.scenario, worlds, observe="closeness"), norm_obs=False)
    rate = float(settings.pop("learning_rate"))
    model = PPO(
        "MlpPolicy", env, n_steps=STEPS,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": settings.pop("log_std_init")},
        learning_rate=lambda left: rate * max(left, 0.02), seed=TRAINING_SEEDS[0] + 1000 * asked.seed,
        device="cpu", **settings,
    )  # fmt: skip
    measured = _Measured(watch, asked.folder)
    model.learn(asked.agent_steps, callback=measured)
    measured.measure()
    return watch.curve
