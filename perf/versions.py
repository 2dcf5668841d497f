"""Compare this version with another checkout: the same runs bit for bit, and the same speed.

    python perf/versions.py OTHER_CHECKOUT [--bits] [--speed] [--rounds 15]

Both versions run with this interpreter and the scripts here, in processes of their own. Without an option both are
compared. Ends with 1 if a hash differs, or if a median ratio of speeds is below ``LEAST_RATIO``.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from compare import HERE, LIMIT_S, ROOT, Library, Process

LEAST_RATIO, ROUND_S = 0.95, 0.4
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
print(f"| {first - start:.1f} | {time.process_time() - first:.1f} |")
"""


def variables(checkout: Path, **more: str) -> dict[str, str]:
    """Environment variables that import another checkout's package without changing its files."""
    return {"PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1", **more}


def printed(variables: dict[str, str], *arguments: str) -> str:
    """Output of this interpreter."""
    command, environment = [sys.executable, *arguments], {**os.environ, **variables}
    return subprocess.check_output(command, env=environment, text=True)  # noqa: S603


def same_runs(other: Path, only: list[str]) -> bool:
    """Print which hashes of the other version differ here; whether none does."""
    texts = (printed(variables(path), str(HERE / "runs.py"), str(other), *only) for path in (other, ROOT))
    before, now = (
        {(kind, name): digest for kind, name, digest in map(json.loads, text.splitlines())} for text in texts
    )
    bad = [key for key, digest in before.items() if now.get(key) != digest or "failed" in digest]
    print("| runs | hashes | that differ |\n| --- | --- | --- |")
    for kind in dict.fromkeys(kind for kind, _ in before):
        count = sum(len(digest.split()) for key, digest in before.items() if key[0] == kind)
        print(f"| {kind} | {count} | {', '.join(name for k, name in bad if k == kind) or 'none'} |")
    for key in bad:
        print(f"{' '.join(key)}: {before[key]} before, {now.get(key)} now", file=sys.stderr)
    return bool(before) and not bad


def same_speed(other: Path, rounds: int) -> bool:
    """Print agent-steps per second, measured in turn; whether no median ratio is too low."""
    print("| 54 vehicles | before [1/s] | now [1/s] | median ratio | lowest, highest |\n|" + " --- |" * 5)
    good = True
    for case, worlds in CASES:
        libraries = [Library(sys.prefix, "ours.py", variables(path)) for path in (other, ROOT)]
        both = [Process(library, case, 54, worlds, ROUND_S, LIMIT_S) for library in libraries]
        rates: list[tuple[float, float]] = []
        for turn in range(rounds):
            first, second = (process.repeat()["rate"] for process in (both if turn % 2 else both[::-1]))
            rates.append((first, second) if turn % 2 else (second, first))
        for process in both:
            process.stop()
        ratios, (before, now) = [new / old for old, new in rates], map(median, zip(*rates, strict=True))
        good = good and median(ratios) >= LEAST_RATIO
        row = f"{before:,.0f} | {now:,.0f} | {median(ratios):.3f} | {min(ratios):.3f}, {max(ratios):.3f}"
        print(f"| {case} x {worlds} | {row} |")
    return good


def tell_cold_start(other: Path) -> None:
    """Print the CPU seconds of a first environment and of a first batch after it, with nothing compiled before."""
    print("| cold start, CPU seconds | first environment | first batch |\n| --- | --- | --- |")
    for name, path in (("before", other), ("now", ROOT)):
        with tempfile.TemporaryDirectory() as folder:
            print(f"| {name} {printed(variables(path, UUV_MARL_CACHE_DIR=folder), '-c', COLD).strip()}")


def main() -> None:
    """Compare; the exit code is the result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="checkout of the other version")
    parser.add_argument("--bits", action="store_true", help="compare runs")
    parser.add_argument("--speed", action="store_true", help="compare speed")
    parser.add_argument("--rounds", type=int, default=15, help="alternating rounds of the speed (default 15)")
    parser.add_argument("--only", nargs="*", default=[], help="kinds of runs, such as episodes or checkpoints")
    arguments = parser.parse_args()
    other, both, good = arguments.other.resolve(), arguments.bits == arguments.speed, True
    if arguments.bits or both:
        good = same_runs(other, arguments.only)
    if arguments.speed or both:
        good = same_speed(other, arguments.rounds) and good
        tell_cold_start(other)
    sys.exit(not good)


if __name__ == "__main__":
    main()
