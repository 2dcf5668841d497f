"""Parameters that the paper does not give, from ``assumptions.toml``."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from research.data import read_toml
from research.paper.cases import SCENARIOS
from uuv_marl.benchmark.suite import NOTHING, Case

_ALL = tuple(case.scenario for case in SCENARIOS)


class Assumption(NamedTuple):
    """A parameter that the paper does not give."""

    name: str
    taken: str
    in_view: str
    """Numbers of the paper that were known when it was chosen."""
    alternatives: list[dict[str, Any]]
    """Other readings, as ``_cases`` takes them."""


def _cases(
    name: str,
    label: str,
    overrides: Mapping[str, object] = NOTHING,
    parameters: Mapping[str, object] = NOTHING,
    scenarios: Iterable[str] = _ALL,
) -> dict[str, Case]:
    """A case for each scenario to which another reading of the paper applies."""
    return {s: Case(f"{name} {label} {s}", s, overrides=overrides, parameters=parameters) for s in scenarios}


ASSUMPTIONS = tuple(Assumption(**table) for table in read_toml("paper", "assumptions.toml")["assumption"])
READINGS = {("as taken", ""): {case.scenario: case for case in SCENARIOS}} | {
    (one.name, other["label"]): _cases(one.name, **other) for one in ASSUMPTIONS for other in one.alternatives
}
"""By assumption and alternative: a case for each scenario where it applies; first our choice."""
