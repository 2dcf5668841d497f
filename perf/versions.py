"""Compare this version with another checkout: the same runs bit for bit, and the same speed.

    python perf/versions.py OTHER_CHECKOUT [--bits] [--speed] [--rounds 15]

Both versions run with this interpreter and the scripts here, in processes of their own. Without an option both are
compared. Ends with 1 if a hash differs, or if a median ratio of speeds is below ``LEAST_RATIO``.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from compare import HERE, ROOT, Library, Worker

LEAST_RATIO, ROUND_S, LIMIT_S = 0.93, 0.4, 600.0
CASES = (("core", 1), ("vector_env", 64), ("parallel_env", 1))
COLD = """
import time, numpy, uuv_marl
start = time.process_time()
env = uuv_marl.parallel_env()
env.reset(10_000)
env.step({agent: numpy.zeros(2, numpy.float32) for agent in env.agents})
first = time.process_time()
envs = uuv_marl.vector_env(2)
envs.reset(seed=10_000)
envs.step(numpy.zeros((2, 54, 2), numpy.float32))
print(first - start, time.process_time() - first)
"""


def told(checkout: Path, **more: str) -> dict[str, str]:
    """Variables with which that checkout's package is imported, and its files stay as they are."""
    return {"PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1", **more}


def output(environment: dict[str, str], *arguments: str) -> str:
    """What this interpreter prints."""
    done = subprocess.run([sys.executable, *arguments], env={**os.environ, **environment}, stdout=-1, text=True)  # noqa: S603, PLW1510
    return done.stdout


def same_runs(other: Path, only: list[str]) -> bool:
    """Print how many hashes of each kind differ; whether none does."""
    before, now = (
        {(kind, name): hashes for kind, name, hashes in map(json.loads, lines.splitlines())}
        for lines in (output(told(path), str(HERE / "runs.py"), str(other), *only) for path in (other, ROOT))
    )
    bad = [key for key in {**before, **now} if before.get(key) != now.get(key) or "failed" in now[key]]
    print("| runs | hashes | that differ |\n| --- | --- | --- |")
    for kind in dict.fromkeys(kind for kind, _ in before):
        count = sum(len(hashes) if isinstance(hashes, list) else 1 for (k, _), hashes in before.items() if k == kind)
        print(f"| {kind} | {count} | {', '.join(name for k, name in bad if k == kind) or 'none'} |")
    for key in bad:
        print(f"{' '.join(key)}: {before.get(key)} before, {now.get(key)} now", file=sys.stderr)
    return bool(before) and not bad


def same_speed(other: Path, rounds: int) -> bool:
    """Print agent-steps per second, measured in turn; whether no median ratio is too low."""
    workers = [Worker(Library(sys.prefix, "ours.py", told(path))) for path in (other, ROOT)]
    rates: dict[str, list[list[float]]] = {name: [[], []] for name, _ in CASES}
    for worker in workers:
        for name, worlds in CASES:
            worker.ask(LIMIT_S, build=name, agents=54, worlds=worlds, seconds=ROUND_S, slow=60.0)
    for turn in range(rounds):
        for name, found in rates.items():
            for k in ((0, 1), (1, 0))[turn % 2]:
                found[k].append(workers[k].ask(LIMIT_S, repeat=name)["rate"])
    for worker in workers:
        worker.stop()
    print("| 54 vehicles | before [1/s] | now [1/s] | median ratio | lowest, highest |\n|" + " --- |" * 5)
    medians: list[float] = []
    for (name, worlds), (before, now) in zip(CASES, rates.values(), strict=True):
        ratios = [new / old for old, new in zip(before, now, strict=True)]
        medians.append(statistics.median(ratios))
        both = f"{statistics.median(before):,.0f} | {statistics.median(now):,.0f}"
        print(f"| {name} x {worlds} | {both} | {medians[-1]:.3f} | {min(ratios):.3f}, {max(ratios):.3f} |")
    return min(medians) >= LEAST_RATIO


def tell_cold_start(other: Path) -> None:
    """Print the CPU seconds of a first environment and of a first batch after it, with nothing compiled before."""
    print("| cold start, CPU seconds | first environment | first batch |\n| --- | --- | --- |")
    for name, path in (("before", other), ("now", ROOT)):
        with tempfile.TemporaryDirectory() as folder:
            seconds = output(told(path, UUV_MARL_CACHE_DIR=folder), "-c", COLD).split()
        print(f"| {name} | {' | '.join(f'{float(one):.1f}' for one in seconds)} |")


def main() -> None:
    """Compare, and tell by the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="checkout of the other version")
    parser.add_argument("--bits", action="store_true", help="compare runs")
    parser.add_argument("--speed", action="store_true", help="compare speed")
    parser.add_argument("--rounds", type=int, default=15, help="alternating rounds of the speed (default 15)")
    parser.add_argument("--only", nargs="*", default=[], help="kinds of runs, such as episodes or checkpoints")
    given: Any = parser.parse_args()
    other, both, good = given.other.resolve(), given.bits == given.speed, True
    if given.bits or both:
        good = same_runs(other, given.only)
    if given.speed or both:
        good = same_speed(other, given.rounds) and good
        tell_cold_start(other)
    sys.exit(not good)


if __name__ == "__main__":
    main()
