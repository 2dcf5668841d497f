"""Parts of the reproduction: tables from runs, and a picture from the tables."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from matplotlib.figure import Figure

from research.columns import Columns
from research.data import read_toml
from uuv_marl.benchmark.suite import Case, Suite

Tables = Mapping[str, Columns]
Share = Callable[[float], None]
"""Called with the share of the work that is done."""
_TITLES = read_toml("paper", "parts.toml")


class Part(NamedTuple):
    """A figure of the paper, or a study beyond it."""

    name: str
    """``figure-11``; names the picture, and the option ``--only``."""
    cases: tuple[Case, ...]
    """Required cases; empty where the tables are computed without runs."""
    tables: Callable[[Suite, Share], Tables]
    """From the runs to tables by name, each saved as ``data/NAME.csv``."""
    draw: Callable[[Tables], Figure]
    """From the tables to the picture."""

    @property
    def title(self) -> str:
        """Text above the picture, see ``parts.toml``."""
        return _TITLES[self.name]
