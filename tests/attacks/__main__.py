"""The campaign: ``python -m tests.attacks`` (``make test-attacks``), repeatable by its seed.

Every kind of input runs in a process of its own, with bounds checks in compiled code, so that a crash or a hang costs
one case. Then programs are killed while they write. Ends with 1 where anything but a clear answer came.
"""

import argparse
import collections
import json
import os
import queue
import subprocess
import sys
import threading
import time

from tests.attacks import crashes, inputs
from tests.processes import ROOT

OUTCOMES = ("accepted", "refused", "unclear", "wrong", "memory", "crash", "hang")
HANG_S, START_S = 60.0, 1200.0  # what cases need is compiled at the start


def environment():
    """Bounds checks, on one thread since Numba loses the errors of others, in a cache of their own."""
    cache = os.environ.get("UUV_MARL_CACHE_DIR", str(ROOT / ".venv" / "bounds"))
    return {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_NUM_THREADS": "1", "UUV_MARL_CACHE_DIR": cache}


def lines_of(process):
    """A queue of the process's lines, and None at its end."""
    found = queue.Queue()

    def read():
        for line in process.stdout:
            found.put(line)
        found.put(None)

    threading.Thread(target=read, daemon=True).start()
    return found


def run(kind, seed, first, last):
    """Outcomes of the cases of a kind, with what was told of bad ones."""
    while first < last:
        command = [sys.executable, "-m", "tests.attacks.worker", kind, str(seed), str(first), str(last)]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT, env=environment()
        )
        found, limit = lines_of(process), START_S
        while first < last:
            try:
                line = found.get(timeout=limit)
            except queue.Empty:
                process.kill()
                yield first, "hang", ""
                first += 1
                break
            if line is None:
                yield first, "crash", f"exit code {process.wait()}"
                first += 1
                break
            told = json.loads(line)
            limit = HANG_S
            if "case" in told:
                yield told["case"], told["outcome"], told["told"]
                first = told["case"] + 1
        process.kill()
        process.wait()


def campaign(kinds, seed, share):
    counts = {}
    for kind in kinds:
        started, number = time.monotonic(), max(int(inputs.COUNTS[kind] * share), 1)
        counts[kind.__name__] = counter = collections.Counter()
        for case, outcome, told in run(kind.__name__, seed, 0, number):
            counter[outcome] += 1
            if outcome not in ("accepted", "refused"):
                print(f"{kind.__name__} {case}: {outcome}\n{told}", file=sys.stderr, flush=True)
        print(f"{time.monotonic() - started:5.0f} s  {kind.__name__}: {dict(counter)}", flush=True)
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=13, help="of all random numbers")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases, such as 0.1 for a quick look")
    parser.add_argument("--only", nargs="*", default=[], help="kinds of inputs, or crashes")
    parser.add_argument("--case", type=int, help="run this case of --only alone, in this process, with its traceback")
    given = parser.parse_args()
    kinds = [kind for kind in inputs.COUNTS if not given.only or kind.__name__ in given.only]
    if given.case is not None:
        for outcome in run(kinds[0].__name__, given.seed, given.case, given.case + 1):
            print(*outcome, sep="\n")
        return
    counts = campaign(kinds, given.seed, given.share)
    crashed = crashes.campaign(given.share) if not given.only or "crashes" in given.only else []
    bad = sum(counter[outcome] for counter in counts.values() for outcome in OUTCOMES[2:])
    sys.exit(bad > 0 or any(sum(row[3:]) for row in crashed))


if __name__ == "__main__":
    main()
