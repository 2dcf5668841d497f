"""Errors that a user can mend; every message names what is wrong and what to do."""

import difflib
from collections.abc import Iterable


class ScenarioError(ValueError):
    """A scenario that can't be used; the message says which field, what it is and what to do."""


class PolicyError(ValueError):
    """A policy that can't drive this scenario; the message names the remedy."""


class DivergenceError(RuntimeError):
    """The integration step is too long for the vehicle, so that its speed ran away."""


class ResultsError(RuntimeError):
    """A file or folder that can't be written, or that can't take these results."""


class ReplayError(ValueError):
    """An episode that can't be shown; the message names the remedy."""


class TrainingError(ValueError):
    """A training that can't be run; the message says which field, what it is and what to do."""


class RewardError(ValueError):
    """A reward of a user's own that can't be imported, or gives what is no reward; the message says which."""


class PictureError(ValueError):
    """Pictures can't be drawn here; the message says why, and the remedy."""


class MissingExtraError(ModuleNotFoundError):
    """A library is missing that one of the package's extras would install; the message says how."""


MENDABLE = (
    ScenarioError, PolicyError, DivergenceError, ResultsError, ReplayError, TrainingError, RewardError, PictureError,
    MissingExtraError,
)  # fmt: skip
"""All of them."""


def nearest(name: str, known: Iterable[str], cutoff: float = 0.4) -> str | None:
    """The known name that is most like an unknown one, None where none is: likeness from ``cutoff`` to 1 (difflib)."""
    return next(iter(difflib.get_close_matches(name, known, n=1, cutoff=cutoff)), None)


def hint(name: str, known: Iterable[str], cutoff: float = 0.4) -> str:
    """``did you mean 'x'? `` for ``nearest``; empty where there is none."""
    near = nearest(name, known, cutoff)
    return f"did you mean {near!r}? " if near else ""
