"""The axes: each disturbance, its severity at each level, and the changed scenario. Numbers are in ``axes.toml``."""

import math
import tomllib
from collections.abc import Sequence
from importlib import resources
from typing import Any, NamedTuple

from uuv_marl.baselines.registry import policy_class
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import load_scenario

GROUPS = {
    "W": "water", "S": "sonar", "N": "navigation", "C": "communication", "A": "actuators", "F": "faults",
    "X": "combined",
}  # fmt: skip
CALM = "0"
"""Stands for an axis where nothing is wrong: level 0 of all of them."""


class Axis(NamedTuple):
    """One thing that goes wrong; all sequences run over level 0 and then ``levels``."""

    name: str
    title: str
    group: str
    unit: str
    source: str
    levels: tuple[int, ...]
    severity: tuple[float, ...]
    """Severity of each level in the unit; inf or NaN where that can't be said in a number."""
    labels: tuple[str, ...]
    channels: frozenset[str]
    """Only policies that use one of these are run; empty for all."""
    changes: tuple[dict[str, Any], ...]
    """Fields of the scenario at each of ``levels``."""
    of_speed: frozenset[str]
    """Fields that are shares of the speed of l(t)."""

    def overrides(self, level: int, speed_mps: float) -> dict[str, object]:
        """Fields of a scenario in which l(t) moves at this speed [m/s]; ``level`` is one of mine."""
        changes = self.changes[self.levels.index(level)]
        return {f: speed_mps * v if f in self.of_speed else v for f, v in changes.items()}

    def concerns(self, policy: str) -> bool:
        """Whether the policy uses what goes wrong here."""
        return not self.channels or not self.channels.isdisjoint(policy_class(policy).requirements.channels)


def _axis(name: str, data: dict[str, Any]) -> Axis:
    levels = tuple(data.get("levels", range(1, 6)))
    severity = data.get("severity") or [math.nan] * (1 + len(levels))
    fields: dict[str, list[Any]] = data["set"]
    return Axis(
        name, data["title"], data["group"], data["unit"], data["source"], levels, tuple(map(float, severity)),
        labels=tuple(data.get("labels") or (f"{value:g}" for value in severity)),
        channels=frozenset(data.get("channels", ())),
        changes=tuple(
            data.get("fixed", {}) | {field: values[k] for field, values in fields.items()} for k in range(len(levels))
        ),
        of_speed=frozenset(data.get("of_speed", ())),
    )  # fmt: skip


_DATA = tomllib.loads((resources.files("uuv_marl.benchmark.robustness") / "axes.toml").read_text(encoding="utf-8"))
BASE: dict[str, Any] = _DATA["base"]
"""Fields of every scenario of the suite, at level 0 too."""
AXES = {name: _axis(name, data) for name, data in _DATA["axes"].items()}
"""All axes by name, in the order of the report."""


def overrides(axis: str, level: int, scenario: str) -> dict[str, object]:
    """The fields of a scenario that a cell of the suite changes."""
    speed_mps = load_scenario(scenario).trajectory.speed_mps
    return BASE | ({} if axis == CALM else AXES[axis].overrides(level, speed_mps))


def known(names: Sequence[str]) -> list[str]:
    """These axes, in the report's order; raises ResultsError where there is no such axis."""
    for name in names:
        if name not in AXES:
            raise ResultsError(f"there is no axis {name!r}; there are {', '.join(AXES)}")
    return [name for name in AXES if name in names]
