"""What is held out: worlds, swarm sizes, losses, echoes and decision periods that no training has seen."""

from collections.abc import Mapping
from typing import NamedTuple

from uuv_marl.benchmark.runner import DEFAULT_POLICIES
from uuv_marl.scenario import Scenario, load_scenario

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
    overrides: Mapping[str, object] = {}
    note: str = ""
    """What is different from the scenario as it is."""

    def load(self) -> Scenario:
        """The scenario of these episodes."""
        return load_scenario(self.scenario, overrides=self.overrides)


def _sized(scenario: str, n: int, seeds: int) -> HeldOut:
    return HeldOut(f"{scenario}_n{n}", scenario, seeds, overrides={"swarm.num_vehicles": n}, note=f"{n} vehicles")


def _period(period_s: float) -> HeldOut:
    overrides: dict[str, object] = {"timing.decision_period_s": period_s}
    note = f"a decision every {period_s:g} s"
    return HeldOut(f"random_field_every_{period_s:g}_s", "random_field", 100, overrides=overrides, note=note)


_SURFACE: dict[str, object] = {"sonar.echo_reports": "surface"}

SETS = (
    *(HeldOut(name, name, 100, _BEST, _OTHERS, 20) for name in ("tracking", "single_obstacle", "multi_obstacle")),
    HeldOut("lossy", "lossy", 100, _BEST, _OTHERS, 20),
    HeldOut("random_field", "random_field", 500, _BEST, _OTHERS, 100),
    *(_sized("random_field", n, seeds) for n, seeds in ((10, 500), (100, 100), (200, 40))),
    *(_sized("single_obstacle", n, seeds) for n, seeds in ((10, 100), (100, 40), (200, 20))),
    HeldOut("single_obstacle_surface", "single_obstacle", 50, overrides=_SURFACE, note="echoes report the surface"),
    HeldOut("random_field_surface", "random_field", 100, overrides=_SURFACE, note="echoes report the surface"),
    _period(0.2),
    _period(0.5),
)
"""In the order of the page."""

_ACROSS = {"single_obstacle": 10, "random_field": 20, "random_field_n10": 40}
ACROSS = tuple(held._replace(seeds=_ACROSS[held.name]) for held in SETS if held.name in _ACROSS)
"""For the policies of all training seeds: the first episodes of three sets, one per task of the comparison."""
