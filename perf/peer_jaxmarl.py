"""Case of JaxMARL's MPE_simple_spread_v3 for perf/compare.py: ``step`` over worlds and time, compiled as one."""

import jax
import jax.numpy as jnp
import jaxmarl
from peer_jax import Pytree, looped
from worker import Case, serve

SETS = 8


def simple_spread(agents: int, worlds: int) -> Case:
    """``jit`` of a loop over ``vmap(env.step)``, resets included, as its documents do it.

    As many landmarks as agents, as in MPE2.
    """
    env = jaxmarl.make("MPE_simple_spread_v3", num_agents=agents, num_landmarks=agents)
    key = jax.random.key(0)
    keys = jax.random.split(key, worlds)
    with jax.disable_jit():  # compiling it takes longer than running it once
        observation, state = jax.vmap(env.reset)(keys)
    actions = jax.random.randint(key, (SETS, agents, worlds), 0, 5)
    zeros, no = jnp.zeros(worlds), jnp.zeros(worlds, bool)
    rewards, dones = dict.fromkeys(env.agents, zeros), dict.fromkeys([*env.agents, "__all__"], no)

    def one(k: int, carry: Pytree) -> Pytree:
        keys, _, state, _, _ = carry
        keys = jax.vmap(jax.random.split)(keys)
        chosen = dict(zip(env.agents, actions[k % SETS], strict=True))
        return keys[:, 0], *jax.vmap(env.step)(keys[:, 1], state, chosen)[:4]

    start = keys, observation, state, rewards, dones
    return looped(one, start, agents * worlds, entries=observation[env.agents[0]].shape[-1])


if __name__ == "__main__":
    serve({"jaxmarl": simple_spread})
