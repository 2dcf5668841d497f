"""Rates of uuv_marl and its peers, side by side in one run: python perf/compare.py, or make perf.

Every library runs in its own process and its own virtual environment. A cell of the table (so many agents, so many
worlds) is built by all of them, then measured in turn, round after round, so that a slow phase of the machine hits all
alike. What cannot run is recorded with its reason. The results file is written after every cell.
"""

import argparse
import contextlib
import json
import os
import platform
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
RESULTS = HERE / "results.json"
AGENTS, WORLDS = (3, 54, 500), (1, 64, 1024)
CURVE = (3, 10, 54, 200, 500, 1000, 2000, 5000, 10000)
CEILINGS = ("pairs", "keeps", "sines", "exponentials", "copy")
PARTS = ("part_moved", "part_sorted", "part_measured", "part_heard", "part_perceived", "part_stepped")
FLOOR_CELLS = ((54, 1), (54, 64), (500, 1), (500, 64))
BUILD_LIMIT_S, CASE_LIMIT_S, MEMORY_SHARE = 240.0, 10.0, 0.7


Record = dict[str, Any]
Records = list[Record]


class Library(NamedTuple):
    """Where a library's cases run."""

    venv: str
    script: str
    environment: Mapping[str, str] = {}
    """Variables beside those of this process."""


LIBRARIES = {
    "uuv_marl": Library(".venv", "ours.py"),
    "mpe2": Library(".venv-perf-mpe2", "peer_mpe2.py"),
    "vmas": Library(".venv-perf-vmas", "peer_vmas.py"),
    "jaxmarl": Library(".venv-perf-jaxmarl", "peer_jaxmarl.py"),
}
PEERS = ("mpe2", "vmas", "jaxmarl")


class Cell(NamedTuple):
    """What is measured in turn: cases by name, each with its library and its number of worlds."""

    kind: str
    agents: int
    cases: dict[str, tuple[str, int]]


def plan() -> Iterator[Cell]:
    """All cells of the comparison."""
    for agents in AGENTS:
        for worlds in WORLDS:
            names = ["core", "vector_env", "parallel_env", *(CEILINGS if (agents, worlds) in FLOOR_CELLS else ())]
            ours = dict.fromkeys(names, ("uuv_marl", worlds))
            yield Cell("rates", agents, ours | {peer: (peer, worlds) for peer in PEERS})
    yield Cell("terms", 54, dict.fromkeys(("parallel_env", "parallel_env_terms"), ("uuv_marl", 1)))
    yield Cell("profile", 54, dict.fromkeys(PARTS, ("uuv_marl", 64)))
    yield Cell("training", 54, {"ppo": ("uuv_marl", 64), "mpe2_ppo": ("mpe2", 4), "vmas_ppo": ("vmas", 64)})
    for agents in CURVE:
        yield Cell("curve", agents, dict.fromkeys(("idle", "bio_inspired"), ("uuv_marl", 1)))


class CannotRun(Exception):  # noqa: N818 - no fault, a result
    """Why a case has no rate."""


class Worker:
    """A library's process, started when it is first asked, and anew after it had to be stopped."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self.about: dict[str, Any] = {}
        self._process: subprocess.Popen[str] | None = None
        self._log: IO[str] | None = None

    def ask(self, limit_s: float, **request: object) -> dict[str, Any]:
        """The answer to a request, or CannotRun."""
        process = self._process or self._start()
        assert process.stdin  # noqa: S101
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
        except BrokenPipeError:
            raise CannotRun(self._ended()) from None
        answer = self._answer(process, limit_s)
        if "failed" in answer:
            raise CannotRun(answer["failed"])
        return answer

    def _start(self) -> subprocess.Popen[str]:
        venv, script, environment = self.library
        python = ROOT / venv / "bin" / "python"
        if not python.exists():
            raise SystemExit(f"{venv} is missing; 'make perf' makes it")
        self._log = tempfile.TemporaryFile("w+")  # noqa: SIM115 - closed by stop
        self._process = subprocess.Popen(  # noqa: S603
            [python, HERE / script], cwd=ROOT, env={**os.environ, **environment}, text=True, bufsize=1,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log,
        )  # fmt: skip
        self._lines = queue.SimpleQueue[str]()
        threading.Thread(target=_listen, args=(self._process.stdout, self._lines), daemon=True).start()
        self.about = self._answer(self._process, BUILD_LIMIT_S)
        return self._process

    def _answer(self, process: subprocess.Popen[str], limit_s: float) -> dict[str, Any]:
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            if _memory_share(process.pid) > MEMORY_SHARE:
                self.stop()
                raise CannotRun(f"needed more than {MEMORY_SHARE:.0%} of the memory")
            with contextlib.suppress(queue.Empty):
                line = self._lines.get(timeout=0.05)
                if not line:
                    raise CannotRun(self._ended())
                if line.startswith("{"):  # libraries print too
                    return json.loads(line)
        self.stop()
        raise CannotRun(f"not ready within {limit_s:.0f} s")

    def _ended(self) -> str:
        """The last line of what a process that is gone had to say."""
        assert self._log  # noqa: S101
        self._log.seek(0)
        words = (self._log.read().strip().splitlines() or ["ended without a word"])[-1]
        self.stop()
        return words

    def stop(self, patience_s: float = 0.0) -> None:
        """End the process, if there is one; with patience it may end by itself first."""
        if self._process:
            assert self._process.stdin  # noqa: S101
            if patience_s:
                with contextlib.suppress(BrokenPipeError, subprocess.TimeoutExpired):
                    self._process.stdin.close()
                    self._process.wait(patience_s)
            self._process.kill()
            self._process.wait()
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
            self._process = None
        if self._log:
            self._log.close()
            self._log = None


def _listen(stream: IO[str], lines: queue.SimpleQueue[str]) -> None:
    """Pass on a stream's lines, and an empty one at its end."""
    with stream:
        for line in stream:
            lines.put(line)
    lines.put("")


def _memory_share(pid: int) -> float:
    """Resident share of the machine's memory; 0 where the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages / os.sysconf("SC_PHYS_PAGES")


def measure(cell: Cell, workers: dict[str, Worker], before: Records, arguments: argparse.Namespace) -> None:
    """Add the cell's records to those ``before``."""
    records = [
        {
            "kind": cell.kind, "case": name, "library": library, "agents": cell.agents, "worlds": worlds,
            "date": datetime.now(UTC).isoformat(timespec="seconds"), "rates": [],
        }
        for name, (library, worlds) in cell.cases.items()
    ]  # fmt: skip
    for record in records:
        build(record, workers[record["library"]], before, arguments.seconds)
    for _ in range(arguments.rounds):
        for record in records:
            repeat(record, workers[record["library"]])
    for library in {library for library, _ in cell.cases.values()}:
        with contextlib.suppress(CannotRun):
            workers[library].ask(BUILD_LIMIT_S, clear=True)
    for record in records:
        before[:] = [old for old in before if key(old) != key(record)] + [record]


def build(record: Record, worker: Worker, before: Records, seconds: float) -> None:
    """Have the worker build the case; a first step that takes long is its only repeat."""
    record["spent_s"] = 0.0
    if failed := failed_smaller(record, before):
        reason = failed["failed"].removeprefix("not tried: ")
        record["failed"] = f"not tried: {reason}"
        return
    size = {"agents": record["agents"], "worlds": record["worlds"]}
    try:
        record |= worker.ask(BUILD_LIMIT_S, build=record["case"], seconds=seconds, slow=CASE_LIMIT_S / 2, **size)
    except CannotRun as reason:
        record["failed"] = str(reason)
        return
    if record["first_s"] > CASE_LIMIT_S:
        record["rates"], record["spent_s"] = [record["first_rate"]], record["first_s"]


def repeat(record: Record, worker: Worker) -> None:
    """Measure a built case once more, unless it has had its time."""
    if "failed" in record or record["spent_s"] > CASE_LIMIT_S:
        return
    start = time.monotonic()
    try:
        record["rates"].append(worker.ask(BUILD_LIMIT_S, repeat=record["case"])["rate"])
    except CannotRun as reason:
        record["failed"] = str(reason)
    record["spent_s"] += time.monotonic() - start


def key(record: Record) -> tuple[object, ...]:
    """What a record is about."""
    return record["kind"], record["case"], record["agents"], record["worlds"]


def failed_smaller(record: Record, before: Records) -> Record | None:
    """The record of the same case with fewer worlds that failed, if there is one."""
    same = [old for old in before if key(old)[:3] == key(record)[:3] and old["worlds"] < record["worlds"]]
    return next((old for old in same if "failed" in old), None)


def machine() -> dict[str, Any]:
    """What the figures belong to."""
    cpuinfo = Path("/proc/cpuinfo")
    named = [line for line in cpuinfo.read_text().splitlines() if "model name" in line] if cpuinfo.exists() else []
    return {
        "cpu": named[0].partition(":")[2].strip() if named else platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30),
        "system": f"{platform.system()} {platform.machine()}",
    }


def earlier(path: Path) -> dict[str, Any]:
    """What the file holds, or an empty record of this machine."""
    here = machine()
    if not path.exists():
        return {"machine": here, "libraries": {}, "cases": []}
    found = json.loads(path.read_text(encoding="utf-8"))
    if found["machine"] != here:
        raise SystemExit(f"{path} was measured on another machine ({found['machine']}); name another --output")
    return found


def chosen(cell: Cell, arguments: argparse.Namespace, done: Records) -> Cell:
    """The cell's cases that were asked for."""
    there = {key(record) for record in done}
    wanted = {
        name: where
        for name, where in cell.cases.items()
        if (not arguments.only or {name, where[0], cell.kind} & set(arguments.only))
        and not (arguments.resume and (cell.kind, name, cell.agents, where[1]) in there)
    }
    return cell._replace(cases=wanted)


def main() -> None:
    """Measure, and write the results file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", help="cases, libraries, kinds (rates, terms, profile, training, curve)")
    parser.add_argument("--resume", action="store_true", help="keep what the file has, measure the rest")
    parser.add_argument("--rounds", type=int, default=5, help="repeats of each case (default 5)")
    parser.add_argument("--seconds", type=float, default=0.3, help="length of a repeat [s] (default 0.3)")
    parser.add_argument("--output", type=Path, default=RESULTS, help="results file (default perf/results.json)")
    arguments = parser.parse_args()
    fresh = not (arguments.only or arguments.resume)
    results = {"machine": machine(), "libraries": {}, "cases": []} if fresh else earlier(arguments.output)
    results |= {"rounds": arguments.rounds, "seconds": arguments.seconds, "load": round(os.getloadavg()[0], 2)}
    cells = [cell for cell in (chosen(cell, arguments, results["cases"]) for cell in plan()) if cell.cases]
    workers = {name: Worker(library) for name, library in LIBRARIES.items()}
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    console = Console(stderr=True)
    try:
        with Progress(*columns, console=console) as progress:
            task = progress.add_task("", total=len(cells))
            for cell in cells:
                worlds = sorted({worlds for _, worlds in cell.cases.values()})
                progress.update(task, description=f"{cell.kind}: {cell.agents} agents, {worlds} worlds")
                measure(cell, workers, results["cases"], arguments)
                results["libraries"] |= {name: worker.about for name, worker in workers.items() if worker.about}
                arguments.output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
                progress.advance(task)
                for record in results["cases"][-len(cell.cases) :]:
                    progress.console.print(line(record))
    except KeyboardInterrupt:
        console.print("Stopped; --resume goes on.")
        sys.exit(130)
    finally:
        for worker in workers.values():
            worker.stop()


def line(record: Record) -> str:
    """A record for the terminal."""
    rates = sorted(record["rates"])
    what = f"{record['case']:>14} {record['agents']:>6} x {record['worlds']:<5}"
    if not rates:
        return f"{what} {record['failed']}"
    return f"{what} {rates[len(rates) // 2]:>16,.0f}/s [{rates[0]:,.0f}, {rates[-1]:,.0f}]"


if __name__ == "__main__":
    main()
