"""What the paper leaves open, as ``assumptions.toml`` lists it."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, NamedTuple

from uuv_marl.reproduce.study import MULTI, SINGLE, TRACKING, Case, folder_name

ALL = "5.1 both, 5.2.1, 5.2.2 both, Table 2"
"""The six numbers of the paper's own controller."""
SEARCHED = "5.1 both, 5.2.1, Table 2"
"""Those that the identification looked at."""


class Alternative(NamedTuple):
    """Another reading of one assumption."""

    label: str
    overrides: Mapping[str, object] = {}
    parameters: Mapping[str, object] = {}
    scenarios: tuple[str, ...] = (TRACKING.scenario, SINGLE.scenario, MULTI.scenario)
    """Where it applies."""


class Assumption(NamedTuple):
    """One thing the paper does not say."""

    name: str
    taken: str
    in_view: str
    """Numbers of the paper that were known and looked at when it was chosen."""
    alternatives: tuple[Alternative, ...]


def case_of(assumption: str, alternative: Alternative, scenario: str) -> Case:
    """A scenario under one alternative."""
    name = folder_name(f"{assumption} {alternative.label} {scenario}")
    return Case(name, scenario, overrides=alternative.overrides, parameters=alternative.parameters)


def _read() -> tuple[Assumption, ...]:
    text = resources.files("uuv_marl.reproduce").joinpath("assumptions.toml").read_text(encoding="utf-8")
    tables: list[dict[str, Any]] = tomllib.loads(text)["assumption"]
    return tuple(
        Assumption(one["name"], one["taken"], one["in_view"], tuple(Alternative(**o) for o in one["alternatives"]))
        for one in tables
    )


ASSUMPTIONS = _read()
