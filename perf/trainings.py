"""Whole trainings for perf/compare.py: the same task, networks and batch, each in its library's own environment."""

import logging
import runpy
from pathlib import Path
from typing import Any

import torch
from worker import Case, Maker, repeated, serve

from uuv_marl import load_scenario, parallel_env
from uuv_marl.scenario import Scenario

SCENARIO, DECISIONS, SEED = "random_field", 48, 100_000
OVERRIDES = {"timing.decision_period_s": 0.5, "actuators.yaw_damping_nms": 600.0}
HIDDEN, EPOCHS, LEARNING_RATE, GAMMA, GAE_LAMBDA, CLIP = (64, 64), 4, 1.5e-3, 0.98, 0.95, 0.2
MINIBATCH = 2304
"""A factor of the rows, so that no gradient step has fewer."""
OURS: dict[str, Any] = {
    "gamma": GAMMA, "gae_lambda": GAE_LAMBDA, "horizon": DECISIONS, "clip": CLIP, "kl_stop": 1e9,
    "learning_rate": (LEARNING_RATE, LEARNING_RATE),
}  # fmt: skip


def scenario(agents: int) -> Scenario:
    """The common task of all trainings."""
    return load_scenario(SCENARIO, num_vehicles=agents, overrides=OVERRIDES)


def mappo(agents: int, worlds: int) -> Case:
    from uuv_marl.train.folder import Record
    from uuv_marl.train.run import Trainer
    from uuv_marl.train.training import Training

    rows = agents * worlds
    config = {**OURS, "minibatches": max(1, round(rows * DECISIONS / MINIBATCH)), "epochs": EPOCHS}
    fields = {"sizes": [(agents, worlds)], "ppo": config, "network": {"hidden": HIDDEN}, "seed": SEED, "steps": 10**9}
    training = Trainer(Training(scenario=SCENARIO, **fields))
    return repeated(lambda _: training.iterate(Record()), rows * DECISIONS)


def sb3_ppo(env: Any, seed: int | None) -> Case:
    """Stable-Baselines3's PPO on a ``VecEnv``; a unit is a rollout of all rows, and the learning from it."""
    from stable_baselines3 import PPO

    model = PPO(
        "MlpPolicy", env, seed=seed, device="cpu", learning_rate=LEARNING_RATE, n_steps=DECISIONS, batch_size=MINIBATCH,
        n_epochs=EPOCHS, gamma=GAMMA, gae_lambda=GAE_LAMBDA, clip_range=CLIP, policy_kwargs={"net_arch": list(HIDDEN)},
    )  # fmt: skip
    amount = model.n_steps * env.num_envs
    return Case(lambda units: model.learn(units * amount, reset_num_timesteps=False), amount)


def plain(agents: int, worlds: int) -> Case:
    """Observations and reward without normalisation."""
    from stable_baselines3.common.vec_env import VecMonitor

    from uuv_marl.envs.sb3 import SwarmVecEnv

    return sb3_ppo(VecMonitor(SwarmVecEnv(scenario(agents), worlds)), SEED)


def supersuit(agents: int, worlds: int) -> Case:
    """A row per agent of ``parallel_env``, worlds one after the other in this process."""
    import supersuit as wrappers  # pyright: ignore[reportMissingImports]

    world: Any = wrappers.pettingzoo_env_to_vec_env_v1(parallel_env(scenario(agents)))
    env = wrappers.concat_vec_envs_v1(world, worlds, num_cpus=1, base_class="stable_baselines3")
    return sb3_ppo(env, None)  # SuperSuit's rows can't be seeded


def rllib(agents: int, worlds: int) -> Case:
    """PPO as ``examples/training/rllib.py`` has it, sampling and learning in this process."""
    example = runpy.run_path(str(Path(__file__).resolve().parent.parent / "examples" / "training" / "rllib.py"))
    example["start_ray"](0)
    config = example["ppo_config"](SCENARIO, agents, 0, SEED)
    config.environment(env_config={"scenario": SCENARIO, "num_vehicles": agents, "overrides": OVERRIDES})
    config.env_runners(num_envs_per_env_runner=worlds)
    config.training(
        train_batch_size_per_learner=DECISIONS * agents * worlds, minibatch_size=MINIBATCH, num_epochs=EPOCHS,
        lr=LEARNING_RATE, gamma=GAMMA,
    )  # fmt: skip
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    algorithm = config.build_algo()
    torch.set_num_threads(1)  # Ray has its own mind
    rows = sum(algorithm.train()["env_runners"]["num_agent_steps_sampled"].values())
    return repeated(lambda _: algorithm.train(), int(rows))


CASES: dict[str, Maker] = {case.__name__: case for case in (mappo, plain, supersuit, rllib)}

if __name__ == "__main__":
    torch.set_num_threads(1)  # Numba, OpenMP and BLAS are set by environment variables
    serve(CASES)
