"""What the peers that are written in JAX share: a loop over the steps of all worlds, compiled as one."""

import os
from collections.abc import Callable
from typing import Any

import jax
from worker import MEMORY_SHARE, Case

Pytree = Any


def looped(one: Callable[[Any, Pytree], Pytree], start: Pytree, amount: float, **facts: object) -> Case:
    """A case whose unit is a call of ``one``, from the unit's number and what the call before made, at first ``start``.

    The latest of all that it makes leaves the loop, so that nothing is optimised away.
    """
    loop = jax.jit(lambda units, carry: jax.lax.fori_loop(0, units, one, carry)).lower(1, start).compile()
    memory = loop.memory_analysis()
    needed = memory.temp_size_in_bytes + 2 * memory.output_size_in_bytes
    if needed > MEMORY_SHARE * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
        raise MemoryError(f"would need {needed / 2**30:.0f} GiB, by XLA's count")
    latest = [start]

    def run(units: int) -> None:
        latest[0] = jax.block_until_ready(loop(units, latest[0]))

    return Case(run, amount, facts)
