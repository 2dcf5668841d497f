"""``TrainingEnv``: swarms of several sizes, stepped as one flat array of vehicles; worlds that end start anew."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.batched_env import refuse_losses
from uuv_marl.envs.reward import RewardFunction, own_reward
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.sim.arrays import Bool, Float32
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.acting import ACTING, Sees
from uuv_marl.train.shaping import PRIVILEGED_SIZE, privileged_observation

Arrays = Mapping[str, NDArray[Any]]
Seeds = Callable[[int], Sequence[int] | NDArray[np.integer] | None]
"""Seeds for so many worlds that start, or None for each to go on with its own stream."""

TRAINING_SEEDS = (100_000, 900_000)
"""Worlds are drawn from these; 900,000-999,999 are for validation."""
PATIENCE_S = 40.0
"""An episode is cut off so long after l(t) came to rest: waiting for stragglers teaches little."""


class Problem(NamedTuple):
    """What is trained on."""

    scenario: Scenario
    sizes: Sequence[tuple[int, int]]
    """Number of vehicles and of worlds of each swarm."""
    reward: RewardFunction
    """What vehicles are paid for a decision, from the swarm after it."""
    sees: Sees = "percept"
    """What the actor sees."""
    change_cost: float = 0.0
    """Paid for each 0.5 s in which the safety filter changed a vehicle's action."""


class Transition(NamedTuple):
    """One decision of every vehicle, a row each."""

    reward: Float32
    terminated: Bool
    """The swarm arrived."""
    truncated: Bool
    """The episode was cut off."""
    final_obs: Float32
    """What the critic would have seen next, for the truncated rows, in their order."""


class EpisodeStats(NamedTuple):
    """Sums over episodes that ended."""

    number: float
    arrived: float
    collisions: float
    returns: float
    """Of the mean over vehicles."""
    decisions: float


class TrainingEnv:
    """Vehicles of many worlds as rows; ``observation`` (row, ``size``) is what the critic sees of each now.

    The first ``features`` entries are the actor's. Rows run over swarms, their worlds, and vehicles. An episode ends as
    everywhere (``Swarm.ended``), but waits no longer than ``PATIENCE_S`` for stragglers.

    Args:
        problem: what is trained on.
        seeds: asked for seeds whenever worlds start; a snapshot and what it draws from determine all that follows.

    Raises:
        ScenarioError: vehicles can be lost in this scenario: their rows would be learned from.
    """

    def __init__(self, problem: Problem, seeds: Seeds) -> None:
        scenario, sizes, self._reward, sees, self._change_cost = problem
        refuse_losses(scenario, "training")
        self._seeds = seeds
        patience = min(scenario.time_limit.extra_s, PATIENCE_S)
        scenario = load_scenario(scenario, overrides={"time_limit.factor": 1.0, "time_limit.extra_s": patience})
        self._swarms = [Swarm(load_scenario(scenario, num_vehicles=n), worlds) for n, worlds in sizes]
        self._acting = [ACTING[sees](swarm.scenario, swarm.num_worlds) for swarm in self._swarms]
        self.features = self._acting[0].size
        self.size = self.features + PRIVILEGED_SIZE
        self._ends = np.cumsum([n * worlds for n, worlds in sizes])
        self.rows = int(self._ends[-1])
        self.observation = np.zeros((self.rows, self.size), np.float32)
        self._sums = [np.zeros((worlds, 3)) for _, worlds in sizes]
        self._ended = np.zeros(len(EpisodeStats._fields))
        self.reset()

    def reset(self) -> None:
        """Start all worlds."""
        for k, swarm in enumerate(self._swarms):
            self._restart(k, list(range(swarm.num_worlds)))
            self._look(k)
            self._sums[k][...] = 0.0

    def step(self, action: Float32) -> Transition:
        """One decision; ``action`` (row, 2) is the actor's output, as ``Acting`` takes it."""
        reward, ended = np.empty(self.rows, np.float32), np.empty((2, self.rows), np.bool_)
        final = [np.empty((0, self.size), np.float32)]
        for k, swarm in enumerate(self._swarms):
            rows, shape = self._rows(k), (swarm.num_worlds, swarm.num_vehicles)
            swarm.step(self._acting[k].actions(action[rows].reshape(*shape, 2)))
            paid, ends = own_reward(self._reward, swarm, np.ones(shape, np.bool_)), np.array(swarm.endings())
            if self._change_cost:
                share = swarm.scenario.timing.decision_period_s / 0.5
                paid = paid - share * self._change_cost * self._acting[k].changed
            reward[rows], ended[:, rows] = paid.reshape(-1), ends.repeat(shape[1], axis=1)
            self._sums[k] += np.stack([paid.mean(axis=1), swarm.facts.collisions, np.ones(shape[0])], axis=1)
            self._look(k)
            over = ends.any(axis=0)
            if over.any():
                final.append(self.observation[rows][ended[1, rows]])
                returns, collisions, decisions = self._sums[k][over].sum(axis=0)
                self._ended += [over.sum(), (over & swarm.arrived).sum(), collisions, returns, decisions]
                self._sums[k][over] = 0.0
                self._restart(k, np.flatnonzero(over).tolist())
                self._look(k)
        return Transition(reward, ended[0], ended[1], np.concatenate(final))

    def pop_episode_stats(self) -> EpisodeStats:
        """Sums over the episodes that ended since the last call."""
        taken, self._ended = EpisodeStats(*self._ended.tolist()), np.zeros_like(self._ended)
        return taken

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All but the generator, for ``restore``."""
        kept: dict[str, NDArray[Any]] = {"episodes": self._ended.copy()}
        for k, (swarm, sums) in enumerate(zip(self._swarms, self._sums, strict=True)):
            kept |= {f"{k}.{name}": array for name, array in swarm.snapshot().items()}
            kept[f"{k}.sums"] = sums.copy()
            kept |= {f"{k}.acting.{name}": array for name, array in self._acting[k].snapshot().items()}
        return kept

    def restore(self, snapshot: Arrays) -> None:
        """Go on from a snapshot of an environment of the same sizes."""
        for k, swarm in enumerate(self._swarms):
            mine = {name.removeprefix(f"{k}."): array for name, array in snapshot.items() if name.startswith(f"{k}.")}
            swarm.restore(mine)
            self._acting[k].restore({name.removeprefix("acting."): mine[name] for name in mine if "acting." in name})
            self._sums[k][...] = mine["sums"]
            self._look(k)
        self._ended[...] = snapshot["episodes"]

    def _rows(self, k: int) -> slice:
        return slice(int(self._ends[k - 1]) if k else 0, int(self._ends[k]))

    def _look(self, k: int) -> None:
        swarm, rows = self._swarms[k], self._rows(k)
        observation = self.observation[rows].reshape(swarm.num_worlds, swarm.num_vehicles, self.size)
        self._acting[k].look(swarm.percept, observation[:, :, : self.features])
        privileged_observation(swarm, observation[:, :, self.features :])

    def _restart(self, k: int, worlds: Sequence[int]) -> None:
        self._swarms[k].reset(self._seeds(len(worlds)), worlds)
