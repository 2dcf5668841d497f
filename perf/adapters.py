"""What each API adds to the batched step at 64 worlds of 54 vehicles: python perf/adapters.py [FILE.md]

The batched step is ``Task.step``: dynamics, sonar, observation, reward, endings, as arrays. All cases are measured in
turn, round after round, so that a busy machine slows them alike; the figure is the median over rounds of the ratio to
the batched step of the same round. Vehicles are idle: the start's two dense groups stay together.
"""

import platform
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numba
import numpy as np
import torch

import uuv_marl
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.envs.task import make_task

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from uuv_marl.envs.torchrl import SwarmEnv

WORLDS, VEHICLES, ROUNDS, STEPS = 64, 54, 60, 10
BATCHED = "batched step: Task.step"


def cases() -> dict[str, Callable[[], object]]:
    """A step of each API, on idle worlds that never end while they are measured."""
    never = {"time_limit.extra_s": 1e6}
    action = np.zeros((WORLDS, VEHICLES, 2), np.float32)
    task = make_task(num_worlds=WORLDS, overrides=never)
    task.reset(0)
    core = make_task(num_worlds=WORLDS, overrides=never)
    core.reset(0)
    envs = uuv_marl.vector_env(WORLDS, overrides=never)
    envs.reset(seed=0)
    rows, row_action = SwarmVecEnv(WORLDS, overrides=never), action.reshape(-1, 2)
    rows.seed(0)
    rows.reset()
    batched = SwarmEnv(WORLDS, overrides=never, seed=0)
    data = batched.reset().set(("uuv", "action"), torch.from_numpy(action))
    return {
        "water only: Swarm.step": lambda: core.swarm.step(action),
        BATCHED: lambda: task.step(action),
        "vector_env": lambda: envs.step(action),
        "SB3: SwarmVecEnv": lambda: rows.step(row_action),
        "TorchRL: SwarmEnv.step": lambda: batched.step(data.copy()),
    }


def measure(steps: dict[str, Callable[[], object]]) -> dict[str, list[float]]:
    """Seconds per step, by case and round."""
    times: dict[str, list[float]] = {name: [] for name in steps}
    for turn in range(ROUNDS + 1):
        for name, step in steps.items():
            start = time.perf_counter()
            for _ in range(STEPS):
                step()
            if turn:  # the first round warms up
                times[name].append((time.perf_counter() - start) / STEPS)
    return times


def report(times: dict[str, list[float]]) -> str:
    """The table in Markdown, with machine and versions."""
    lines = [
        f"Worlds {WORLDS}, vehicles {VEHICLES}, {ROUNDS} rounds of {STEPS} steps. "
        "Ratio to the batched step of the same round: median [quartiles].",
        "",
        "| API | ms per step | agent-steps/s | to the batched step |",
        "| --- | --- | --- | --- |",
    ]
    for name, seconds in times.items():
        ratios = [s / b - 1.0 for s, b in zip(seconds, times[BATCHED], strict=True)]
        low, middle, high = statistics.quantiles(ratios, n=4)
        median = statistics.median(seconds)
        lines.append(
            f"| {name} | {1e3 * median:.2f} | {WORLDS * VEHICLES / median:,.0f} | "
            f"{middle:+.0%} [{low:+.0%}, {high:+.0%}] |"
        )
    libraries = ", ".join(
        f"{name} {version(name)}" for name in ("numba", "numpy", "gymnasium", "stable-baselines3", "torchrl", "torch")
    )
    machine = f"{platform.machine()}, {numba.get_num_threads()} threads, Python {platform.python_version()}"
    return "\n".join([*lines, "", f"{machine}, {libraries}.", ""])


def main() -> None:
    """Measure, print, and write where a file is named."""
    text = report(measure(cases()))
    print(text)
    for path in sys.argv[1:]:
        Path(path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
