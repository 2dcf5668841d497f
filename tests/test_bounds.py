"""`make test-bounds` finds what it looks for: where Numba is told to, our compiled code checks its indices.

On one thread: an error on a thread that Numba starts is lost.
"""

import os
import subprocess
import sys

import pytest

BOUNDS = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_NUM_THREADS": "1"}
READ = """
import numpy as np
from numba import prange
from uuv_marl.sim.compiled import compiled, compiled_parallel


@compiled
def read(array, index):
    return array[index]


@compiled_parallel
def read_all(array, indices, out):
    for i in prange(len(indices)):
        out[i] = read(array, indices[i])


def both(array, indices):
    yield read(array, indices[0])
    yield read_all(array, indices, np.empty(len(indices)))
"""


@pytest.mark.parametrize("kind", [0, 1])
def test_an_index_out_of_bounds_is_an_error_under_the_check(tmp_path, kind):
    (tmp_path / "reads.py").write_text(
        f"{READ}\nprint(list(both(np.zeros(3), np.array([0, 1])))[0])"
        f"\nsteps = both(np.zeros(3), np.array([{'7, 0' if kind == 0 else '0, 7'}]))"
        "\nfor step in steps:\n    print('read')"
    )
    environment = {**os.environ, **BOUNDS, "UUV_MARL_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "reads.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "IndexError: index is out of bounds" in done.stderr
    assert done.stdout.splitlines() == ["0.0", *["read"] * kind]
