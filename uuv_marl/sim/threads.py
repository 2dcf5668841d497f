"""Python threads that share the worlds of a batch and sleep while idle.

Compiled code releases Python's lock, so that they run in parallel. Numba's own threads are not used: they spin while
they wait, one of its threading layers aborts the process when two threads enter it, and none survives a fork.
"""

import functools
import itertools
import os
from collections.abc import Callable
from queue import SimpleQueue
from threading import Thread
from typing import Any, cast

from numba import config

Job = Callable[[], None]


def num_threads() -> int:
    """Largest number of threads: ``NUMBA_NUM_THREADS``, by default the number of the process's cores."""
    return cast(Any, config).NUMBA_NUM_THREADS


def _serve(jobs: SimpleQueue[Job]) -> None:
    while True:
        jobs.get()()


@functools.cache
def _helpers() -> SimpleQueue[Job]:
    """Queue of jobs for the helping threads, which the first call starts."""
    jobs: SimpleQueue[Job] = SimpleQueue()
    for k in range(1, max(num_threads(), 2)):
        Thread(target=_serve, args=(jobs,), name=f"uuv_marl {k}", daemon=True).start()
    return jobs


if hasattr(os, "register_at_fork"):  # a forked child has none of its parent's threads
    os.register_at_fork(after_in_child=_helpers.cache_clear)


def on_threads(work: Callable[[int, int, int], bool], amount: int, threads: int, head: int = 0) -> bool:
    """Divide ``range(amount)`` among threads, the caller's first; return whether any part of the work returned True.

    Args:
        work: function of the thread's index and of the start and end of its part.
        amount: size of the work.
        threads: number of parts, of which at most ``num_threads()`` run in parallel.
        head: extra work of the caller while the others wake.
    """
    share = max(amount - head, 0) // threads
    ends = [amount - k * share for k in reversed(range(threads))]
    parts = [(t, begin, end) for t, (begin, end) in enumerate(itertools.pairwise([0, *ends])) if begin < end]
    done: SimpleQueue[bool | BaseException] = SimpleQueue()

    def do(part: tuple[int, int, int]) -> None:
        try:
            done.put(work(*part))
        except BaseException as error:
            done.put(error)

    for part in parts[1:]:
        _helpers().put(functools.partial(do, part))
    try:
        result = work(*parts[0])
    finally:  # also after an error or Ctrl-C, since all parts write to the same arrays
        others = [done.get() for _ in parts[1:]]
    for other in others:
        if isinstance(other, BaseException):
            raise other
    return result or any(others)
