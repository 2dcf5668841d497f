"""Cases of MPE2's simple_spread_v3 for perf/compare.py: PettingZoo's parallel API."""

import numpy as np
from mpe2 import simple_spread_v3
from worker import Case, built, repeated, serve

ENDLESS, SETS = 10**9, 8


def parallel_env(agents: int, worlds: int) -> Case:
    """Worlds one after the other, as many as are built in time: MPE2 has no other way in one process.

    No episode ends. A unit is a step of one world.
    """
    envs = built(lambda: simple_spread_v3.parallel_env(N=agents, max_cycles=ENDLESS), worlds)
    drawn = np.random.default_rng(0).integers(5, size=(SETS, agents)).tolist()
    actions = [dict(zip(envs[0].possible_agents, one, strict=True)) for one in drawn]
    entries = envs[0].observation_space("agent_0").shape[0]
    return repeated(lambda k: envs[k % len(envs)].step(actions[k % SETS]), agents, entries=entries, built=len(envs))


if __name__ == "__main__":
    serve({"mpe2": parallel_env})
