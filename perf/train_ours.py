"""Trainings in our own environment, for perf/compare.py: MAPPO, PPO on its problem, and plain PPO."""

import math
from collections.abc import Mapping
from typing import Any

import footing as by
from stable_baselines3.common.vec_env import VecMonitor
from worker import Case, Maker, repeated, serve

from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.train import mappo, ppo
from uuv_marl.train.shaping import Weights

EITHER: Mapping[str, Any] = {
    "hidden": by.HIDDEN, "gamma": by.GAMMA, "gae_lambda": by.GAE_LAMBDA, "horizon": by.DECISIONS, "clip": by.CLIP,
    "minibatch": by.MINIBATCH, "kl_stop": math.inf, "learning_rate": (by.LEARNING_RATE, by.LEARNING_RATE),
}  # fmt: skip
RECIPES: Mapping[str, Any] = {
    "mappo": mappo.Hyperparameters(**EITHER, actor_epochs=by.EPOCHS, critic_epochs=by.EPOCHS),
    "ppo": ppo.Hyperparameters(**EITHER, epochs=by.EPOCHS),
}


def recipe(name: str) -> Maker:
    """A training of ours; a unit is an iteration."""

    def made(agents: int, worlds: int) -> Case:
        training = RECIPES[name].begin(by.scenario(agents), [(agents, worlds)], Weights(), by.SEED)
        return repeated(lambda _: training.iterate(0.0), training.agent_steps, rows=training.agent_steps)

    return made


def plain(agents: int, worlds: int) -> Case:
    """Stable-Baselines3 on observations and reward as they come."""
    return by.sb3_ppo(VecMonitor(SwarmVecEnv(worlds, by.scenario(agents))), by.SEED)


CASES: dict[str, Maker] = {**{name: recipe(name) for name in RECIPES}, "plain": plain}

if __name__ == "__main__":
    by.one_thread()
    serve(CASES, ("uuv_marl", "numpy", "numba", "gymnasium", "stable_baselines3", "torch"))
