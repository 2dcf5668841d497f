"""Programs that are stopped while they write: before single file operations, and by SIGKILL at random moments.

After each stop the same program runs again, and must give what an uninterrupted one gives.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.processes import ROOT

BENCHMARK = """
from uuv_marl.cli import app
try:
    app(["benchmark", "--scenario", "starter", "--policy", "idle", "--policy", "bio_inspired_plus", "--seeds", "3",
         "--output", str(folder)], standalone_mode=False)
except SystemExit as end:
    assert not end.code, end.code
"""
TRAINING = """
from uuv_marl.train.run import resume, train
from uuv_marl.train.training import Training
shorter = {"time_limit.extra_s": 5.0, "time_limit.factor": 0.2}
training = Training(
    scenario="starter", overrides=shorter, sizes=((5, 2),), steps=480, checkpoint_every=1, validations=2,
    validation_episodes=1, ppo={"horizon": 12}, network={"hidden": (8, 8), "memory": True},
)
for _ in resume(folder) if (folder / "config.json").exists() else train(folder, training):
    pass
"""
# Ends the process before the k-th operation that changes something below the folder; k = 0 counts them instead.
HOOK = """
import atexit, os, sys
from pathlib import Path
folder, at, seen = Path(sys.argv[1]).resolve(), int(sys.argv[2]), 0
def note(event, arguments):
    global seen
    if event not in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate"):
        return
    path = arguments[0]
    if not isinstance(path, (str, os.PathLike)) or not str(path).startswith(str(folder)):
        return
    if event == "open" and not (arguments[1] and set("wax+") & set(arguments[1])):
        return
    seen += 1
    if seen == at:
        os._exit(137)
sys.addaudithook(note)
if not at:
    atexit.register(lambda: print("operations", seen))
"""


def environment():
    variables = {"NUMBA_NUM_THREADS": "1", "PYTHONHASHSEED": "0", "COLUMNS": "130"}
    return {**os.environ, **variables}


def started(program, folder, at=0):
    command = [sys.executable, "-W", "ignore", "-c", HOOK + program, str(folder), str(at)]
    return subprocess.Popen(
        command, cwd=ROOT, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def content(program, folder):
    """What a run leaves that does not depend on the clock."""
    if program is BENCHMARK:
        data = json.loads((folder / "results.json").read_text())
        traces = {path.name: path.stat().st_size for path in sorted((folder / "traces").iterdir())}
        return data["runs"], traces, (folder / "table.md").read_text()
    rows = [line.split(",") for line in (folder / "progress.csv").read_text().splitlines()]
    clock = rows[0].index("seconds")
    last = max(path for path in (folder / "checkpoints").iterdir() if path.name.isdecimal())
    kept = [(last / name).read_bytes() for name in ("learner.safetensors", "worlds.safetensors", "random.json")]
    return [row[:clock] + row[clock + 1 :] for row in rows], kept, [path.name for path in sorted(folder.iterdir())]


def stopped(program, folder, wanted, start):
    """Stop a program as ``start`` does and run it again: 1 where something was lost, can't go on, or differs."""
    process = start(folder)
    process.communicate(timeout=300)
    before = len(json.loads((folder / "results.json").read_text())["runs"]) if (folder / "results.json").exists() else 0
    again = started(program, folder)
    told = again.communicate(timeout=300)[0]
    if again.returncode:
        print(f"could not go on: {told[-2000:]}", file=sys.stderr)
        return 0, 1, 0
    now = content(program, folder)
    return int(len(now[0]) < before), 0, int(now != wanted)


def campaign(share=1.0, seed=13):
    """Rows of a table: program, where it was stopped, how often, lost, could not go on, differs."""
    rng, rows = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as made:
        for name, program, points, kills in (("benchmark", BENCHMARK, 20, 8), ("train", TRAINING, 14, 6)):
            whole = Path(made) / f"{name} whole"
            process = started(program, whole)
            told = process.communicate(timeout=600)[0]
            assert process.returncode == 0, told
            wanted, operations = content(program, whole), int(told.split("operations ")[1].split()[0])
            places = np.unique(np.linspace(1, operations, max(int(points * share), 2)).astype(int))
            found = [
                stopped(program, Path(made) / f"{name} {k}", wanted, lambda f, p=program, k=k: started(p, f, int(k)))
                for k in places
            ]
            rows.append((name, "a file operation", len(found), *map(sum, zip(*found, strict=True))))

            def killed(folder, program=program):
                process = started(program, folder)
                try:
                    process.wait(timeout=float(rng.uniform(0.5, 8.0)))
                except subprocess.TimeoutExpired:
                    process.kill()
                return process

            found = [
                stopped(program, Path(made) / f"{name} kill {k}", wanted, killed)
                for k in range(max(int(kills * share), 1))
            ]
            rows.append((name, "SIGKILL", len(found), *map(sum, zip(*found, strict=True))))
            for *where, times, lost, stuck, differs in rows[-2:]:
                print(*where, f"{times} times: {lost} lost, {stuck} can't go on, {differs} differ", flush=True)
    return rows
