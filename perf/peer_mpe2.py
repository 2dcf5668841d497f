"""Cases of MPE2's simple_spread_v3 for perf/compare.py: PettingZoo's parallel API, and PPO over its agents."""

from typing import Any

import numpy as np
from mpe2 import simple_spread_v3
from numpy.typing import NDArray
from ppo import Rows, training
from worker import Case, built, repeated, serve

ENDLESS, SETS = 10**9, 8


def worlds_of(agents: int, worlds: int) -> list[Any]:
    """As many of the worlds as are built in time; no episode ends."""
    return built(lambda: simple_spread_v3.parallel_env(N=agents, max_cycles=ENDLESS), worlds)


def parallel_env(agents: int, worlds: int) -> Case:
    """Worlds one after the other: MPE2 has no other way in one process. A unit is a step of one world."""
    envs = worlds_of(agents, worlds)
    drawn = np.random.default_rng(0).integers(5, size=(SETS, agents)).tolist()
    actions = [dict(zip(envs[0].possible_agents, one, strict=True)) for one in drawn]
    entries = envs[0].observation_space("agent_0").shape[0]
    return repeated(lambda k: envs[k % len(envs)].step(actions[k % SETS]), agents, entries=entries, built=len(envs))


def ppo(agents: int, worlds: int) -> Case:
    """PPO of Stable-Baselines3, a row per agent."""
    envs = worlds_of(agents, worlds)
    names = envs[0].possible_agents

    def step(actions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        observation, reward = [], []
        for env, some in zip(envs, actions.reshape(worlds, agents).tolist(), strict=True):
            observations, rewards, *_ = env.step(dict(zip(names, some, strict=True)))
            observation += observations.values()
            reward += rewards.values()
        return np.array(observation), np.array(reward, np.float32)

    start = step(np.zeros(worlds * agents, np.int64))[0]
    return training(Rows(start, step, envs[0].observation_space(names[0]), envs[0].action_space(names[0])))


if __name__ == "__main__":
    serve({"mpe2": parallel_env, "mpe2_ppo": ppo})
