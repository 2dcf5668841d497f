"""What is held out: seeds, worlds, swarm sizes, losses, echoes and decision periods that nothing was made with."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from uuv_marl.benchmark.suite import NOTHING, Case

_TOLD: dict[str, Any] = read_toml("heldout", "sets.toml")
FIRST: int = _TOLD["first"]
"""The first held-out seed. Benchmarks count from 0, and tuning and training use seeds from 10,000 on."""
GROUPS: dict[str, list[str]] = _TOLD["groups"]
"""Policies by the name of their group."""
LEADING: tuple[str, ...] = tuple(_TOLD["shown"])
"""The strongest policies, which the targets are for."""


class HeldOut(NamedTuple):
    """Episodes of one kind."""

    name: str
    scenario: str
    seeds: Mapping[str, int]
    """How many of each group of ``GROUPS``, from ``FIRST`` on."""
    overrides: Mapping[str, object] = NOTHING
    note: str = ""
    """What is different from the scenario as it is."""
    across: int = 0
    """On so many seeds the policies of all training seeds are compared; 0 where they are not."""
    aimed: bool = True
    """Whether the targets concern it."""

    def cases(self, trained: Iterable[str], most: int | None) -> list[Case]:
        """All that is run, with the policies of trainings; at most so many seeds of each."""
        counts = {policy: count for group, count in self.seeds.items() for policy in GROUPS[group]}
        counts |= dict.fromkeys(trained if self.across else (), self.across)
        return [
            Case(
                self.name, self.scenario, policy, self.overrides, shared=True,
                seeds=range(FIRST, FIRST + (count if most is None else min(count, most))),
            )
            for policy, count in counts.items()
        ]  # fmt: skip


SETS = tuple(HeldOut(**table) for table in _TOLD["set"])
"""Those of ``sets.toml``, in the order of the page."""
