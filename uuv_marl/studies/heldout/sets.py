"""What is held out: worlds, swarm sizes, losses, echoes and decision periods that no training has seen."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from uuv_marl.benchmark.runner import DEFAULT_POLICIES
from uuv_marl.studies.suite import NOTHING, Case

_BEST = ("bio_inspired_plus", "mappo")
_FEW = ("bio_inspired", *_BEST)
_OTHERS = (*(name for name in DEFAULT_POLICIES if name not in _BEST), "ppo")


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


def _sized(scenario: str, n: int, seeds: int, across: int = 0) -> HeldOut:
    overrides: dict[str, object] = {"swarm.num_vehicles": n}
    return HeldOut(f"{scenario}_n{n}", scenario, seeds, overrides=overrides, note=f"{n} vehicles", across=across)


def _period(period_s: float) -> HeldOut:
    overrides: dict[str, object] = {"timing.decision_period_s": period_s}
    note = f"a decision every {period_s:g} s"
    return HeldOut(f"random_field_every_{period_s:g}_s", "random_field", 100, overrides=overrides, note=note)


_SURFACE: dict[str, object] = {"sonar.echo_reports": "surface"}

SETS = (
    HeldOut("tracking", "tracking", 100, _BEST, _OTHERS, 20),
    HeldOut("single_obstacle", "single_obstacle", 100, _BEST, _OTHERS, 20, across=10),
    HeldOut("multi_obstacle", "multi_obstacle", 100, _BEST, _OTHERS, 20),
    HeldOut("lossy", "lossy", 100, _BEST, _OTHERS, 20),
    HeldOut("random_field", "random_field", 500, _BEST, _OTHERS, 100, across=20),
    _sized("random_field", 10, 500, across=40),
    _sized("random_field", 100, 100),
    _sized("random_field", 200, 40),
    _sized("single_obstacle", 10, 100),
    _sized("single_obstacle", 100, 40),
    _sized("single_obstacle", 200, 20),
    HeldOut("single_obstacle_surface", "single_obstacle", 50, overrides=_SURFACE, note="echoes report the surface"),
    HeldOut("random_field_surface", "random_field", 100, overrides=_SURFACE, note="echoes report the surface"),
    _period(0.2),
    _period(0.5),
)
"""In the order of the page."""
