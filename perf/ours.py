"""Cases of uuv_marl for perf/compare.py: the batched core, its public environments, and the ceilings."""

from functools import partial
from typing import Any

import numpy as np
from compare import ADAPTERS
from floor import KERNELS, loop
from numpy.typing import NDArray
from worker import Case, Maker, built, repeated, serve

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.sim.swarm import Swarm

SETS = 8
PILES: dict[str, Any] = {"scenario": "hard_water", "overrides": {"task.kinds": ["piles"]}}
"""The kind of hard maps with the most discs: 200 to 320 each, 265 on average."""


def random_actions(agents: int, worlds: int) -> NDArray[np.float32]:
    """Sets of random actions, drawn before the clock runs, shape (set, world, vehicle, 2)."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, (SETS, worlds, agents, 2)).astype(np.float32)


def core(agents: int, worlds: int, scenario: str = "single_obstacle", **changes: Any) -> Case:
    """``Swarm.step``: motion, sonar, percepts."""
    swarm = Swarm(load_scenario(scenario, num_vehicles=agents, **changes), worlds)
    actions = random_actions(agents, worlds)
    swarm.reset(0)
    return repeated(lambda k: swarm.step(actions[k % SETS]), agents * worlds, entries=swarm.layout.size)


def vector_env(agents: int, worlds: int) -> Case:
    """``vector_env``: observations, rewards, endings, resets in the same step."""
    envs, actions = uuv_marl.vector_env(worlds, num_vehicles=agents), random_actions(agents, worlds)
    envs.reset(seed=0)
    return repeated(lambda k: envs.step(actions[k % SETS]), agents * worlds, entries=envs.swarm.layout.size)


def hard_vector_env(agents: int, worlds: int) -> Case:
    """``vector_env`` on hard maps, with a decision of 0.5 s, five steps of the water.

    Worlds begin at all ages, so that a step draws as many new maps as in the long run.
    """
    envs, actions = uuv_marl.vector_env(worlds, num_vehicles=agents, **PILES), random_actions(agents, worlds)
    envs.reset(seed=0)
    swarm, ages = envs.swarm, np.random.default_rng(0).uniform(size=worlds)
    swarm.state.tick[:] = ages * swarm.time_limit_s / swarm.scenario.timing.control_step_s
    discs = float(swarm.world_map.num_obstacles.mean())
    return repeated(lambda k: envs.step(actions[k % SETS]), agents * worlds, entries=swarm.layout.size, discs=discs)


def parallel_env(agents: int, worlds: int, info_terms: bool = False) -> Case:
    """``parallel_env``: dicts of agents, worlds one after the other, reset when over. A unit is a step of one world."""
    envs = built(lambda: uuv_marl.parallel_env(num_vehicles=agents, info_terms=info_terms), worlds)
    names = envs[0].possible_agents
    actions = [dict(zip(names, one, strict=True)) for one in random_actions(agents, 1)[:, 0]]

    def step(k: int) -> None:
        env = envs[k % len(envs)]
        if not env.agents:
            env.reset()
        env.step(actions[k % SETS])

    return repeated(step, agents, entries=envs[0].swarm.layout.size, built=len(envs))


def parallel_env_terms(agents: int, worlds: int) -> Case:
    """The same with the reward's terms in every agent's info."""
    return parallel_env(agents, worlds, info_terms=True)


def adapter(name: str, agents: int, worlds: int) -> Case:
    """A step of one API, with idle vehicles on worlds that never end while they are measured."""
    how: Any = {"num_vehicles": agents, "overrides": {"time_limit.extra_s": 1e6}}
    action: Any = np.zeros((worlds, agents, 2), np.float32)
    if name == "torchrl_idle":
        import torch

        from uuv_marl.envs.torchrl import SwarmEnv

        env: Any = SwarmEnv(worlds, seed=0, **how)
        data = env.reset().set(("uuv", "action"), torch.from_numpy(action))
        return repeated(lambda _: env.step(data.copy()), agents * worlds)
    if name in ("swarm_idle", "task_idle"):
        from uuv_marl.envs.core import make_batched_env  # older checkouts, which versions.py runs too, have none

        env = make_batched_env(num_worlds=worlds, **how)
        env.reset(0)
        env = env.swarm if name == "swarm_idle" else env
    else:
        env = (SwarmVecEnv if name == "sb3_idle" else uuv_marl.vector_env)(
            **{"num_worlds" if name == "sb3_idle" else "num_envs": worlds}, **how
        )
        env.reset()
        action = action.reshape(env.action_space.shape if name == "vector_env_idle" else (-1, 2))
    return repeated(lambda _: env.step(action), agents * worlds)


def ceiling(kind: str, agents: int, worlds: int) -> Case:
    """A loop with one part of a step's work."""
    return Case(*loop(kind, agents, worlds))


CASES: dict[str, Maker] = {
    case.__name__: case for case in (core, vector_env, hard_vector_env, parallel_env, parallel_env_terms)
}
CASES["hard_core"] = partial(core, **PILES)
CASES |= {name: partial(adapter, name) for name in ADAPTERS}
CASES |= {kind: partial(ceiling, kind) for kind in KERNELS}

if __name__ == "__main__":
    serve(CASES, warm=True)
