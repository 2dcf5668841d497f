"""The compile cache never serves old physics, and says so where it can't be kept."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import uuv_marl
from uuv_marl.sim.compiled import source_hash

PACKAGE = Path(uuv_marl.__file__).parent
STEP = """
import sys
import numpy as np
from uuv_marl import load_scenario
from uuv_marl.sim.swarm import Swarm
import uuv_marl
assert uuv_marl.__file__.startswith(sys.argv[1]), uuv_marl.__file__
swarm = Swarm(load_scenario("tracking", num_vehicles=2))
swarm.reset(0)
swarm.step(np.zeros((1, 2, 2), np.float32))
print(swarm.state.nu[0, 0, 0].hex())
"""


def run(folder, cache):
    environment = {**os.environ, "PYTHONPATH": str(folder), "UUV_MARL_CACHE_DIR": str(cache)}
    return subprocess.run(
        [sys.executable, "-c", STEP, str(folder)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
        cwd=folder,
    )


def test_editing_a_callee_in_another_file_changes_the_run(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "code" / "uuv_marl", ignore=shutil.ignore_patterns("__pycache__"))
    cache = tmp_path / "cache"
    cold, warm = run(tmp_path / "code", cache), run(tmp_path / "code", cache)
    first = cold.stdout
    assert warm.stdout == first
    assert "compiling takes about half a minute, once" in cold.stderr
    assert "compiling" not in warm.stderr
    callee = tmp_path / "code" / "uuv_marl" / "sim" / "vehicle.py"
    text = callee.read_text()
    assert text.count("(p.X_u + p.X_uu * abs(u)) * u") == 1
    callee.write_text(text.replace("(p.X_u + p.X_uu * abs(u)) * u", "(p.X_u + p.X_uu * abs(u)) * u * 2.0"))
    assert run(tmp_path / "code", cache).stdout != first
    assert len(list(cache.iterdir())) == 2


def test_the_cache_is_keyed_by_all_that_compiled_code_freezes(tmp_path):
    copy = tmp_path / "uuv_marl"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    hashes = {source_hash(copy)}
    for file in ("scenario.py", "percept.py", "sim/sonar.py", "baselines/sff.py", "envs/reward.py"):
        with (copy / file).open("a") as handle:
            handle.write("\n")
        hashes.add(source_hash(copy))
    assert len(hashes) == 6


def test_an_unwritable_cache_is_explained_and_the_run_goes_on(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = run(PACKAGE.parent, blocked / "cache")
    assert "UUV_MARL_CACHE_DIR" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout
