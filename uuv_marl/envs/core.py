"""The core of every environment API: a swarm, its reward and its endings, as arrays over worlds and vehicles."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from uuv_marl.envs.changes import Changes, Reward, ScenarioLike, changed
from uuv_marl.envs.state import global_state, state_layout
from uuv_marl.scenario import Scenario, ScenarioError
from uuv_marl.sim.arguments import SeedLike, whole_number
from uuv_marl.sim.observation import Observe, observation_layout, observer
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.reward import StepReward, from_function
from uuv_marl.tasks.task import Task
from uuv_marl.types import Bool, Float32, Float64


class StepResult(NamedTuple):
    """The result of one step of every world. Arrays have shape (world, vehicle, ...), or the shape in their text."""

    observation: Float32
    reward: Float64
    """Zero for vehicles that were lost in an earlier step."""
    terminated: Bool
    """True if the task is done and ends the episode, or the vehicle was lost in this step."""
    truncated: Bool
    """True if the time limit ends the episode, for vehicles that are not lost."""
    acting: Bool
    """True for vehicles that act in the next step: not lost, and in an episode that goes on."""
    world_reward: Float64
    """Shape (world,): the mean over all vehicles, before ``team`` adds a lost vehicle's own loss."""
    world_terminated: Bool
    """Shape (world,): the task is done, or all vehicles are lost."""
    world_truncated: Bool
    """Shape (world,): the time limit ends the episode."""
    term_values: Float64
    """The reward's terms, shape (term, world, vehicle); empty for a user's own reward, or if they are not kept."""
    term_names: tuple[str, ...]

    @property
    def terms(self) -> Mapping[str, Float64]:
        """The reward's terms by name."""
        return dict(zip(self.term_names, self.term_values, strict=True)) if self.term_values.size else {}

    @property
    def over(self) -> Bool:
        """Worlds whose episode ended, shape (world,)."""
        return self.world_terminated | self.world_truncated


class BatchedEnv:
    """A swarm of ``num_worlds`` with the reward and the endings of every environment.

    Arguments are explained by ``uuv_marl.parallel_env``; without ``keep_terms`` steps omit the reward's terms, which
    saves time in large batches.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, reward: Reward = "dense", max_cycles: int | None = None,
        observe: Observe = "positions", keep_terms: bool = True,
    ) -> None:  # fmt: skip
        self.swarm = Swarm(scenario, num_worlds)
        self.layout = observation_layout(scenario, observe)
        """The fields of an observation."""
        self.task: Task = self.swarm.task
        names = (*self.task.rewards, "team")
        if not callable(reward) and reward not in names:
            raise ValueError(
                f"reward must be {', '.join(map(repr, names))} or a function of the swarm, got {reward!r}; "
                f"choose one of task {scenario.task.name!r}"
            )
        if not callable(reward) and reward != "team":
            self.task.reward_name = str(reward)
        self.state_layout = state_layout(scenario)
        self._waiting = set(range(num_worlds))
        """Worlds that were never reset."""
        self.over = np.zeros(num_worlds, np.bool_)
        """Worlds whose episode has ended, shape (world,)."""
        self.collisions = np.zeros(num_worlds, np.int64)
        """Collisions that began since the reset, shape (world,)."""
        self.max_cycles = None if max_cycles is None else whole_number("max_cycles", max_cycles, 1)
        self._reward: Reward = reward
        self._keep_terms = keep_terms or reward == "team"

    @property
    def longest_episode(self) -> int:
        """Decisions after which any episode of the scenario is over."""
        scenario = self.swarm.scenario
        seconds = scenario.time_limit.of(self.task.longest_s(scenario))
        cycles = math.ceil(seconds / scenario.timing.decision_period_s)
        return min(cycles, self.max_cycles or cycles)

    def reset(self, seed: SeedLike = None, worlds: Sequence[int] | None = None) -> Float32:
        """Start episodes; the observations of all worlds, shape (world, vehicle, entry).

        Args:
            seed: with a number, world w starts from ``seed + w``; a list has a seed or None for each of ``worlds``. A
                world without a seed continues its own random stream.
            worlds: the worlds to reset; None for all.
        """
        chosen = list(range(self.swarm.num_worlds)) if worlds is None else list(worlds)
        self.swarm.reset(seed, chosen)
        self._waiting -= set(chosen)
        self.over[chosen], self.collisions[chosen] = False, 0
        observation, observe = observer(self.swarm.percept, self.layout)
        observe(0, self.swarm.num_worlds)  # no threads, so that a forked process can reset
        return observation

    def check_reset(self, what: str) -> None:
        """Raise RuntimeError if a world was never reset."""
        if self._waiting:
            raise RuntimeError(f"{what} was called before reset; call reset() to start an episode")

    def step(self, action: ArrayLike) -> StepResult:
        """One decision of every world; ``action`` has shape (world, vehicle, ``scenario.action_size``).

        A world whose episode is over keeps its state, ``world_terminated`` and ``world_truncated``, and its reward is
        0, until it is reset.
        """
        self.check_reset("step")
        swarm = self.swarm
        before, running = swarm.state.alive.copy(), ~self.over
        observation, step_reward = self._simulated(action, running)
        np.add(self.collisions, swarm.facts.collisions, out=self.collisions, where=running)
        alive = swarm.state.alive
        mean = step_reward.total.sum(axis=1) / swarm.num_vehicles  # twice as fast as mean(axis=1), and its bits
        team = self._reward == "team"
        world_terminated, world_truncated = swarm.endings()
        if self.max_cycles is not None:
            last_tick = self.max_cycles * swarm.scenario.timing.control_steps_per_decision
            world_truncated |= (swarm.state.tick >= last_tick) & ~world_terminated
        self.over = world_terminated | world_truncated
        return StepResult(
            observation=observation,
            reward=self._team(step_reward, mean, before & running[:, None]) if team else step_reward.total,
            terminated=before & (world_terminated[:, None] | ~alive),
            truncated=alive & world_truncated[:, None],
            acting=alive & ~self.over[:, None],
            world_reward=mean,
            world_terminated=world_terminated,
            world_truncated=world_truncated,
            term_values=step_reward.terms,
            term_names=() if callable(self._reward) else tuple(self.task.terms),
        )

    def _simulated(self, action: ArrayLike, running: Bool) -> tuple[Float32, StepReward]:
        """Step the worlds that are ``running``: the observations of all worlds, and the reward of these."""
        swarm = self.swarm
        observation, observe = observer(swarm.percept, self.layout)
        if callable(self._reward):
            reward = from_function(self._reward, swarm, running)
        else:
            reward = self.task.step_reward(running, keep_terms=self._keep_terms)

        def observe_and_fill(begin: int, end: int) -> None:
            observe(begin, end)
            reward.fill(begin, end)

        worlds = (0, swarm.num_worlds)
        if swarm.task_fields:  # which are written after all worlds are stepped
            swarm.step(action, running)
            observe_and_fill(*worlds)
        elif reward.concurrent:
            swarm.step(action, running, observe_and_fill)
        else:
            swarm.step(action, running, observe)
            reward.fill(*worlds)
        return observation, reward

    def state(self) -> Float32:
        """The global state of every world, shape (world, entry), see ``uuv_marl.envs.state.state_table``."""
        self.check_reset("state()")
        return global_state(self.swarm, self.state_layout)

    def _team(self, step_reward: StepReward, mean: Float64, before: Bool) -> Float64:
        """The team's reward of vehicles that acted, shape (world, vehicle): their mean, and a lost one's own loss.

        A lost vehicle has no share in the team's later costs, so it bears the whole of its loss.
        """
        names = [*self.task.terms]
        loss = step_reward.terms[names.index("loss")] if "loss" in names else 0.0
        return np.where(before, mean[:, None] + loss, 0.0)


def make_batched_env(
    scenario: ScenarioLike = "single_obstacle",
    num_worlds: int = 1,
    *,
    number: str = "num_worlds",
    max_cycles: int | None = None,
    reward: Reward = "dense",
    observe: Observe = "positions",
    keep_terms: bool = True,
    for_policy: str | Mapping[str, str] | None = None,
    **changes: Unpack[Changes],
) -> BatchedEnv:
    """Worlds from the arguments that every environment API takes: those of ``BatchedEnv`` and ``changed``.

    ``number`` is the API's name of ``num_worlds``, for errors.
    """
    worlds = whole_number(number, num_worlds, 1)
    return BatchedEnv(changed(scenario, for_policy, **changes), worlds, reward, max_cycles, observe, keep_terms)


def refuse_losses(scenario: Scenario, api: str) -> None:
    """Raise ScenarioError if vehicles can be lost, for an API in which all rows last until the episode's end."""
    if scenario.loses_vehicles:
        raise ScenarioError(
            f"{api} can't represent the loss of a vehicle, which can happen in scenario {scenario.name!r}; use "
            "uuv_marl.parallel_env, vector_env or the TorchRL or RLlib environment, or override "
            "losses.times_s=[] and collision.ends_vehicle=false, and leave out faults of kind member"
        )
