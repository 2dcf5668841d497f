"""What MAPPO and Stable-Baselines3's PPO share here: numbers, annealing, and an optimiser's state as arrays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import pydantic
from numpy.typing import NDArray

from uuv_marl.extras import extra

Count = Annotated[int, pydantic.Field(ge=1)]
Share = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]
"""Bounds that a recipe's numbers are checked against."""

with extra("train", "training"):
    import torch
    from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class PPOHyperparameters:
    """Numbers that every PPO has, for a network that all vehicles share."""

    hidden: tuple[Count, ...] = (96, 96)
    """Units of the actor's and of the critic's layers, tanh."""
    gamma: Share = 0.98
    """Discount per decision; with 0.5 s a horizon of 25 s, about the time that passing an obstacle takes."""
    gae_lambda: Share = 0.95
    horizon: Count = 48
    """Decisions between updates."""
    minibatch: Count = 2048
    """Rows of a gradient step, at most."""
    clip: float = 0.2
    """Clip range of PPO's ratio [1]."""
    kl_stop: float = 0.02
    """The actor's epochs end where a minibatch diverges further from the policy that sampled it."""
    learning_rate: tuple[float, float] = (1.5e-3, 1.5e-4)
    """The actor's, at the start and at the end. Where noise is small, so is the share of a return that it caused, and
    steps must be small too."""

    def __post_init__(self) -> None:
        for name in ("learning_rate", "noise"):
            value = getattr(self, name, 1.0)
            if not all(0.0 < number < math.inf for number in np.atleast_1d(value)):
                raise ValueError(f"{name} must be positive and finite, got {value}")


class Update(NamedTuple):
    """How an update went."""

    kl: float
    explained: float


def adam_arrays(optimiser: torch.optim.Optimizer, name: str) -> dict[str, NDArray[Any]]:
    """Moments and counters of an optimiser, as ``name.parameter.key``."""
    states = optimiser.state_dict()["state"].items()
    return {f"{name}.{k}.{key}": value.cpu().numpy().copy() for k, state in states for key, value in state.items()}


def restore_adam(optimiser: torch.optim.Optimizer, name: str, tensors: Mapping[str, Tensor]) -> None:
    """Go on with what ``adam_arrays`` gave."""
    state: dict[int, dict[str, Tensor]] = {}
    for path in (path for path in tensors if path.startswith(f"{name}.")):
        _, k, key = path.split(".")
        state.setdefault(int(k), {})[key] = tensors[path]
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})


def annealed(ends: tuple[float, float], share: float) -> float:
    """A number that goes from the first to the second in equal ratios, as ``share`` goes from 0 to 1."""
    return ends[0] * (ends[1] / ends[0]) ** min(share, 1.0)
