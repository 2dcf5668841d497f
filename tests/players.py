"""The same policy through every interface: each player gives the actions of two worlds, decision by decision.

Episodes are ``CYCLES`` decisions long at most and follow each other; nobody resets the policy. An entry of a record is
the actions of a world's vehicles, shape (vehicle, entry), zero for lost ones.
"""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from pettingzoo.utils import BaseParallelWrapper

import uuv_marl
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.envs.core import make_batched_env
from uuv_marl.scenario import load_scenario

WORLDS, CYCLES = 2, 9


def suited(name, scenario, **overrides):
    return with_policy_requirements(name, load_scenario(scenario, overrides=overrides))


def reference(name, scenario, seed, decisions):
    """``Policy.act`` on the swarm's own percepts."""
    env = make_batched_env(scenario, WORLDS, max_cycles=CYCLES)
    policy, records = make_policy(name, scenario, WORLDS), [[] for _ in range(WORLDS)]
    env.reset(seed)
    while min(map(len, records)) < decisions:
        alive, actions = env.swarm.state.alive.copy(), policy.act(env.swarm.percept).copy()
        for w, record in enumerate(records):
            record.append(np.where(alive[w, :, None], actions[w], np.float32(0.0)))
        over = env.step(actions).over
        if over.any():
            env.reset(worlds=np.flatnonzero(over).tolist())
    return [record[:decisions] for record in records]


def by_agent(env, actions):
    """A dictionary as a record's entry."""
    whole = np.zeros((len(env.possible_agents), *env.action_space("uuv_0").shape), np.float32)
    for agent, action in actions.items():
        if agent in env.agents:
            whole[env.possible_agents.index(agent)] = action
    return whole


def sometimes_twice(policy, observations, agents, rng):
    if rng.random() < 0.3:
        policy(observations)
    return policy(observations)


def by_parts(policy, observations, agents, rng):
    actions = {}
    for some in np.array_split(rng.permutation(agents), rng.integers(1, len(agents) + 1)):
        actions |= policy({agent: observations[agent] for agent in some})
    return actions


def parallel(name, scenario, seed, decisions, rng, wrap=lambda env: env, ask=sometimes_twice):
    """Dictionaries of all agents, sometimes asked twice."""
    records = []
    for w in range(WORLDS):
        env, record = wrap(uuv_marl.parallel_env(scenario, max_cycles=CYCLES)), []
        policy = make_policy(name, env)
        observations, _ = env.reset(seed=seed + w)
        while len(record) < decisions:
            actions = ask(policy, observations, env.agents, rng)
            record.append(by_agent(env, actions))
            observations, *_ = env.step(actions)
            if not env.agents:
                observations, _ = env.reset()
        records.append(record)
    return records


def wrapped(name, scenario, seed, decisions, rng):
    """The same below a wrapper."""
    return parallel(name, scenario, seed, decisions, rng, BaseParallelWrapper)


def parts(name, scenario, seed, decisions, rng):
    """Some agents at a time, in any order."""
    return parallel(name, scenario, seed, decisions, rng, ask=by_parts)


def aec(name, scenario, seed, decisions, rng):
    """PettingZoo's turns, one observation at a time."""
    records = []
    for w in range(WORLDS):
        env, record = uuv_marl.env(scenario, max_cycles=CYCLES), []
        policy, own = make_policy(name, env), seed + w
        while len(record) < decisions:
            env.reset(seed=own)
            own, actions = None, {}
            for agent in env.agent_iter():
                observation, _, terminated, truncated, _ = env.last()
                if terminated or truncated:
                    env.step(None)
                    continue
                actions[agent] = policy({agent: observation})[agent]
                waiting = [other for other in env.agents if other not in actions]
                if not any(not env.terminations[other] for other in waiting):
                    record.append(by_agent(env, actions))
                    actions = {}
                env.step(policy({agent: observation})[agent])
        records.append(record[:decisions])
    return records


def vector(name, scenario, seed, decisions, rng):
    """Gymnasium's vector API in one of its three modes."""
    mode = list(AutoresetMode)[rng.integers(len(AutoresetMode))]
    envs = uuv_marl.vector_env(WORLDS, scenario, max_cycles=CYCLES, autoreset_mode=mode)
    policy, records = make_policy(name, envs), [[] for _ in range(WORLDS)]
    observations, _ = envs.reset(seed=seed)
    ignored = np.zeros(WORLDS, bool)
    while min(map(len, records)) < decisions:
        alive, actions = envs.swarm.state.alive.copy(), policy(observations)
        for w in np.flatnonzero(~ignored):
            records[w].append(np.where(alive[w, :, None], actions[w], np.float32(0.0)))
        observations, _, terminated, truncated, _ = envs.step(actions)
        over = terminated | truncated
        ignored = over if mode is AutoresetMode.NEXT_STEP else np.zeros(WORLDS, bool)
        if mode is AutoresetMode.DISABLED and over.any():
            observations, _ = envs.reset(options={"reset_mask": over})
    return [record[:decisions] for record in records]


def sb3(name, scenario, seed, decisions, rng):
    """Stable-Baselines3's rows, below its wrapper."""
    from stable_baselines3.common.vec_env import VecCheckNan

    from uuv_marl.envs.sb3 import SwarmVecEnv

    env = VecCheckNan(SwarmVecEnv(scenario, WORLDS, max_cycles=CYCLES))
    policy, records = make_policy(name, env), [[] for _ in range(WORLDS)]
    env.seed(seed)
    observations = env.reset()
    for _ in range(decisions):
        actions = policy(observations)
        for record, own in zip(records, actions.reshape(WORLDS, -1, actions.shape[-1]), strict=True):
            record.append(own)
        observations, *_ = env.step(actions)
    return records


def solo(name, scenario, seed, decisions, rng):
    """Gymnasium's one learner, which acts as all others do."""
    records = []
    for w in range(WORLDS):
        env = gymnasium.make("uuv_marl/Solo-v2", scenario=scenario, others=name, max_cycles=CYCLES)
        policy, record = make_policy(name, env), []
        observation, _ = env.reset(seed=seed + w)
        while len(record) < decisions:
            record.append(policy(observation)[None])
            observation, _, terminated, truncated, _ = env.step(record[-1][0])
            if terminated or truncated:
                observation, _ = env.reset()
        records.append(record)
    return records


PLAYERS = (parallel, wrapped, parts, aec, vector, sb3, solo)


def compare(player, name, scenario, seed, decisions, rng):
    """Raises AssertionError where the player's actions are not those of ``reference``, bit for bit."""
    if scenario.loses_vehicles and player in (sb3, solo):
        return
    expected = reference(name, scenario, seed, decisions)
    for w, record in enumerate(player(name, scenario, seed, decisions, rng)):
        for k, (mine, theirs) in enumerate(zip(record, expected[w], strict=True)):
            assert mine.tobytes() == theirs[: len(mine)].tobytes(), f"world {w}, decision {k}: {player.__name__}"
