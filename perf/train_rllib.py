"""The case of perf/training.py for RLlib."""

import logging

from footing import (
    EPOCHS,
    GAE_LAMBDA,
    GAMMA,
    HIDDEN,
    LEARNING_RATE,
    MINIBATCH,
    OVERRIDES,
    ROWS,
    SCENARIO,
    SEED,
    one_thread,
)
from worker import Case, serve

import uuv_marl
from uuv_marl.benchmark.distributed import connected
from uuv_marl.train.rllib import Settings, ppo_config


def rllib(agents: int, worlds: int) -> Case:
    """PPO as ``uuv-marl train rllib`` has it, sampling and learning in this process."""
    settings = Settings(
        scenario=SCENARIO, num_vehicles=agents, overrides=OVERRIDES, batch=ROWS, minibatch=MINIBATCH, epochs=EPOCHS,
        learning_rate=LEARNING_RATE, gamma=GAMMA, gae_lambda=GAE_LAMBDA, hidden=HIDDEN,
    )  # fmt: skip
    config = ppo_config(settings, num_env_runners=0, world_seed=SEED)
    config.env_runners(num_envs_per_env_runner=worlds)
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    algorithm = config.build_algo()
    one_thread()  # Ray has its own mind
    world = uuv_marl.parallel_env(settings.load())
    sampled: list[int] = []

    def run(units: int) -> None:
        for _ in range(units):
            result = algorithm.train()
            sampled.append(int(sum(result["env_runners"]["num_agent_steps_sampled"].values())))

    run(1)
    facts = {"rows": sampled[-1], "inputs": str(world.observation_space(world.possible_agents[0]).shape[0])}
    return Case(run, sampled[-1], facts)


if __name__ == "__main__":
    one_thread()
    with connected(None):
        serve({"rllib": rllib}, ("uuv_marl", "numpy", "numba", "gymnasium", "ray", "torch"))
