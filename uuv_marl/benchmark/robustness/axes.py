"""The axes: disturbances with the severity and the changed fields at each level, read from ``axes.toml``."""

import math
import tomllib
from collections.abc import Sequence
from importlib import resources
from typing import Any, NamedTuple

from uuv_marl.baselines.making import policy_requirements
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.tasks import Follow

GROUPS = {
    "W": "water", "S": "sonar", "N": "navigation", "C": "communication", "A": "actuators", "F": "faults",
    "X": "combined",
}  # fmt: skip
CALM = "0"
"""Name of the axis without a disturbance: level 0 of all axes."""


class Axis(NamedTuple):
    """One disturbance; all sequences have an entry for level 0 and for each of ``levels``."""

    name: str
    title: str
    group: str
    unit: str
    source: str
    levels: tuple[int, ...]
    severity: tuple[float, ...]
    """Severity of each level in the unit; inf or NaN where it is not a number."""
    labels: tuple[str, ...]
    channels: frozenset[str]
    """Channels of which a policy must use one to be run; empty for all policies."""
    changes: tuple[dict[str, Any], ...]
    """Fields of the scenario at each of ``levels``."""
    of_speed: frozenset[str]
    """Fields given as shares of the speed of l(t)."""

    def overrides(self, level: int, speed_mps: float) -> dict[str, object]:
        """Changed fields of a scenario at one of ``levels``, for this speed of l(t) [m/s]."""
        changes = self.changes[self.levels.index(level)]
        return {f: speed_mps * v if f in self.of_speed else v for f, v in changes.items()}

    def concerns(self, policy: str, scenario: Scenario) -> bool:
        """Whether the policy uses the disturbed channels, and the scenario's obstacles can move if they have to."""
        moves = any(field.startswith("traffic.") for field in self.changes[0])
        used = not self.channels or not self.channels.isdisjoint(policy_requirements(policy).channels)
        return used and (scenario.task_class.traffic or not moves)


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
"""Changed fields of scenarios with the task ``follow``, also at level 0; others have none."""
AXES = {name: _axis(name, data) for name, data in _DATA["axes"].items()}
"""All axes by name, in the order of the report."""


def overrides(axis: str, level: int, scenario: str) -> dict[str, object]:
    """Changed fields of a scenario in a cell of the suite."""
    loaded = load_scenario(scenario)
    base = BASE if issubclass(loaded.task_class, Follow) else {}
    return base | ({} if axis == CALM else AXES[axis].overrides(level, loaded.trajectory.speed_mps))


def known(names: Sequence[str]) -> list[str]:
    """These axes in the report's order. Raises ResultsError for an unknown name."""
    for name in names:
        if name not in AXES:
            raise ResultsError(f"there is no axis {name!r}; there are {', '.join(AXES)}")
    return [name for name in AXES if name in names]
