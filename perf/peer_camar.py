"""Case of CAMAR's random_grid for perf/compare.py: ``step`` over worlds and time, compiled as one."""

import jax
import jax.numpy as jnp
from camar import camar_v0
from camar.wrappers import OptimisticResetVecEnvWrapper
from peer_jax import Pytree, looped
from worker import Case, serve

SETS, RESET_RATIO = 8, 64
MAP = {"num_rows": 12, "num_cols": 12, "obstacle_density": 0.15}
"""Of 264 discs, as many as the piles of ours have on average: 8 around each of 21 obstacles, and 96 as banks."""


def random_grid(agents: int, worlds: int) -> Case:
    """``jit`` of a loop over CAMAR's own batch of worlds with resets, all else as it comes.

    Its episodes last 100 steps, so 64 worlds need less than one new map in a step; it draws one, needed or not.
    """
    world = camar_v0("random_grid", map_kwargs={"num_agents": agents, **MAP})
    env = OptimisticResetVecEnvWrapper(world, worlds, min(worlds, RESET_RATIO))
    key = jax.random.key(0)
    observation, state = env.reset(key)
    actions = jax.random.uniform(key, (SETS, worlds, agents, 2), minval=-1.0, maxval=1.0)

    def one(k: int, carry: Pytree) -> Pytree:
        key, _, state, _, _ = carry
        key, now = jax.random.split(key)
        return key, *env.step(now, state, actions[k % SETS])[:4]

    start = key, observation, state, jnp.zeros((worlds, agents, 1)), jnp.zeros(worlds, bool)
    return looped(one, start, agents * worlds, entries=world.observation_size, discs=world.num_landmarks)


if __name__ == "__main__":
    serve({"camar": random_grid})
