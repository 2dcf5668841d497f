"""What is held out: worlds, swarm sizes, losses, echoes and decision periods that no training has seen."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from uuv_marl.studies.data import read_toml
from uuv_marl.studies.suite import NOTHING, Case

_BEST = ("bio_inspired_plus", "mappo")
_FEW = ("bio_inspired", *_BEST)
_OTHERS = ("bio_inspired", "sff", "sdc", "sff_informed", "sdc_informed", "ppo")


class HeldOut(NamedTuple):
    """Episodes of one kind, on the benchmark's seeds from 0."""

    name: str
    scenario: str
    seeds: int
    policies: tuple[str, ...] = _FEW
    others: tuple[str, ...] = ()
    """Policies that are run on the first ``fewer`` seeds."""
    fewer: int = 0
    overrides: Mapping[str, object] = NOTHING
    note: str = ""
    """What is different from the scenario as it is."""
    across: int = 0
    """On so many seeds the policies of all training seeds are compared; 0 where they are not."""

    def cases(self, trained: Iterable[str], most: int | None) -> list[Case]:
        """All that is run, with the policies of trainings; at most so many seeds of each."""
        counts = dict.fromkeys(self.policies, self.seeds) | dict.fromkeys(self.others, self.fewer)
        counts |= dict.fromkeys(trained if self.across else (), self.across)
        return [
            Case(
                self.name, self.scenario, policy, self.overrides, routes=True, shared=True,
                seeds=range(count if most is None else min(count, most)),
            )
            for policy, count in counts.items()
        ]  # fmt: skip


SETS = tuple(
    HeldOut(**({"policies": _BEST, "others": _OTHERS} if "fewer" in table else {}), **table)
    for table in read_toml("heldout", "sets.toml")["set"]
)
"""Those of ``sets.toml``, in the order of the page."""
