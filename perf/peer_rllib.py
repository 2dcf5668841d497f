"""Training of uuv_marl with RLlib, for perf/compare.py."""

import logging

import footing as by
from worker import Case, repeated, serve

import uuv_marl
from uuv_marl.benchmark.distributed import connected
from uuv_marl.train.rllib import Settings, ppo_config


def rllib(agents: int, worlds: int) -> Case:
    """PPO as ``uuv-marl train rllib`` has it, sampling and learning in this process."""
    settings = Settings(
        scenario=by.SCENARIO, num_vehicles=agents, overrides=by.OVERRIDES, batch=by.DECISIONS * agents * worlds,
        minibatch=by.MINIBATCH, epochs=by.EPOCHS, learning_rate=by.LEARNING_RATE, gamma=by.GAMMA,
        gae_lambda=by.GAE_LAMBDA, hidden=by.HIDDEN,
    )  # fmt: skip
    config = ppo_config(settings, num_env_runners=0, world_seed=by.SEED)
    config.env_runners(num_envs_per_env_runner=worlds)
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    algorithm = config.build_algo()
    by.one_thread()  # Ray has its own mind
    sampled = algorithm.train()["env_runners"]["num_agent_steps_sampled"]
    rows, world = int(sum(sampled.values())), uuv_marl.parallel_env(settings.load())
    inputs = str(world.observation_space("uuv_0").shape[0])
    return repeated(lambda _: algorithm.train(), rows, rows=rows, inputs=inputs)


if __name__ == "__main__":
    by.one_thread()
    with connected(None):
        serve({"rllib": rllib}, ("uuv_marl", "numpy", "numba", "gymnasium", "ray", "torch"))
