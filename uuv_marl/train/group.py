"""``Group``: worlds of one swarm size, seen and driven as the policies do that a training makes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.core import refuse_losses
from uuv_marl.envs.reward import own_reward
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.acting import ACTING
from uuv_marl.train.critic import privileged_observation
from uuv_marl.train.training import Training
from uuv_marl.types import Bool, Float32, Float64

Seeds = Callable[[int], Sequence[int] | NDArray[np.integer]]
"""Seeds for so many worlds that start."""

PATIENCE_S = 40.0
"""An episode is cut off so long after l(t) came to rest: waiting for stragglers teaches little."""


class Outcome(NamedTuple):
    """What came of one output of the actor."""

    reward: Float64
    """Shape (world, vehicle)."""
    terminated: Bool
    """Shape (world,)."""
    truncated: Bool
    """Shape (world,)."""


class Group:
    """Worlds of one swarm size. Those that end wait for ``start``.

    Args:
        training: says what is trained on.
        num_vehicles: of each world.
        num_worlds: one, where ``training`` has conditions.
        turn: index of a condition; each start goes on to the next one.
        rows: filled with what the critic sees of each vehicle, shape (world x vehicle, entry); the actor sees the first
            entries.

    Raises:
        ScenarioError: vehicles can be lost in this scenario: their rows would be learned from.
    """

    def __init__(self, training: Training, num_vehicles: int, num_worlds: int, turn: int, rows: Float32) -> None:
        self.num_vehicles, self.num_worlds = num_vehicles, num_worlds
        self._training, self._turn, self._paid = training, turn, training.paid
        self._seen = rows.reshape(num_worlds, num_vehicles, -1)
        self._sums = np.zeros((num_worlds, 3))  # returns, collisions, decisions
        self._make()

    def _make(self) -> None:
        """Worlds under the present condition."""
        training, limit = self._training, self._training.loaded.time_limit
        changes: dict[str, object] = {"time_limit.factor": 1.0, "time_limit.extra_s": min(limit.extra_s, PATIENCE_S)}
        if training.conditions:
            changes |= training.conditions[self._turn % len(training.conditions)]
        scenario = load_scenario(training.loaded, num_vehicles=self.num_vehicles, overrides=changes)
        refuse_losses(scenario, "training")
        self.swarm = Swarm(scenario, self.num_worlds)
        self.acting = ACTING[training.sees](scenario, self.num_worlds, training)
        self._held = max(1, round(training.held_s / scenario.timing.decision_period_s))

    def start(self, seeds: Seeds, worlds: Bool) -> None:
        """Start these worlds, shape (world,), under the next condition where there are any."""
        if self._training.conditions:
            self._turn += 1
            self._make()
        self.swarm.reset(seeds(int(worlds.sum())), np.flatnonzero(worlds).tolist())
        self._sums[worlds] = 0.0
        self.look()

    def look(self) -> None:
        """Fill the rows."""
        features = self.acting.size
        self.acting.look(self.swarm.percept, self._seen[:, :, :features])
        privileged_observation(self.swarm, self._seen[:, :, features:])

    def step(self, output: Float32) -> Outcome:
        """Act on an output of the actor, shape (world x vehicle, outputs), and fill the rows with what comes of it."""
        swarm = self.swarm
        output = output.reshape(self.num_worlds, self.num_vehicles, -1)
        reward = np.zeros((self.num_worlds, self.num_vehicles))
        for decision in range(self._held):
            running = ~swarm.ended
            if decision:
                self.acting.hear(swarm.percept)
            swarm.step(self.acting.actions(output), running)
            paid = own_reward(self._paid, swarm, np.broadcast_to(running[:, None], reward.shape))
            reward += paid
            self._sums += running[:, None] * np.stack([paid.mean(axis=1), swarm.facts.collisions, running], axis=1)
        self.look()
        return Outcome(reward, *swarm.endings())

    def totals(self, worlds: Bool) -> Float64:
        """Sums over the episodes of worlds that have ended, shape (world,), as ``EpisodeStats`` names them."""
        returns, collisions, decisions = self._sums[worlds].sum(axis=0)
        done = sum(self.swarm.task.success(int(w)) for w in np.flatnonzero(worlds))
        return np.array([worlds.sum(), done, collisions, returns, decisions])

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that ``restore`` needs."""
        kept = {**self.swarm.snapshot(), "sums": self._sums.copy(), "turn": np.array(self._turn)}
        return kept | {f"acting.{name}": array for name, array in self.acting.snapshot().items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot of a group of the same size."""
        self._turn = int(snapshot["turn"])
        if self._training.conditions:
            self._make()
        self.swarm.restore(snapshot)
        prefix = "acting."
        acting = {name.removeprefix(prefix): snapshot[name] for name in snapshot if name.startswith(prefix)}
        self.acting.restore(acting)
        self._sums[...] = snapshot["sums"]
        self.look()
