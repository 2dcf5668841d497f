"""Training of uuv_marl through SuperSuit and Stable-Baselines3, for perf/compare.py."""

import supersuit
from footing import one_thread, sb3_ppo, scenario
from worker import Case, serve

import uuv_marl


def supersuit_ppo(agents: int, worlds: int) -> Case:
    """PPO over ``parallel_env``, a row per agent, worlds one after the other in this process."""
    world = supersuit.pettingzoo_env_to_vec_env_v1(uuv_marl.parallel_env(scenario(agents)))
    env = supersuit.concat_vec_envs_v1(world, worlds, num_cpus=1, base_class="stable_baselines3")
    return sb3_ppo(env, None)  # SuperSuit's rows can't be seeded


if __name__ == "__main__":
    one_thread()
    serve(
        {"supersuit": supersuit_ppo},
        ("uuv_marl", "numpy", "numba", "gymnasium", "pettingzoo", "supersuit", "stable_baselines3", "torch"),
    )
