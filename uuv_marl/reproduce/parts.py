"""What a part of the reproduction is: cases to run, tables made of them, and a picture drawn from the tables alone."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from uuv_marl.reproduce.cases import Case, Report, Study
from uuv_marl.reproduce.columns import Columns

Tables = Mapping[str, Columns]


class Part(NamedTuple):
    """A figure of the paper, or a study beyond it."""

    name: str
    """``figure-11``; names the picture, and the option ``--only``."""
    title: str
    """One line."""
    cases: tuple[Case, ...]
    """What must have been run."""
    tables: Callable[[Study, Report], Tables]
    """From the runs, by name; each becomes ``data/NAME.csv``."""
    draw: Callable[[Tables], Figure]
    """From the tables alone."""
    caption: str = ""
    """Scenario, seed and parameters."""
    seeds: Sequence[int] | None = None
    """What its cases are run on; None for all of the study's."""
    seconds: float = 1.0
    """What its tables take besides the cases, roughly."""
