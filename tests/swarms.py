"""Swarms that several test files start and step alike."""

from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.sim.swarm import Swarm


def started(scenario, overrides=None, worlds=1, seed=0, n=None):
    """A swarm of n vehicles in a scenario, after its reset."""
    swarm = Swarm(load_scenario(scenario, num_vehicles=n, overrides=overrides), worlds)
    swarm.reset(seed)
    return swarm


def batched(scenario, overrides=None, worlds=1, seed=0, n=None, reward="dense"):
    """Environments stepped together, after their reset."""
    batch = BatchedEnv(load_scenario(scenario, num_vehicles=n, overrides=overrides), worlds, reward)
    batch.reset(seed)
    return batch


def piloted(name, scenario, overrides=None, worlds=1, seed=0, n=None, **parameters):
    """The same in a scenario that meets a policy's requirements, and the policy."""
    suited = with_policy_requirements(name, load_scenario(scenario, num_vehicles=n, overrides=overrides))
    return started(suited, None, worlds, seed), make_policy(name, suited, worlds, **parameters)


def run_of(name, scenario, overrides=None, seed=0):
    """The benchmark's run of one episode."""
    suited = with_policy_requirements(name, load_scenario(scenario, overrides=overrides))
    return next(episodes(suited, name, [seed]))


def fly(swarm, policy, decisions):
    """Let the policy act for some decisions; the last percept."""
    for _ in range(decisions):
        swarm.step(policy.act(swarm.percept))
    return swarm.percept
