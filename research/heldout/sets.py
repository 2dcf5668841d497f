"""What is held out: seeds, worlds, swarm sizes, losses, echoes and decision periods that nothing was made with."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from uuv_marl.benchmark.suite import NOTHING, Case

_TOLD: dict[str, Any] = read_toml("heldout", "sets.toml")
FIRST: int = _TOLD["first"]
"""The first held-out seed. Benchmarks count from 0, and tuning and training use seeds from 10,000 on."""
GROUPS: dict[str, list[str]] = _TOLD["groups"]
"""Policies by the name of their group."""


class HeldOut(NamedTuple):
    """Episodes of one kind."""

    name: str
    scenario: str
    seeds: Mapping[str, int]
    """How many of each group of ``GROUPS``, from ``FIRST`` on."""
    overrides: Mapping[str, object] = NOTHING

    def cases(self, most: int | None) -> list[Case]:
        """All that is run, at most so many seeds of each policy."""
        counts = {policy: count for group, count in self.seeds.items() for policy in GROUPS[group]}
        return [
            Case(
                self.name, self.scenario, policy, self.overrides, shared=True,
                seeds=range(FIRST, FIRST + (count if most is None else min(count, most))),
            )
            for policy, count in counts.items()
        ]  # fmt: skip


SETS = tuple(HeldOut(**table) for table in _TOLD["set"])
"""Those of ``sets.toml``, in the order of the page."""
