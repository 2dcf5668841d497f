"""Claims of sections 5.1-5.3, each with a measure that can fail, from ``stated.toml``."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from research.data import read_toml
from research.paper import measures
from research.paper.cases import BY_NAME
from uuv_marl.benchmark.suite import NOTHING, Case, Suite
from uuv_marl.types import Bool, Float64

_TABLES = read_toml("paper", "stated.toml")


def stated(kind: str) -> list[dict[str, Any]]:
    """The tables of a kind in ``stated.toml``, each ``why`` in full."""
    return [{**table, "why": _TABLES["reasons"].get(table.get("why"), "")} for table in _TABLES[kind]]


class Claim(NamedTuple):
    """A claim of the paper, with its measure."""

    section: str
    says: str
    """The claim in our words."""
    measured: str
    """The measure, in words."""
    unit: str
    cases: Sequence[str]
    """Names of the cases of the measure."""
    metric: str = ""
    measure: str = ""
    """If not a metric: a function of ``measures`` of each trace, with ``constants`` as further arguments."""
    constants: Mapping[str, object] = NOTHING
    combined: str = ""
    """For several cases: ``ratio`` of the first to the second, or the smallest ``gain`` from each to the next."""
    least: float = -np.inf
    """The claim holds from this value ..."""
    most: float = np.inf
    """... to this."""
    why: str = ""
    """Why it does not hold."""

    def values(self, suite: Suite) -> Float64:
        """The measure, by seed."""
        values = [self._of(suite, BY_NAME[name]) for name in self.cases]
        if self.combined == "gain":
            return np.diff(values, axis=0).min(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return values[0] / values[1] if self.combined == "ratio" else values[0]

    def holds(self, values: Float64) -> Bool:
        """Whether the claim holds, by seed."""
        return (values >= self.least) & (values <= self.most)

    def _of(self, suite: Suite, case: Case) -> Float64:
        """A case's values by seed."""
        if self.metric:
            return suite.metric(case, self.metric)
        measure: Callable[..., float] = getattr(measures, self.measure)
        return np.array([measure(trace, **self.constants) for trace in suite.traces(case)])


CLAIMS = tuple(Claim(**table) for table in stated("claim"))
"""The claims in the paper's order."""
