"""Errors that a user can fix; every message names the problem and the remedy."""

import difflib
from collections.abc import Iterable


class ScenarioError(ValueError):
    """An invalid scenario; the message names the field, its value and the remedy."""


class PolicyError(ValueError):
    """A policy that can't run on this scenario."""


class DivergenceError(RuntimeError):
    """The integration step is too long for the vehicle, so that its speed diverged."""


class ResultsError(RuntimeError):
    """A file or folder that can't be written, or can't take these results."""


class ReplayError(ValueError):
    """An episode that can't be shown."""


class TrainingError(ValueError):
    """An invalid training; the message names the field, its value and the remedy."""


class RewardError(ValueError):
    """A user's reward that can't be imported, or returns an invalid value."""


class PictureError(ValueError):
    """Pictures can't be drawn."""


class MissingExtraError(ModuleNotFoundError):
    """A library of one of the package's extras is missing; the message names the command that installs it."""


USER_ERRORS = (
    ScenarioError, PolicyError, DivergenceError, ResultsError, ReplayError, TrainingError, RewardError, PictureError,
    MissingExtraError,
)  # fmt: skip
"""All of these errors."""


def nearest(name: str, known: Iterable[str], cutoff: float = 0.4) -> str | None:
    """The known name most similar to an unknown one; None below the similarity ``cutoff``, from 0 to 1 (difflib)."""
    return next(iter(difflib.get_close_matches(name, known, n=1, cutoff=cutoff)), None)


def hint(name: str, known: Iterable[str], cutoff: float = 0.4) -> str:
    """``did you mean 'x'? `` for ``nearest``; empty without one."""
    near = nearest(name, known, cutoff)
    return f"did you mean {near!r}? " if near else ""
