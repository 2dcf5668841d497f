"""Data files of this package, as TOML and as text."""

import tomllib
from importlib import resources
from typing import Any


def read_text(*path: str) -> str:
    """A file of this package by its path, such as ``read_text("heldout", "story.md")``."""
    return resources.files("research").joinpath(*path).read_text(encoding="utf-8")


def read_toml(*path: str) -> dict[str, Any]:
    """The tables of a TOML file of this package, see ``read_text``."""
    return tomllib.loads(read_text(*path))
