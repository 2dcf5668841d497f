"""Cases of VMAS's flocking for perf/compare.py: its batched step on the CPU."""

from typing import Any

import torch
import vmas
from worker import Case, repeated, seconds_of, serve

DEFAULT_THREADS = torch.get_num_threads()
SETS, CROWD, CROWD_SPACING, STEP_LIMIT_S = 8, 54, 0.02, 90.0


def flocking(agents: int, worlds: int, **settings: float) -> Any:
    """The scenario with its defaults: 5 obstacles, a lidar of 12 rays.

    More than 54 agents start closer than its 0.15: so many don't fit into its area, and the search for free places
    would never end.
    """
    if agents > CROWD:
        settings["min_dist_between_entities"] = CROWD_SPACING
    return vmas.make_env("flocking", worlds, "cpu", seed=0, n_agents=agents, **settings)


def steps(env: Any, agents: int, worlds: int, **facts: object) -> Case:
    """A unit is a step of all worlds, with random actions drawn before."""
    actions = [list(one) for one in torch.rand(SETS, agents, worlds, 2) * 2 - 1]
    return repeated(lambda k: env.step(actions[k % SETS]), agents * worlds, **facts)


def choose_threads(agents: int, worlds: int) -> None:
    """Torch's own number of threads or one, what is faster with at most 54 agents: small tensors suffer from threads.

    Raises TimeoutError where a step of all agents would take too long; it grows with their square.
    """
    few = min(agents, CROWD)
    case = steps(flocking(few, worlds, min_dist_between_entities=CROWD_SPACING), few, worlds)
    seconds = {}
    for threads in {1, DEFAULT_THREADS}:
        torch.set_num_threads(threads)
        case.run(1)
        seconds[threads] = seconds_of(case, 2) / 2
    best = min(seconds, key=lambda threads: seconds[threads])
    expected = seconds[best] * (agents / few) ** 2
    if expected > STEP_LIMIT_S:
        raise TimeoutError(f"a step would take about {expected:.0f} s, judging by one of {few} agents")
    torch.set_num_threads(best)


def step(agents: int, worlds: int) -> Case:
    """``step`` of all worlds."""
    choose_threads(agents, worlds)
    env = flocking(agents, worlds)
    entries = env.observation_space[0].shape[0]
    return steps(env, agents, worlds, entries=entries, threads=torch.get_num_threads())


if __name__ == "__main__":
    serve({"vmas": step})
