"""The core of every environment API: a swarm, its reward and its endings, as arrays over worlds and vehicles."""

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from uuv_marl.envs.changes import Changes, Reward, ScenarioLike, changed
from uuv_marl.envs.reward import own_reward
from uuv_marl.envs.state import global_state, state_layout
from uuv_marl.scenario import Scenario, ScenarioError
from uuv_marl.sim.arguments import SeedLike, whole_number
from uuv_marl.sim.observation import Observe, observation_layout, observer
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.task import StepReward, Task, checked_reward
from uuv_marl.types import Bool, Float32, Float64


class StepResult(NamedTuple):
    """The result of one step of every world. Arrays have shape (world, vehicle, ...), or the shape in their text."""

    observation: Float32
    reward: Float64
    """Zero for vehicles that were lost in an earlier step."""
    terminated: Bool
    """True where the arrival of the swarm ends the episode, or where the vehicle was lost in this step."""
    truncated: Bool
    """True where the time limit ends the episode, for vehicles that are not lost."""
    acting: Bool
    """True for vehicles that act in the next step: they are not lost, and their world's episode has not ended."""
    world_reward: Float64
    """Shape (world,): the mean over all vehicles, before ``team`` adds a lost vehicle's own loss."""
    world_terminated: Bool
    """Shape (world,): the arrival of the swarm ends the episode, or all vehicles are lost."""
    world_truncated: Bool
    """Shape (world,): the time limit ends the episode."""
    term_values: Float64 | None
    """The reward's terms, shape (term, world, vehicle); None for a user's own reward."""
    term_names: tuple[str, ...]
    """Their names."""

    @property
    def terms(self) -> Mapping[str, Float64]:
        """The reward's terms by name; empty for a user's own reward."""
        return (
            {}
            if self.term_values is None or not self.term_values.size
            else dict(zip(self.term_names, self.term_values, strict=False))
        )

    @property
    def over(self) -> Bool:
        """Worlds whose episode ended, shape (world,)."""
        return self.world_terminated | self.world_truncated


class BatchedEnv:
    """A swarm with the reward and the endings of the environment's contract.

    Args:
        scenario: what to simulate.
        num_worlds: worlds stepped together.
        reward: ``dense`` (the sum of a vehicle's terms, see the task), ``sparse`` (the same without progress) and
            ``geodesic`` (progress along the free way) and ``led`` (the informed get the mean) where the task has them,
            ``team`` (every vehicle gets the mean of ``dense`` over all; a lost vehicle also pays its own loss), or a
            function from the swarm to an array (world, vehicle).
        max_cycles: decisions after which an episode is truncated, unless the scenario's time limit comes first.
        observe: ``positions`` or ``closeness``, see ``uuv_marl.sim.observation``.
        keep_terms: whether steps tell the reward's terms, which takes time in large batches.
    """

    def __init__(
        self,
        scenario: Scenario,
        num_worlds: int = 1,
        reward: Reward = "dense",
        max_cycles: int | None = None,
        observe: Observe = "positions",
        keep_terms: bool = True,
    ) -> None:
        self.swarm = Swarm(scenario, num_worlds)
        self.layout = observation_layout(scenario, observe)
        """The table of an observation."""
        self.task: Task = self.swarm.task
        names = (*self.task.rewards, "team")
        if not callable(reward) and reward not in names:
            raise ValueError(
                f"reward must be {', '.join(map(repr, names))} or a function of the swarm, got {reward!r}; these are "
                f"the rewards of task {scenario.task.name!r}"
            )
        if reward in self.task.rewards:
            self.task.reward_name = str(reward)
        self.state_layout = state_layout(scenario)
        self._waiting = set(range(num_worlds))
        """Worlds that were never reset."""
        self.over = np.zeros(num_worlds, np.bool_)
        """Worlds whose episode has ended, shape (world,)."""
        self.collisions = np.zeros(num_worlds, np.int64)
        """Contact episodes that began since the reset, shape (world,)."""
        self.max_cycles = max_cycles
        self._reward: Reward = reward
        self._keep_terms = keep_terms or reward == "team"

    @property
    def max_cycles(self) -> int | None:
        """Decisions after which an episode is truncated."""
        return self._max_cycles

    @max_cycles.setter
    def max_cycles(self, value: int | None) -> None:
        self._max_cycles = None if value is None else whole_number("max_cycles", value, 1)

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
            raise RuntimeError(f"{what} came before reset; call reset() to start an episode")

    def step(self, action: ArrayLike) -> StepResult:
        """One decision of every world; ``action`` has shape (world, vehicle, 2).

        A world whose episode is over keeps its state, ``world_terminated`` and ``world_truncated``, and its reward is
        0, until it is reset.
        """
        self.check_reset("step")
        swarm = self.swarm
        before, running = swarm.state.alive.copy(), ~self.over
        observation, step_reward = self._simulated(action, running)
        np.add(self.collisions, swarm.facts.collisions, out=self.collisions, where=running)
        alive = swarm.state.alive
        reward, world_reward, term_values = self._rewards(before & running[:, None], step_reward)
        world_terminated, world_truncated = swarm.endings()
        if self._max_cycles is not None:
            last_tick = self._max_cycles * swarm.scenario.timing.control_steps_per_decision
            world_truncated |= (swarm.state.tick >= last_tick) & ~world_terminated
        self.over = world_terminated | world_truncated
        return StepResult(
            observation=observation,
            reward=reward,
            terminated=before & (world_terminated[:, None] | ~alive),
            truncated=alive & world_truncated[:, None],
            acting=alive & ~self.over[:, None],
            world_reward=world_reward,
            world_terminated=world_terminated,
            world_truncated=world_truncated,
            term_values=term_values,
            term_names=tuple(self.task.terms),
        )

    def _simulated(self, action: ArrayLike, running: Bool) -> tuple[Float32, StepReward]:
        """One decision of the worlds that are ``running``; all observations, and what those worlds pay."""
        swarm, task = self.swarm, self.task
        observation, observe = observer(swarm.percept, self.layout)
        step_reward = task.step_reward(task.reward_name, running, keep_terms=self._keep_terms)
        if step_reward is not None and not swarm.task_fields:
            threaded = step_reward

            def observe_and_fill(begin: int, end: int) -> None:
                observe(begin, end)
                threaded.fill(begin, end)

            swarm.step(action, running, observe_and_fill)
            return observation, step_reward
        swarm.step(action, running)
        observe(0, swarm.num_worlds)
        if step_reward is None:
            step_reward = checked_reward(task, running)
        else:
            step_reward.fill(0, swarm.num_worlds)
        return observation, step_reward

    def state(self) -> Float32:
        """The global state of every world, shape (world, entry), see ``uuv_marl.envs.state.state_table``."""
        self.check_reset("state()")
        return global_state(self.swarm, self.state_layout)

    def _rewards(self, before: Bool, step_reward: StepReward) -> tuple[Float64, Float64, Float64 | None]:
        """Reward per vehicle, per world, and the weighted terms, for those that were there ``before`` the step."""
        if callable(self._reward):
            own = own_reward(self._reward, self.swarm, before)
            return own, own.mean(axis=1), None
        reward, terms = step_reward.reward, step_reward.terms
        mean = reward.sum(axis=1) / self.swarm.num_vehicles  # twice as fast as reward.mean(axis=1), and its bits
        if self._reward == "team":
            # Who is lost leaves the team's later costs behind, and so bears its own charge whole.
            loss = terms[tuple(self.task.terms).index("loss")] if "loss" in self.task.terms else 0.0
            reward = np.where(before, mean[:, None] + loss, 0.0)
        return reward, mean, terms


def make_batched_env(
    scenario: ScenarioLike = "single_obstacle",
    num_worlds: int = 1,
    *,
    order: tuple[str, str] = ("scenario", "num_worlds"),
    max_cycles: int | None = None,
    reward: Reward = "dense",
    observe: Observe = "positions",
    keep_terms: bool = True,
    for_policy: str | None = None,
    **changes: Unpack[Changes],
) -> BatchedEnv:
    """Worlds from the arguments that every environment API takes.

    Args:
        scenario: a name, a TOML file or a ``Scenario``.
        num_worlds: worlds stepped together.
        order: names of the API's first two arguments, for errors: libraries begin with one or the other.
        max_cycles: decisions after which an episode is truncated; None for the scenario's time limit.
        reward: ``dense``, ``sparse``, ``team``, one of the task's, or a function from the swarm to (world, vehicle).
        observe: ``positions`` or ``closeness``, see ``uuv_marl.sim.observation``.
        keep_terms: whether steps tell the reward's terms.
        for_policy: policy whose requirements the scenario gets.
        changes: ``num_vehicles``, ``decision_period`` [s], ``task`` and ``overrides`` of the scenario, see ``changed``.
    """
    (number,) = {*order} - {"scenario"}
    remedy = f"the first argument is {order[0]}, the second {order[1]}"
    if isinstance(scenario, Real):
        raise ScenarioError(f"scenario must be a name, a TOML file or a Scenario, got {scenario}; {remedy}")
    try:
        worlds = whole_number(number, num_worlds, 1)
    except TypeError as error:
        raise TypeError(f"{error}; {remedy}") from None
    return BatchedEnv(changed(scenario, for_policy, **changes), worlds, reward, max_cycles, observe, keep_terms)


def refuse_losses(scenario: Scenario, api: str) -> None:
    """Raise ScenarioError if vehicles can be lost, for an API in which all rows must live to the episode's end."""
    if scenario.loses_vehicles:
        raise ScenarioError(
            f"{api} can't show that a vehicle is lost, which can happen in scenario {scenario.name!r}; use "
            "uuv_marl.parallel_env, vector_env or the TorchRL or RLlib environment, or override "
            "losses.times_s=[] and collision.ends_vehicle=false, and leave out faults of kind member"
        )
