"""Threads that share the worlds of a batch: Python's own, which sleep while they have nothing to do.

Compiled code lets go of Python's lock, so that they run at once. Numba's own threads are not used: they spin while they
wait, which starves whatever else runs; in one of its layers the process ends where two threads enter it; and none of
them survives a fork.
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
    """How many may work at once: ``NUMBA_NUM_THREADS``, by default as many as the process has cores."""
    return cast(Any, config).NUMBA_NUM_THREADS


def _serve(jobs: SimpleQueue[Job]) -> None:
    while True:
        jobs.get()()


@functools.cache
def _helpers() -> SimpleQueue[Job]:
    """What helping threads, which begin with the first call, take their jobs from."""
    jobs: SimpleQueue[Job] = SimpleQueue()
    for k in range(1, max(num_threads(), 2)):
        Thread(target=_serve, args=(jobs,), name=f"uuv_marl {k}", daemon=True).start()
    return jobs


if hasattr(os, "register_at_fork"):  # a child has none of its parent's threads
    os.register_at_fork(after_in_child=_helpers.cache_clear)


def on_threads(work: Callable[[int, int, int], bool], amount: int, threads: int, head: int = 0) -> bool:
    """Divide ``range(amount)`` among threads, the caller's own the first; whether any part of the work gave True.

    Args:
        work: takes the thread's index, and the first and the end of its part.
        amount: how much there is to do.
        threads: into how many parts it is divided, at most ``num_threads()`` of which are done at once.
        head: how much the caller does while the others wake.
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
    finally:  # wait where an error or Ctrl-C ends the caller's part, too: all parts write to the same arrays
        others = [done.get() for _ in parts[1:]]
    for other in others:
        if isinstance(other, BaseException):
            raise other
    return result or any(others)
