"""`make test-bounds` finds what it looks for: where Numba is told to, our compiled code checks its indices."""

from tests.processes import ran

READ = """
import numpy as np
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.threads import on_threads


@compiled
def read(array, index):
    return array[index]


for indices in ((0, 1), (0, 7)):
    on_threads(lambda thread, begin, end: read(np.zeros(3), indices[thread]) > 0.0, 2, 2)
    print("read")
"""


def test_an_index_out_of_bounds_is_an_error_under_the_check(tmp_path):
    (tmp_path / "reads.py").write_text(READ)
    done = ran("reads.py", folder=tmp_path, NUMBA_BOUNDSCHECK="1", UUV_MARL_CACHE_DIR=str(tmp_path))
    assert done.returncode == 1
    assert "IndexError: index is out of bounds" in done.stderr, "also on a thread that helps"
    assert done.stdout.splitlines() == ["read"]
