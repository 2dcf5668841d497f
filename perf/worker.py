"""The measured side of perf/compare.py: one case in one process, built, then timed once for every line on the input.

Arguments: the case's name, agents, worlds, seconds of a repeat (0 for one unit), and after how many seconds a build or
a repeat ends the process. Runs in every library's own environment, so it needs Python's own library alone.
"""

import json
import os
import platform
import resource
import signal
import sys
import time
from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any, NamedTuple

BUILD_S = 20.0
MEMORY_SHARE = 0.7
"""Share of the machine's memory above which a case fails."""
REPORTED = (
    "uuv_marl", "numpy", "numba", "gymnasium", "pettingzoo", "stable_baselines3", "torch", "mpe2", "vmas", "jaxmarl",
    "jax", "jaxlib", "camar", "supersuit", "ray",
)  # fmt: skip
"""Libraries whose versions a case reports if it imports them."""


class Case(NamedTuple):
    """Work to repeat."""

    run: Callable[[int], object]
    """Run a number of units."""
    amount: float
    """Content of a unit: agent-steps, pairs, sines or bytes."""
    facts: Mapping[str, object] = {}
    """Further data for the results file."""


Maker = Callable[[int, int], Case]
"""From numbers of agents and worlds to a case."""


def repeated(step: Callable[[int], object], amount: float, **facts: object) -> Case:
    """A case whose unit is a call of ``step`` with the unit's number."""

    def run(units: int) -> None:
        for k in range(units):
            step(k)

    return Case(run, amount, facts)


def built(make: Callable[[], Any], worlds: int) -> list[Any]:
    """As many of the environments as are built within ``BUILD_S``, reset to the seeds 0, 1, ..."""
    envs: list[Any] = []
    start = time.perf_counter()
    while len(envs) < worlds and time.perf_counter() - start < BUILD_S:
        envs.append(make())
        envs[-1].reset(seed=len(envs) - 1)
    return envs


def seconds_of(case: Case, units: int) -> float:
    """Time of a number of units [s]."""
    start = time.perf_counter()
    case.run(units)
    return time.perf_counter() - start


def units_within(case: Case, seconds: float) -> int:
    """Number of units that fill this time, found with increasing trials."""
    units, spent = 1, seconds_of(case, 1)
    while spent < seconds / 4:
        units *= min(16, max(2, int(seconds / 2 / spent)))
        spent = seconds_of(case, units)
    return max(1, round(units * seconds / spent))


def serve(makers: Mapping[str, Maker], warm: bool = False) -> None:
    """Build and time; an answer is a JSON object on a line. A process that can't ends, the reason its last words.

    ``warm`` has the code compiled before the clock runs, as JAX's is.
    """
    name, (agents, worlds), (seconds, limit) = sys.argv[1], map(int, sys.argv[2:4]), map(float, sys.argv[4:])
    most = int(MEMORY_SHARE * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    signal.setitimer(signal.ITIMER_REAL, limit)
    start = time.perf_counter()
    case = makers[name](agents, worlds)
    if warm:
        case.run(1)
    build_s, first_s = time.perf_counter() - start, seconds_of(case, 1)
    units = units_within(case, seconds) if first_s < limit / 50 and seconds else 1
    versions = {library: version(library) for library in REPORTED if library in sys.modules}
    about = {"python": platform.python_version(), "versions": versions}
    say(about=about, build_s=build_s, first_s=first_s, first_rate=case.amount / first_s, facts=dict(case.facts))
    for _ in sys.stdin:
        signal.setitimer(signal.ITIMER_REAL, limit)
        say(rate=units * case.amount / seconds_of(case, units))


def say(**answer: object) -> None:
    """Answer with one line."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    print(json.dumps(answer), flush=True)
