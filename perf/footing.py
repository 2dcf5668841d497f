"""What all trainings of perf/compare.py share: the task, the network, the batch, and Stable-Baselines3's PPO on it.

Runs in every library's own environment.
"""

from typing import Any

import torch
from worker import Case, repeated

from uuv_marl import load_scenario
from uuv_marl.scenario import Scenario

SCENARIO, DECISIONS, SEED = "random_field", 48, 100_000
OVERRIDES = {"timing.decision_period_s": 0.5, "actuators.yaw_damping_nms": 600.0}
HIDDEN, EPOCHS, LEARNING_RATE, GAMMA, GAE_LAMBDA, CLIP = (64, 64), 4, 1.5e-3, 0.98, 0.95, 0.2
MINIBATCH = 2304
"""A factor of the rows, so that no gradient step has fewer."""


def scenario(agents: int) -> Scenario:
    """What all train on."""
    return load_scenario(SCENARIO, num_vehicles=agents, overrides=OVERRIDES)


def one_thread() -> None:
    """Numba, OpenMP and BLAS are told by the environment's variables."""
    torch.set_num_threads(1)


def sb3_ppo(env: Any, seed: int | None) -> Case:
    """Stable-Baselines3's PPO on a ``VecEnv``, a unit an iteration of ``DECISIONS`` steps."""
    from stable_baselines3 import PPO  # noqa: PLC0415 - RLlib's environment is without it

    model = PPO(
        "MlpPolicy", env, learning_rate=LEARNING_RATE, n_steps=DECISIONS, batch_size=MINIBATCH, n_epochs=EPOCHS,
        gamma=GAMMA, gae_lambda=GAE_LAMBDA, clip_range=CLIP, policy_kwargs={"net_arch": list(HIDDEN)}, seed=seed,
        device="cpu",
    )  # fmt: skip
    rows = DECISIONS * env.num_envs
    inputs = str(env.observation_space.shape[0])
    return repeated(lambda _: model.learn(rows, reset_num_timesteps=False), rows, rows=rows, inputs=inputs)
