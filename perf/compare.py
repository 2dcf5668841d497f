"""Rates of uuv_marl and its peers, side by side in one run: python perf/compare.py, or make perf.

Every case runs in its own process and its library's virtual environment. All of a cell of the table (so many agents, so
many worlds) are built, then measured in turn, round after round, so that a slow phase of the machine hits all alike.
What cannot run is recorded with its reason. The file is written after every cell, and the cell's rows of a Markdown
table are printed: median [lowest, highest] of the rates, and of their ratios to the cell's first case round by round.
"""

import argparse
import contextlib
import itertools
import json
import math
import os
import platform
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from floor import KERNELS, least_seconds

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
RESULTS, TRAININGS = HERE / "results.json", HERE / "training.json"
AGENTS, WORLDS = (3, 54), (1, 64, 1024)
HARD_CELLS = tuple(itertools.product(AGENTS, WORLDS))
"""More agents don't fit onto maps with so few discs, theirs or ours."""
CELLS = (*HARD_CELLS, (500, 1), (500, 64))
"""With 500 agents in 1024 worlds a step of VMAS would take a minute and a half, and JaxMARL would need 52 GiB."""
FLOOR_CELLS = ((54, 1), (54, 64), (500, 1), (500, 64))
ADAPTERS = ("swarm_idle", "task_idle", "vector_env_idle", "sb3_idle", "torchrl_idle")
TRAINED = ("mappo", "plain")
PEERS = ("mpe2", "vmas", "jaxmarl")
HARD = {"hard_vector_env": "uuv_marl", "hard_core": "uuv_marl", "camar": "camar"}
"""Libraries by case, on maps with hundreds of discs."""
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("NUMBA", "OMP", "MKL", "OPENBLAS")}
LIMIT_S, CASE_LIMIT_S, PATIENCE_S = 240.0, 10.0, 20.0
"""Time limits of a build or a repeat, of all repeats of a case, and of the end of a process [s]."""

Record = dict[str, Any]


class Library(NamedTuple):
    """Environment of a library's cases."""

    venv: str
    script: str
    environment: Mapping[str, str] = {}
    """Environment variables besides those of this process."""


LIBRARIES = {
    "uuv_marl": Library(".venv", "ours.py"),
    **{peer: Library(f".venv-perf-{peer}", f"peer_{peer}.py") for peer in (*PEERS, "camar")},
    "train": Library(".venv", "trainings.py", ONE_THREAD),
    "supersuit": Library(".venv-perf-supersuit", "trainings.py", ONE_THREAD),
    "rllib": Library(".venv-rllib", "trainings.py", ONE_THREAD),
}


class Cell(NamedTuple):
    """Cases that are measured in turn, by name, each with its library and number of worlds."""

    kind: str
    agents: int
    cases: dict[str, tuple[str, int]]


def plan(training: bool) -> Iterator[Cell]:
    """All cells of the comparison, or the one of whole trainings."""
    if training:
        ours = dict.fromkeys(TRAINED, ("train", 16))
        yield Cell("trainings", 54, ours | {library: (library, 16) for library in ("supersuit", "rllib")})
        return
    for agents, worlds in CELLS:
        names = ("core", "vector_env", "parallel_env", *(KERNELS if (agents, worlds) in FLOOR_CELLS else ()))
        ours = dict.fromkeys(names, ("uuv_marl", worlds))
        yield Cell("rates", agents, ours | {peer: (peer, worlds) for peer in PEERS})
    for agents, worlds in HARD_CELLS:
        yield Cell("hard", agents, {case: (library, worlds) for case, library in HARD.items()})
    yield Cell("terms", 54, dict.fromkeys(("parallel_env", "parallel_env_terms"), ("uuv_marl", 1)))
    yield Cell("adapters", 54, dict.fromkeys(ADAPTERS, ("uuv_marl", 64)))


class CannotRun(Exception):  # noqa: N818 - no fault, a result
    """The reason why a case has no rate."""


class Process:
    """A case in its library's environment; ``built`` is its answer when ready. Raises CannotRun."""

    def __init__(self, library: Library, case: str, agents: int, worlds: int, seconds: float, limit: float) -> None:
        python = ROOT / library.venv / "bin" / "python"
        if not python.exists():
            raise CannotRun(f"{library.venv} is missing; 'make perf' and 'make perf-training' make theirs")
        self._limit, self._log = limit, tempfile.TemporaryFile("w+")  # noqa: SIM115 - closed by stop
        self._process = subprocess.Popen(  # noqa: S603
            [python, HERE / library.script, case, *map(str, (agents, worlds, seconds, limit))],
            cwd=ROOT, env={**os.environ, **library.environment}, text=True, bufsize=1,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log,
        )  # fmt: skip
        self.built = self._answer()

    def repeat(self) -> dict[str, Any]:
        """Measure once more."""
        assert self._process.stdin  # noqa: S101
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write("\n")
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        for line in self._process.stdout or ():
            if line.startswith("{"):  # libraries print too
                return json.loads(line)
        ended = self._process.wait()
        self._log.seek(0)
        words = (self._log.read().strip().splitlines() or ["ended without a word"])[-1]
        self.stop()
        raise CannotRun(f"not ready within {self._limit:.0f} s" if ended == -signal.SIGALRM else words)

    def stop(self) -> None:
        """End the process, if possible by itself."""
        with contextlib.suppress(BrokenPipeError), self._process:
            if self._process.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.communicate(timeout=PATIENCE_S)
                self._process.kill()
        self._log.close()


def measure(cell: Cell, rounds: int, seconds: float) -> tuple[list[Record], dict[str, Any]]:
    """The cell's records, and versions by library."""
    records: list[Record] = []
    running: list[tuple[Record, Process]] = []
    about: dict[str, Any] = {}
    length, most = (0.0, math.inf) if cell.kind == "trainings" else (seconds, CASE_LIMIT_S)
    try:
        for name, (library, worlds) in cell.cases.items():
            record: Record = {
                "kind": cell.kind, "case": name, "library": library, "agents": cell.agents, "worlds": worlds,
                "date": datetime.now(UTC).isoformat(timespec="seconds"), "rates": [], "spent_s": 0.0,
            }  # fmt: skip
            records.append(record)
            with noted(record):
                process = Process(LIBRARIES[library], name, cell.agents, worlds, length, LIMIT_S)
                running.append((record, process))
                about[library] = process.built.pop("about")
                record |= process.built
                if record["first_s"] > most:  # its only repeat
                    record |= {"rates": [record["first_rate"]], "spent_s": record["first_s"]}
        for record, process in running * rounds:
            start = time.monotonic()
            if "failed" not in record and record["spent_s"] <= most:
                with noted(record):
                    record["rates"].append(process.repeat()["rate"])
                record["spent_s"] += time.monotonic() - start
    finally:
        for _, process in running:
            process.stop()
    return records, about


@contextlib.contextmanager
def noted(record: Record) -> Iterator[None]:
    """Record why a case can't run."""
    try:
        yield
    except CannotRun as reason:
        record["failed"] = str(reason)


def key(record: Record) -> tuple[str, str, int, int]:
    """Key of a record."""
    return record["kind"], record["case"], record["agents"], record["worlds"]


def machine() -> dict[str, Any]:
    """Machine and versions of the results."""
    cpuinfo = Path("/proc/cpuinfo")
    named = [line for line in cpuinfo.read_text().splitlines() if "model name" in line] if cpuinfo.exists() else []
    return {
        "cpu": named[0].partition(":")[2].strip() if named else platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30),
        "system": f"{platform.system()} {platform.machine()}",
    }


def earlier(path: Path, only: list[str]) -> dict[str, Any]:
    """Content of the file where only a part is measured again, else an empty record of this machine."""
    if not only or not path.exists():
        return {"machine": machine(), "libraries": {}, "cases": []}
    results = json.loads(path.read_text(encoding="utf-8"))
    if results["machine"] != machine():
        raise SystemExit(f"{path} was measured on another machine ({results['machine']}); name another --output")
    return results


def table_rows(records: Sequence[Record]) -> Iterator[tuple[object, ...]]:
    """A cell's rows of the table, and the share that the floor (docs/speed.md) has of a step where it was measured."""
    first = records[0]["rates"] if records else []
    for record in records:
        ratios = [rate / other for rate, other in zip(record["rates"], first, strict=False)]
        yield *key(record), spread(record["rates"], ",.1f") or record["failed"], spread(ratios, ".3f")
    best = [max(record["rates"]) for record in records if record["case"] in KERNELS and record["rates"]]
    if first and records[0]["case"] == "core" and len(best) == len(KERNELS):
        _, _, agents, worlds = key(records[0])
        shares = [least_seconds(agents, worlds, best) * rate / (agents * worlds) for rate in first]
        yield "floor", "of a step", agents, worlds, spread(shares, ".2%"), ""


def spread(values: Sequence[float], spec: str) -> str:
    """Median [lowest, highest]; empty without values."""
    return f"{median(values):{spec}} [{min(values):{spec}}, {max(values):{spec}}]" if values else ""


def main() -> None:
    """Measure, write the results file and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--training", action="store_true", help="whole trainings instead: make perf-training")
    parser.add_argument("--only", nargs="+", default=[], help="cases, libraries, kinds (rates, hard, terms, adapters)")
    parser.add_argument("--rounds", type=int, default=5, help="repeats of each case (default 5)")
    parser.add_argument("--seconds", type=float, default=0.3, help="length of a repeat [s] (default 0.3)")
    parser.add_argument("--output", type=Path, help="results file (default perf/results.json or perf/training.json)")
    arguments = parser.parse_args()
    output = arguments.output or (TRAININGS if arguments.training else RESULTS)
    results = earlier(output, arguments.only)
    results |= {"rounds": arguments.rounds, "seconds": arguments.seconds, "load": round(os.getloadavg()[0], 2)}
    print("| kind | case | agents | worlds | rate [1/s] | ratio to the first case |\n|" + " --- |" * 6)
    for cell in plan(arguments.training):
        asked = {
            n: at for n, at in cell.cases.items() if not arguments.only or {n, at[0], cell.kind} & {*arguments.only}
        }
        records, about = measure(cell._replace(cases=asked), arguments.rounds, arguments.seconds)
        new = {key(record) for record in records}
        results["cases"] = [old for old in results["cases"] if key(old) not in new] + records
        results["libraries"] |= about
        output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        for row in table_rows(records):
            print(f"| {' | '.join(map(str, row))} |", flush=True)


if __name__ == "__main__":
    main()
