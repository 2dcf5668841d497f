"""Cases of uuv_marl for perf/compare.py: the batched core, its public environments, training, and the ceilings."""

import time
from collections.abc import Callable

import numpy as np
from floor import KERNELS, loop
from numpy.typing import NDArray
from parts import PARTS, part
from ppo import training
from worker import Case, Maker, serve

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.baselines import make
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.sim.swarm import Swarm

Actions = NDArray[np.float32]
SETS, SETTLE_STEPS, SETTLE_S, BUILD_S = 8, 200, 10.0, 20.0


def random_actions(agents: int, worlds: int) -> Actions:
    """Sets of random actions, drawn before the clock runs, shape (set, world, vehicle, 2)."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, (SETS, worlds, agents, 2)).astype(np.float32)


def repeated(step: Callable[[Actions], object], actions: Actions) -> Callable[[int], None]:
    """Steps through the sets of actions, over and over."""

    def run(units: int) -> None:
        for k in range(units):
            step(actions[k % SETS])

    return run


def core(agents: int, worlds: int) -> Case:
    """``Swarm.step``: motion, sonar, percepts."""
    swarm = Swarm(load_scenario("single_obstacle", num_vehicles=agents), worlds)
    swarm.reset(0)
    return Case(repeated(swarm.step, random_actions(agents, worlds)), agents * worlds, {"entries": swarm.layout.size})


def vector_env(agents: int, worlds: int) -> Case:
    """``vector_env``: observations, rewards, endings, resets in the same step."""
    envs = uuv_marl.vector_env(worlds, "single_obstacle", num_vehicles=agents)
    envs.reset(seed=0)
    entries = envs.single_observation_space.shape[-1]
    return Case(repeated(envs.step, random_actions(agents, worlds)), agents * worlds, {"entries": entries})


def parallel_env(agents: int, worlds: int, info_terms: bool = False) -> Case:
    """``parallel_env``: dicts of agents, worlds one after the other, reset when over. A unit is a step of one world."""
    envs, start = [], time.perf_counter()
    while len(envs) < worlds and time.perf_counter() - start < BUILD_S:
        env = uuv_marl.parallel_env("single_obstacle", num_vehicles=agents, info_terms=info_terms)
        env.reset(seed=len(envs))
        envs.append(env)
    actions = [dict(zip(env.possible_agents, one, strict=True)) for one in random_actions(agents, 1)[:, 0]]

    def run(units: int) -> None:
        for k in range(units):
            env = envs[k % len(envs)]
            if not env.agents:
                env.reset()
            env.step(actions[k % SETS])

    return Case(run, agents, {"entries": env.observation_space(env.possible_agents[0]).shape[0], "built": len(envs)})


def parallel_env_terms(agents: int, worlds: int) -> Case:
    """The same with the reward's terms in every agent's info."""
    return parallel_env(agents, worlds, info_terms=True)


def idle(agents: int, worlds: int) -> Case:
    """``Swarm.step`` of idle vehicles on ``tracking``: the start's two dense groups stay together."""
    swarm = Swarm(load_scenario("tracking", num_vehicles=agents), worlds)
    swarm.reset(0)
    return Case(repeated(swarm.step, np.zeros((SETS, worlds, agents, 2), np.float32)), agents * worlds)


def bio_inspired(agents: int, worlds: int) -> Case:
    """The paper's controller and ``Swarm.step`` on ``tracking``, after a while under way."""
    scenario = load_scenario("tracking", num_vehicles=agents)
    swarm, policy = Swarm(scenario, worlds), make("bio_inspired", scenario, worlds)
    swarm.reset(0)
    policy.reset(0)

    def run(units: int) -> None:
        for _ in range(units):
            swarm.step(policy.act(swarm.percept))

    settled, start = 0, time.perf_counter()
    while settled < SETTLE_STEPS and (settled < 2 or time.perf_counter() - start < SETTLE_S):
        run(1)
        settled += 1
    return Case(run, agents * worlds, {"settled": settled})


def ppo(agents: int, worlds: int) -> Case:
    """PPO of Stable-Baselines3 through ``SwarmVecEnv``, sampling and learning."""
    return training(SwarmVecEnv(worlds, "single_obstacle", num_vehicles=agents))


def ceiling(kind: str) -> Maker:
    """A loop that does nothing but one part of a step's work."""
    return lambda agents, worlds: Case(*loop(kind, agents, worlds))


def compiled(maker: Maker) -> Maker:
    """The same case, its code compiled before the clock runs, as JAX's is."""

    def made(agents: int, worlds: int) -> Case:
        case = maker(agents, worlds)
        case.run(1)
        return case

    return made


CASES = (core, vector_env, parallel_env, parallel_env_terms, idle, bio_inspired, ppo)

if __name__ == "__main__":
    cases = {case.__name__: case for case in CASES}
    cases |= {kind: ceiling(kind) for kind in KERNELS} | {name: part(name) for name in PARTS}
    serve(
        {name: compiled(case) for name, case in cases.items()},
        ("uuv_marl", "numpy", "numba", "gymnasium", "pettingzoo", "stable_baselines3", "torch"),
    )
