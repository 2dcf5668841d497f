"""Stable-Baselines3 on what the actor of a checkpoint sees, and its model as a checkpoint. Needs ``sb3``."""

from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from uuv_marl.baselines.learned.checkpoint import Card, Layer, card_rows, save_checkpoint, vehicle_of
from uuv_marl.baselines.learned.percept_features import BARRIER, MOST_BARRIER, Features
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.errors import PolicyError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.train.training import in_si_units
from uuv_marl.types import Float32

with extra("sb3", "training with Stable-Baselines3"):
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnvWrapper
    from torch import nn


class ActorVecEnv(VecEnvWrapper):
    """A ``SwarmVecEnv`` as a checkpoint's actor has it: a row's features in, a force out, to which a barrier is added.

    Args:
        venv: rows of vehicles.

    Raises:
        ScenarioError: the scenario is in a vehicle's scale.
    """

    def __init__(self, venv: SwarmVecEnv) -> None:
        self.scenario = in_si_units(venv.scenario)
        self._extract, self._layout = Features(self.scenario, BARRIER), PerceptLayout.of(self.scenario)
        seen, forces = (
            Box(-np.inf, np.inf, (self._extract.size,)),
            Box(-MOST_BARRIER, MOST_BARRIER, (2,), np.float32),
        )
        super().__init__(venv, seen, forces)

    def reset(self) -> Float32:
        """Start all worlds, shape (row, feature)."""
        features, self.barrier = self._look(self.venv.reset())  # type: ignore[arg-type]
        return features

    def step_async(self, actions: NDArray[Any]) -> None:
        """Act with forces [full force], shape (row, 2), and the barrier's."""
        self.venv.step_async(actions + self.barrier)

    def step_wait(self) -> tuple[Float32, Float32, NDArray[np.bool_], list[dict[str, Any]]]:
        """Features, rewards, dones and infos of every row."""
        observation, reward, dones, infos = self.venv.step_wait()
        for row in np.flatnonzero(dones):
            last = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = self._look(last[None])[0][0]
        features, self.barrier = self._look(observation)  # type: ignore[arg-type]
        return features, reward, dones, infos

    def _look(self, observation: Float32) -> tuple[Float32, Float32]:
        """Features (row, feature) of observations (row, entry), and the barrier's force (row, 2) [full force]."""
        percept = Percept.from_observation(observation[None], self._layout)
        features = np.empty((1, len(observation), self._extract.size), np.float32)
        barrier = np.empty((1, len(observation), 2), np.float32)
        self._extract.look(percept.flat, features, barrier, np.zeros(1, np.int64))
        return features[0], barrier[0]


def save_sb3(model: PPO, path: UserPath) -> None:
    """Write the actor of a model as a checkpoint, which ``make`` and ``uuv-marl benchmark --policy`` run without torch.

    Args:
        model: PPO with ``MlpPolicy``, trained on an ``ActorVecEnv``.
        path: of the file, ``policy.safetensors`` in a folder of its own.

    Raises:
        PolicyError: the model has another environment or network; the message names the remedy.
    """
    env: Any = model.get_env()
    normalised = model.get_vec_normalize_env()
    while env is not None and not isinstance(env, ActorVecEnv):
        env = getattr(env, "venv", None)
    if env is None or (normalised is not None and normalised.norm_obs):
        raise PolicyError("the model must see what a checkpoint's actor sees; train on ActorVecEnv(SwarmVecEnv(...))")
    policy: Any = model.policy
    hidden = list(policy.mlp_extractor.policy_net)
    if [type(layer) for layer in hidden] != [nn.Linear, nn.Tanh] * (len(hidden) // 2):
        raise PolicyError(f"a checkpoint's network has tanh layers, got {hidden}; leave activation_fn out")
    scenario = env.scenario
    card = Card(
        percept=card_rows(scenario),
        yaw_damping_nms=scenario.actuators.yaw_damping_nms,
        channels=scenario.sonar.channels,
        vehicle=vehicle_of(scenario),
        training={"algorithm": "PPO of Stable-Baselines3", "agent_steps": model.num_timesteps, "seed": model.seed},
    )
    layers = [Layer(x.weight.detach().cpu().numpy().T, x.bias.detach().cpu().numpy())
              for x in (*hidden[::2], policy.action_net)]  # fmt: skip
    save_checkpoint(path, card, layers)
