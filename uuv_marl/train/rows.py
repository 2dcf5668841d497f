"""``Rows``: swarms of several sizes as one flat array of vehicles, with automatic resets."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.actor import bound, in_disc
from uuv_marl.baselines.learned.checkpoint import Card
from uuv_marl.baselines.making import compose, make_policy, make_team
from uuv_marl.baselines.policy import Policy, part_of, parts_of
from uuv_marl.baselines.team import Team, field_entries, narrowed
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.observation import observation_layout
from uuv_marl.train.critic import PRIVILEGED_SIZE, privileged
from uuv_marl.train.training import LEARNER, Part, Training
from uuv_marl.types import Bool, Float32

TRAINING_SEEDS = (100_000, 900_000)
"""Range of the seeds of training; 900,000-999,999 are for validation."""

Seeds = Callable[[int], Sequence[int] | NDArray[np.integer]]
"""Gives the requested number of seeds for worlds that start."""


class Transition(NamedTuple):
    """Result of one step, a row for every vehicle."""

    reward: Float32
    terminated: Bool
    """Whether the task has ended, or the vehicle was lost."""
    truncated: Bool
    """Whether the episode was cut off."""
    acted: Bool
    """Whether the vehicle acted by the learner: it was not lost before, and runs no policy of ``Training.others``."""
    final: Float32
    """Final inputs of the critic in the truncated rows, shape (truncated row, entry)."""


class ExternalActionPolicy(Policy):
    """A policy whose actions are set from outside, in place of the network."""

    def __init__(self, scenario: Scenario, num_worlds: int, card: Card) -> None:
        self.requirements = card.requirements
        super().__init__(scenario, num_worlds)
        self.action = np.zeros((num_worlds, scenario.swarm.num_vehicles, scenario.action_size), np.float32)

    def decide(self, percept: Percept) -> Float32:  # noqa: ARG002
        """Actions of shape (world, vehicle, ``scenario.action_size``)."""
        return self.action.copy()


class Group:
    """Worlds of one scenario and swarm size, with the base controller, filter, expert and others of the training."""

    def __init__(self, training: Training, part: Part) -> None:
        scenario, card = part.scenario, training.card
        reward = training.reward_for(scenario)
        swarm_scenario = training.swarm_scenario(part)
        self.env = BatchedEnv(swarm_scenario, part.worlds, reward, observe="closeness", keep_terms=False)
        own = observation_layout(scenario, "closeness")
        self._columns = field_entries(self.env.layout, own) if training.others else slice(None)
        self._network_action = ExternalActionPolicy(scenario, part.worlds, card)
        self._acting = compose(self._network_action, card)
        if training.others:
            self._acting = make_team(training.team(LEARNER), swarm_scenario, part.worlds, {LEARNER: self._acting})
        self._shape, self._state = (part.worlds, part.vehicles), training.critic == "pooled"
        self.collision_cost = 0.0
        """Cost of a collision beyond the reward."""
        self._expert = make_policy(training.expert, scenario, part.worlds) if training.expert else None
        self.expert_share = 1.0
        """Share of the worlds that start in which the expert acts."""
        self._expert_acts = np.ones(part.worlds, np.bool_)

    def seen(self, observation: Float32) -> Float32:
        """Inputs of the critic (row, entry), from observations (world, vehicle, entry)."""
        observation = observation[:, :, self._columns]
        parts = [observation, privileged(self.env.swarm)] if self._state else [observation]
        return np.concatenate(parts, axis=2).reshape(self._shape[0] * self._shape[1], -1)

    def start(self, seeds: Sequence[int], worlds: Sequence[int]) -> Float32:
        """Start these worlds; observations of all worlds (world, vehicle, entry)."""
        if self._expert is not None:
            self._expert.reset(seeds, worlds)
        # Chosen by the seeds, so that no random number is drawn.
        self._expert_acts[worlds] = [seed % 100 < 100.0 * self.expert_share for seed in seeds]
        return self.env.reset(seeds, worlds)

    def query_expert(self, action: Float32) -> tuple[Float32, Float32]:
        """The expert's actions, and those to execute, in its own worlds the expert's; shape (row, entry).

        While it acts in some worlds, all messages are the expert's, since its actions depend on those that it receives.
        """
        expert = cast(Policy, self._expert)
        expert_action = expert.act(narrowed(self.env.swarm.percept, expert.layout)).reshape(action.shape).copy()
        executed = np.where(np.repeat(self._expert_acts, self._shape[1])[:, None], expert_action, action)
        if self.expert_share > 0.0:
            executed[:, 2:] = expert_action[:, 2:]
        return expert_action, executed

    def step(self, action: Float32, seeds: Seeds) -> tuple[Transition, Float32]:
        """The transition of the group's rows, and the critic's inputs."""
        env, n = self.env, self._shape[1]
        acted = env.swarm.state.alive.copy()
        if isinstance(self._acting, Team):
            acted &= self._acting.running(LEARNER, env.swarm.percept.clock)
        action = action.copy()
        bound(action, in_disc(self._network_action))
        action = action.reshape(*self._shape, -1)
        if self._acting is not self._network_action:
            self._network_action.action[...] = action
            action = self._acting.act(env.swarm.percept)
        if self._expert is not None:
            self._expert.record_action(action)
        result = env.step(action)
        reward = (result.reward - self.collision_cost * env.swarm.facts.vehicle_collisions).reshape(-1)
        done, cut = np.repeat(result.world_terminated, n), np.repeat(result.world_truncated, n)
        done |= env.swarm.facts.lost.reshape(-1)
        cut &= ~done
        observation, over = result.observation, np.flatnonzero(result.over)
        final = self.seen(observation)[cut] if cut.any() else np.zeros((0, len(self.seen(observation)[0])), np.float32)
        if len(over):
            observation = self.start([int(seed) for seed in seeds(len(over))], over.tolist())
        return Transition(reward.astype(np.float32), done, cut, acted.reshape(-1), final), self.seen(observation)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """The state for ``restore``, without observations."""
        expert_state = {"expert_acts": self._expert_acts.copy()} | parts_of(expert=self._expert) if self._expert else {}
        return self.env.swarm.snapshot() | parts_of(acting=self._acting) | expert_state

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Restore a snapshot of a group of the same size."""
        self.env.reset(0)
        self.env.swarm.restore(snapshot)
        self._acting.restore(part_of(snapshot, "acting"))
        if self._expert is not None:
            self._expert.restore(part_of(snapshot, "expert"))
            self._expert_acts[...] = snapshot["expert_acts"]


class Rows:
    """Vehicles of many worlds as rows; ``observation`` (row, ``size``) holds the critic's inputs.

    The first ``features`` entries are the actor's. Rows are ordered by scenario, size, world and vehicle.

    Args:
        training: gives scenarios, sizes and reward.
        seeds: called whenever worlds start; a snapshot and its generator determine all that follows.
    """

    def __init__(self, training: Training, seeds: Seeds) -> None:
        self._seeds = seeds
        self.groups = [Group(training, part) for part in training.parts]
        ends = np.cumsum([0, *(part.vehicles * part.worlds for part in training.parts)]).tolist()
        self._rows = [slice(first, end) for first, end in itertools.pairwise(ends)]
        self.part = np.repeat(np.arange(len(self._rows)), np.diff(ends))
        """Index of the part of the training to which each row belongs, shape (row,)."""
        self.rows: int = ends[-1]
        self.features = sum(size for _, size in training.card.sizes)
        self.size = self.features + PRIVILEGED_SIZE * (training.critic == "pooled")
        self.observation = np.zeros((self.rows, self.size), np.float32)
        for group, rows in zip(self.groups, self._rows, strict=True):
            worlds = [*range(group.env.swarm.num_worlds)]
            started = group.start([int(seed) for seed in seeds(len(worlds))], worlds)
            self.observation[rows] = group.seen(started)

    @property
    def sends(self) -> Bool:
        """Vehicles that send the messages of their next actions, shape (row,)."""
        return np.concatenate([group.env.swarm.sends.reshape(-1) for group in self.groups])

    def schedule(self, collision_cost: float, expert_share: float) -> None:
        """Set the cost of a collision beyond the reward, and the share of starting worlds in which the expert acts."""
        for group in self.groups:
            group.collision_cost, group.expert_share = collision_cost, expert_share

    def query_expert(self, action: Float32) -> tuple[Float32, Float32]:
        """The expert's actions, and the actions to execute where the network's are ``action``; all (row, entry)."""
        pairs = [group.query_expert(action[rows]) for group, rows in zip(self.groups, self._rows, strict=True)]
        expert_actions, executed = zip(*pairs, strict=True)
        return np.concatenate(expert_actions), np.concatenate(executed)

    def step(self, action: Float32) -> Transition:
        """Step all worlds with actions (row, entry)."""
        transitions: list[Transition] = []
        for group, rows in zip(self.groups, self._rows, strict=True):
            transition, self.observation[rows] = group.step(action[rows], self._seeds)
            transitions.append(transition)
        return Transition(*map(np.concatenate, zip(*transitions, strict=True)))

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """The state for ``restore``, without the random generator."""
        groups = enumerate(group.snapshot() for group in self.groups)
        arrays = {f"{k}.{name}": array for k, group in groups for name, array in group.items()}
        return arrays | {"observation": self.observation.copy()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Restore a snapshot of the same training."""
        for k, group in enumerate(self.groups):
            group.restore(part_of(snapshot, str(k)))
        self.observation[...] = snapshot["observation"]
