"""``TrainingEnv``: swarms of several sizes, stepped as one flat array of vehicles; worlds that end start anew."""

import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.core import refuse_losses
from uuv_marl.train.acting import ACTING
from uuv_marl.train.critic import PRIVILEGED_SIZE
from uuv_marl.train.group import Group, Seeds
from uuv_marl.train.training import Training
from uuv_marl.types import Bool, Float32

TRAINING_SEEDS = (100_000, 900_000)
"""Worlds are drawn from these; 900,000-999,999 are for validation."""


class Transition(NamedTuple):
    """What came of one output of the actor, a row for every vehicle."""

    reward: Float32
    terminated: Bool
    """The task is done: the swarm arrived, say."""
    truncated: Bool
    """The episode was cut off."""
    final_obs: Float32
    """What the critic would have seen next, for the truncated rows, in their order."""


class EpisodeStats(NamedTuple):
    """Sums over episodes that ended."""

    number: float
    arrived: float
    """How many were a success: in ``follow`` the swarm arrived, in other tasks all vehicles are there untouched."""
    collisions: float
    returns: float
    """Return of each episode, the mean over vehicles."""
    decisions: float


class TrainingEnv:
    """Vehicles of many worlds as rows; ``observation`` (row, ``size``) is what the critic sees of each now.

    The first ``features`` entries are the actor's. Rows run over swarms, their worlds, and vehicles. An episode ends as
    everywhere (``Swarm.ended``), but waits no longer than ``PATIENCE_S`` for stragglers.

    Args:
        training: says what is trained on.
        seeds: asked for seeds whenever worlds start; a snapshot and what it draws from determine all that follows.

    Raises:
        ScenarioError: vehicles can be lost in this scenario: their rows would be learned from.
    """

    def __init__(self, training: Training, seeds: Seeds) -> None:
        refuse_losses(training.loaded, "training")
        self._seeds = seeds
        sizes, turns = list(training.sizes), len(training.conditions)
        if turns:
            sizes = [(n, 1) for n, worlds in sizes for _ in range(worlds)]
        self.features, self.outputs = ACTING[training.sees].num_features(training.loaded), training.outputs
        self.size = self.features + PRIVILEGED_SIZE
        ends = np.cumsum([0, *(n * worlds for n, worlds in sizes)]).tolist()
        self.rows: int = ends[-1]
        self.observation = np.zeros((self.rows, self.size), np.float32)
        num_vehicles = [n for n, worlds in sizes for _ in range(worlds)]
        self.world = np.repeat(np.arange(len(num_vehicles)), num_vehicles)
        """Index of each row's world."""
        self._rows = [slice(first, end) for first, end in itertools.pairwise(ends)]
        self._groups = [
            Group(training, n, worlds, k * turns // len(sizes), self.observation[self._rows[k]])
            for k, (n, worlds) in enumerate(sizes)
        ]
        self._ended = np.zeros(len(EpisodeStats._fields))
        self.reset()

    def reset(self) -> None:
        """Start all worlds."""
        for group in self._groups:
            group.start(self._seeds, np.ones(group.num_worlds, np.bool_))

    def step(self, action: Float32) -> Transition:
        """Act on the actor's output, shape (row, ``outputs``), as ``acting`` takes it."""
        reward, ended = np.empty(self.rows, np.float32), np.empty((2, self.rows), np.bool_)
        final = [np.empty((0, self.size), np.float32)]
        outcomes = map(Group.step, self._groups, [action[rows] for rows in self._rows])
        for group, rows, (paid, *ends) in zip(self._groups, self._rows, outcomes, strict=True):
            reward[rows], ended[:, rows] = paid.reshape(-1), np.repeat(ends, group.num_vehicles, axis=1)
            over = ends[0] | ends[1]
            if over.any():
                final.append(self.observation[rows][ended[1, rows]])
                self._ended += group.totals(over)
                group.start(self._seeds, over)
        return Transition(reward, ended[0], ended[1], np.concatenate(final))

    def pop_episode_stats(self) -> EpisodeStats:
        """Sums over the episodes that ended since the last call."""
        taken, self._ended = EpisodeStats(*self._ended.tolist()), np.zeros_like(self._ended)
        return taken

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All but the generator, for ``restore``."""
        groups = enumerate(group.snapshot() for group in self._groups)
        kept = {f"{k}.{name}": array for k, group in groups for name, array in group.items()}
        return kept | {"episodes": self._ended.copy()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot of an environment for the same training."""
        for k, group in enumerate(self._groups):
            mine = {name.removeprefix(f"{k}."): array for name, array in snapshot.items() if name.startswith(f"{k}.")}
            group.restore(mine)
        self._ended[...] = snapshot["episodes"]
