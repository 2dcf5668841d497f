"""``Group``: worlds of one swarm size, seen and driven as the policies do that a training makes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import ALL_TRIMS, Trim
from uuv_marl.envs.batched_env import refuse_losses
from uuv_marl.envs.reward import RewardFunction, own_reward
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.sim.arrays import Bool, Float32, Float64
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.acting import ACTING, Sees
from uuv_marl.train.shaping import privileged_observation

Conditions = Sequence[Mapping[str, object]]
"""Fields of a scenario, for one episode after the other."""
Seeds = Callable[[int], Sequence[int] | NDArray[np.integer] | None]
"""Seeds for so many worlds that start, or None for each to go on with its own stream."""

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
    held_s: float = 0.0
    """An output of the actor is held for so long, rounded to whole decisions; 0: for one decision."""
    law: ScoutGains = ScoutGains()
    """Gains of the hand-made law that an actor with memory trims."""
    safety: Barrier = Barrier()
    """Margins and rates of the safety filter around that law."""
    trims: Sequence[Trim] = ALL_TRIMS
    """What such an actor changes."""
    conditions: Conditions = ()
    """Fields of the scenario for one episode: every world goes through these, an episode each, in this order."""


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
        problem: what is trained on.
        num_vehicles: of each world.
        num_worlds: one, where ``problem`` has conditions.
        turn: index of a condition; each start goes on to the next one.
        rows: filled with what the critic sees of each vehicle, shape (world x vehicle, entry); the actor sees the first
            entries.

    Raises:
        ScenarioError: vehicles can be lost in this scenario: their rows would be learned from.
    """

    def __init__(self, problem: Problem, num_vehicles: int, num_worlds: int, turn: int, rows: Float32) -> None:
        self.num_vehicles, self.num_worlds = num_vehicles, num_worlds
        self._problem, self._turn = problem, turn
        self._seen = rows.reshape(num_worlds, num_vehicles, -1)
        self._sums = np.zeros((num_worlds, 3))  # returns, collisions, decisions
        self._make()

    def _make(self) -> None:
        """Worlds under the present condition."""
        problem, limit = self._problem, self._problem.scenario.time_limit
        changes: dict[str, object] = {"time_limit.factor": 1.0, "time_limit.extra_s": min(limit.extra_s, PATIENCE_S)}
        if problem.conditions:
            changes |= problem.conditions[self._turn % len(problem.conditions)]
        scenario = load_scenario(problem.scenario, num_vehicles=self.num_vehicles, overrides=changes)
        refuse_losses(scenario, "training")
        self.swarm = Swarm(scenario, self.num_worlds)
        self.acting = ACTING[problem.sees](scenario, self.num_worlds, problem.law, problem.safety, problem.trims)
        self._held = max(1, round(problem.held_s / scenario.timing.decision_period_s))

    def start(self, seeds: Seeds, worlds: Bool) -> None:
        """Start these worlds, shape (world,), under the next condition where there are any."""
        if self._problem.conditions:
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
        swarm, by = self.swarm, self._problem
        output = output.reshape(self.num_worlds, self.num_vehicles, -1)
        reward = np.zeros((self.num_worlds, self.num_vehicles))
        for decision in range(self._held):
            running = ~swarm.ended
            if decision:
                self.acting.hear(swarm.percept)
            swarm.step(self.acting.actions(output), running)
            paid = own_reward(by.reward, swarm, np.broadcast_to(running[:, None], reward.shape))
            if by.change_cost:
                share = swarm.scenario.timing.decision_period_s / 0.5
                paid = paid - share * by.change_cost * self.acting.changed * running[:, None]
            reward += paid
            self._sums += running[:, None] * np.stack([paid.mean(axis=1), swarm.facts.collisions, running], axis=1)
        self.look()
        return Outcome(reward, *swarm.endings())

    def totals(self, worlds: Bool) -> Float64:
        """Sums over the episodes of worlds that have ended, shape (world,), as ``EpisodeStats`` names them."""
        returns, collisions, decisions = self._sums[worlds].sum(axis=0)
        return np.array([worlds.sum(), (worlds & self.swarm.arrived).sum(), collisions, returns, decisions])

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that ``restore`` needs."""
        kept = {**self.swarm.snapshot(), "sums": self._sums.copy(), "turn": np.array(self._turn)}
        return kept | {f"acting.{name}": array for name, array in self.acting.snapshot().items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot of a group of the same size."""
        self._turn = int(snapshot["turn"])
        if self._problem.conditions:
            self._make()
        self.swarm.restore(snapshot)
        prefix = "acting."
        acting = {name.removeprefix(prefix): snapshot[name] for name in snapshot if name.startswith(prefix)}
        self.acting.restore(acting)
        self._sums[...] = snapshot["sums"]
        self.look()
