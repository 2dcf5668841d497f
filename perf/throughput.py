"""Steps per second of the batched core and of the public environment: python perf/throughput.py

Each figure is the median of repeats, with their lowest and highest. Idle vehicles are the worst case for hearing: the
start's two dense groups stay together.
"""

import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.baselines import make
from uuv_marl.sim.swarm import Swarm

REPEATS = 5
SECONDS = 1.0


def rate(step: Callable[[], object]) -> tuple[float, float, float]:
    """Median, lowest and highest calls per second."""
    step()
    rates = []
    for _ in range(REPEATS):
        calls, start = 0, time.perf_counter()
        while (elapsed := time.perf_counter() - start) < SECONDS:
            step()
            calls += 1
        rates.append(calls / elapsed)
    return statistics.median(rates), min(rates), max(rates)


def core(worlds: int) -> Callable[[], object]:
    """A step of ``Swarm`` with all its worlds: dynamics, sonar, percepts."""
    swarm = Swarm(load_scenario("single_obstacle"), worlds)
    swarm.reset(0)
    action = np.random.default_rng(0).uniform(-1, 1, (worlds, 54, 2)).astype(np.float32)
    return lambda: swarm.step(action)


def public(info_terms: bool) -> Callable[[], object]:
    """A step of ``parallel_env``, reset when over."""
    env = uuv_marl.parallel_env("single_obstacle", info_terms=info_terms)
    env.reset(seed=0)
    actions = {agent: np.array([0.3, 0.1], np.float32) for agent in env.possible_agents}

    def step() -> None:
        if not env.agents:
            env.reset()
        env.step(actions)

    return step


def controlled() -> Callable[[], object]:
    """A step of 64 worlds under the paper's controller."""
    scenario = load_scenario("single_obstacle")
    swarm, policy = Swarm(scenario, 64), make("bio_inspired", scenario, 64)
    swarm.reset(0)
    return lambda: swarm.step(policy.act(swarm.percept))


def main() -> None:
    """Measure and print."""
    table = Table("what", "worlds", "steps/s, median [lowest, highest]", "agent-steps/s")
    cases = [(f"Swarm.step, {w} x 54 vehicles", w, core(w)) for w in (1, 64, 1024)]
    cases += [
        ("Swarm.step with bio_inspired", 64, controlled()),
        ("parallel_env, 54 agents", 1, public(False)),
        ("parallel_env, info_terms=True", 1, public(True)),
    ]
    for name, worlds, step in cases:
        median, low, high = rate(step)
        steps = f"{median * worlds:,.0f} [{low * worlds:,.0f}, {high * worlds:,.0f}]"
        table.add_row(name, str(worlds), steps, f"{median * worlds * 54:,.0f}")
    console = Console(width=110)
    console.print(table)
    console.print(
        f"{platform.processor() or platform.machine()}, {numba.get_num_threads()} threads, {platform.platform()}, "
        f"Python {platform.python_version()}, numba {version('numba')}, numpy {version('numpy')}"
    )


if __name__ == "__main__":
    main()
