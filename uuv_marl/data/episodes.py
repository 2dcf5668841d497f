"""Episodes of a policy, one for each vehicle: what it observes, does and receives."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines import make_policy
from uuv_marl.benchmark.evaluate import batch_size, blaming
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.envs.ending import succeeded
from uuv_marl.scenario import Scenario
from uuv_marl.sim.observation import Observe
from uuv_marl.types import Float32, Float64

_MOST_BYTES = 2**29
"""Most memory that the observations of a batch may take."""


class Episode(NamedTuple):
    """A vehicle's episode: its decisions until the world ends or it is lost, one at each time."""

    seed: int
    """Seed of the world."""
    vehicle: int
    """Index of the vehicle."""
    observation: Float32
    """Shape (time + 1, entry), the last one after the last decision."""
    action: Float32
    """Shape (time, entry)."""
    reward: Float64
    """Shape (time,)."""
    terminated: bool
    """Whether its last decision ended it by the task's end or a loss."""
    truncated: bool
    """Whether its last decision ended it by the time limit."""
    is_success: bool
    """As in the infos of environments."""


def worlds(scenario: Scenario, policy: str, seeds: Sequence[int], observe: Observe) -> Iterator[list[Episode]]:
    """Run a policy; yields the episodes of all vehicles of a world, by index, as soon as it ends.

    They depend on the world's seed alone. Worlds are stepped together, and those of a batch may end in any order.

    Args:
        scenario: must have what the policy requires (``uuv_marl.with_policy_requirements``).
        policy: its name, see ``uuv_marl.make_policy``.
        seeds: one seed for each world.
        observe: ``positions`` or ``closeness``, as for ``uuv_marl.parallel_env``.
    """
    one = BatchedEnv(scenario, observe=observe)
    each = (one.longest_episode + 1) * one.swarm.num_vehicles * one.layout.size * 4
    size = max(1, min(batch_size(one.swarm.num_vehicles), _MOST_BYTES // each))
    with blaming(policy):
        for first in range(0, len(seeds), size):
            yield from _batch(scenario, policy, seeds[first : first + size], observe)


def _batch(scenario: Scenario, policy: str, seeds: Sequence[int], observe: Observe) -> Iterator[list[Episode]]:
    """The episodes of worlds that are stepped together."""
    env = BatchedEnv(scenario, len(seeds), observe=observe, keep_terms=False)
    actor = make_policy(policy, scenario, len(seeds))
    observations, actions, rewards = [env.reset(list(seeds))], list[Float32](), list[Float64]()
    shape = len(seeds), env.swarm.num_vehicles
    decisions = np.zeros(shape, np.int64)
    terminated, truncated = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    while not env.over.all():
        running = ~env.over
        actor.active[:] = running
        actions.append(actor.act(env.swarm.percept).copy())
        result = env.step(actions[-1])
        observations.append(result.observation)
        rewards.append(result.reward.copy())
        ends = (result.terminated | result.truncated) & (decisions == 0)
        decisions[ends] = len(actions)
        terminated |= result.terminated & ends
        truncated |= result.truncated & ends
        for w in np.flatnonzero(running & env.over).tolist():
            observation, action = (np.stack([array[w] for array in arrays]) for arrays in (observations, actions))
            reward = np.stack([array[w] for array in rewards])
            yield [
                Episode(
                    seeds[w], i, observation[: t + 1, i], action[:t, i], reward[:t, i],
                    bool(terminated[w, i]), bool(truncated[w, i]), succeeded(env, w, i),
                )
                for i, t in enumerate(decisions[w].tolist())
            ]  # fmt: skip
