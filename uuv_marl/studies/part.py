"""Parts of the reproduction: tables from runs, and a picture from the tables alone."""

import tomllib
from collections.abc import Callable, Mapping
from importlib import resources
from typing import NamedTuple

from matplotlib.figure import Figure

from uuv_marl.studies.columns import Columns
from uuv_marl.studies.suite import Case, Suite

Tables = Mapping[str, Columns]
Share = Callable[[float], None]
"""Called with the share of the work that is done."""
_WORDS = tomllib.loads(resources.files("uuv_marl.studies").joinpath("parts.toml").read_text(encoding="utf-8"))


class Part(NamedTuple):
    """A figure of the paper, or a study beyond it."""

    name: str
    """``figure-11``; names the picture, and the option ``--only``."""
    cases: tuple[Case, ...]
    """What must have been run; nothing where the tables are computed by themselves, and take their time."""
    tables: Callable[[Suite, Share], Tables]
    """From the runs, by name; each becomes ``data/NAME.csv``."""
    draw: Callable[[Tables], Figure]
    """From the tables alone."""

    @property
    def title(self) -> str:
        """Stands above the picture, see ``parts.toml``."""
        return _WORDS[self.name]["title"]

    @property
    def caption(self) -> str:
        """Stands below the picture, see ``parts.toml``."""
        return _WORDS[self.name]["caption"]
