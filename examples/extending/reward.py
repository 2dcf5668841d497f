"""A reward of your own: a function from the swarm after a step to an array, shape (world, vehicle)."""

import numpy as np
from numpy.typing import NDArray

import uuv_marl
from uuv_marl.sim.swarm import Swarm


def close_and_careful(swarm: Swarm) -> NDArray[np.float64]:
    """Negative cost of distance to the reference point, nearness and collisions, shape (world, vehicle).

    ``swarm.state`` and ``swarm.facts`` hold the arrays; ``help(uuv_marl.sim.arrays.Facts)`` explains each.
    """
    offset = swarm.state.eta[:, :, :2] - swarm.facts.reference[:, :1, :2]
    distance = np.linalg.norm(offset, axis=-1)
    near = np.minimum(swarm.facts.clearance, swarm.facts.spacing)
    reward = -0.01 * distance - np.clip(1.0 - near / 5.0, 0.0, 1.0) - 10.0 * swarm.facts.vehicle_collisions
    return np.where(swarm.state.alive, reward, 0.0)


if __name__ == "__main__":
    env = uuv_marl.parallel_env("starter", for_policy="bio_inspired_plus", reward=close_and_careful)
    policy = uuv_marl.make_policy("bio_inspired_plus", env)
    observations, _ = env.reset(seed=0)
    total = 0.0
    while env.agents:
        observations, rewards, *_ = env.step(policy(observations))
        total += sum(rewards.values())
    print(f"sum of all rewards: {total:.1f}")
