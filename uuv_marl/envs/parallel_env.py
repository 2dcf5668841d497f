"""The PettingZoo environments: ``parallel_env`` (agents act at once) and ``env`` (AEC: agents act in turn)."""

import itertools
import math
from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import OrderEnforcingWrapper, parallel_to_aec

from uuv_marl.envs.changes import Reward, ScenarioLike
from uuv_marl.envs.core import BatchedEnv, StepResult, make_batched_env
from uuv_marl.envs.drawing.options import RenderOptions
from uuv_marl.envs.ending import ending
from uuv_marl.envs.mixins import RenderMixin
from uuv_marl.sim.arguments import action_array, whole_number, world_seeds
from uuv_marl.sim.observation import Observe
from uuv_marl.types import Float32, Int64

Infos = dict[str, dict[str, Any]]


class SwarmParallelEnv(RenderMixin, ParallelEnv[str, Float32, Float32 | None]):
    """A swarm of UUVs as PettingZoo agents; ``parallel_env`` makes one.

    Observation: the vehicle's percept, flattened and scaled by the table in ``uuv_marl.percept``. Action: surge force
    and yaw torque as shares of full force, projected onto the unit disc, and ``modem.message_entries`` numbers from -1
    to 1, its message; shape (2 + entry,). An agent's last info holds how its episode ended
    (``uuv_marl.envs.ending.ending``). ``np_random`` is a generator for wrappers and users, seeded by
    ``reset(seed=s)``; the environment itself never draws from it.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - PettingZoo's own form
        "name": "uuv_swarm_v2",
        "render_modes": ["human", "rgb_array"],
        "is_parallelizable": True,
    }

    def __init__(
        self,
        batch: BatchedEnv,
        render_mode: str | None = None,
        info_terms: bool = False,
        render_options: RenderOptions | None = None,
    ) -> None:
        self._wrap(batch, render_mode, render_options)
        self._info_terms = info_terms
        self.np_random = np.random.default_rng()
        self.possible_agents = [f"uuv_{i}" for i in range(self.scenario.swarm.num_vehicles)]
        self._index = {agent: i for i, agent in enumerate(self.possible_agents)}
        self.agents: list[str] = []
        self._rows: slice | Int64 = slice(None)
        layout, self._action_size = batch.layout, self.scenario.action_size
        self.observation_spaces = {agent: Box(layout.low, layout.high) for agent in self.possible_agents}
        self.action_spaces = {agent: Box(-1.0, 1.0, (self._action_size,)) for agent in self.possible_agents}
        self.state_space = Box(batch.state_layout.low, batch.state_layout.high)

    @property
    def max_cycles(self) -> int | None:
        """Decisions after which an episode is truncated, None for the scenario's time limit."""
        return self._batch.max_cycles

    @max_cycles.setter
    def max_cycles(self, value: int | None) -> None:  # as PettingZoo's own test sets it
        self._batch.max_cycles = None if value is None else whole_number("max_cycles", value, 1)

    def observation_space(self, agent: str) -> Space[Any]:
        """The observation space of an agent, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Any]:
        """The action space of an agent, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - PettingZoo's signature
    ) -> tuple[dict[str, Float32], Infos]:
        """Start an episode. Without a seed the environment's random stream continues. ``options`` are ignored."""
        (own,) = world_seeds(seed, [0])
        observation = self._batch.reset(own)[0]
        if own is not None:
            self.np_random = np.random.default_rng(np.random.SeedSequence(own, spawn_key=(0,)))
        self.agents = list(self.possible_agents)
        self._rows = slice(None)
        self._renderer.update()
        return {agent: observation[i] for i, agent in enumerate(self.agents)}, {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, ArrayLike | None]
    ) -> tuple[dict[str, Float32], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """One decision of every agent. After the episode's end, ``step({})`` returns empty dictionaries.

        Raises:
            ValueError: an action is missing, misshapen or not finite, or an agent is unknown.
            RuntimeError: before ``reset``, or with actions after the episode's end.
        """
        if not self.agents:
            self._batch.check_reset("step")
            if actions:
                raise RuntimeError("the episode is over; call reset() to start another")
            return {}, {}, {}, {}, {}
        result = self._batch.step(self._action_array(actions))
        acted, rows = self.agents, self._rows
        observations = dict(zip(acted, result.observation[0, rows], strict=True))
        rewards = dict(zip(acted, result.reward[0, rows].tolist(), strict=True))
        terminated = dict.fromkeys(acted, False)
        truncated = terminated.copy()
        infos = self._infos(result, acted, rows)
        going = result.acting[0, rows].tolist()
        if not all(going):
            for flags, array in ((terminated, result.terminated), (truncated, result.truncated)):
                flags.update(zip(acted, array[0, rows].tolist(), strict=True))
            self.agents = list(itertools.compress(acted, going))
            for agent in infos.keys() - self.agents:
                infos[agent] |= ending(self._batch, 0, self._index[agent])
            self._rows = np.array([self._index[agent] for agent in self.agents], np.int64)
        self._renderer.update()
        return observations, rewards, terminated, truncated, infos

    def _infos(self, result: StepResult, agents: list[str], rows: slice | Int64) -> Infos:
        if not self._info_terms:
            return {agent: {} for agent in agents}
        terms = {name: term[0, rows].tolist() for name, term in result.terms.items()}
        return {agent: {"reward_terms": {name: of[k] for name, of in terms.items()}} for k, agent in enumerate(agents)}

    def _action_array(self, actions: Mapping[str, ArrayLike | None]) -> Float32:
        try:
            rows = [actions[agent] for agent in self.agents]
            masked = np.ma.MaskedArray in set(map(type, rows))  # an array of them would lose the masks
            values = None if masked else action_array(np.array(rows), (len(rows), self._action_size), "actions")
        except (LookupError, TypeError, ValueError, RuntimeError, OverflowError):
            values = None
        if values is None or not math.isfinite(np.vdot(values, values)):  # quick; finite numbers may overflow in it
            values = self._one_by_one(actions)
        if len(actions) > len(values) and not actions.keys() <= self._index.keys():
            unknown = min(actions.keys() - self._index.keys(), key=str)
            raise ValueError(f"agent {unknown!r} is unknown; agents are uuv_0 to {self.possible_agents[-1]}")
        if len(values) == len(self.possible_agents):
            return values[None]
        array = np.zeros((1, len(self.possible_agents), self._action_size), np.float32)
        array[0, self._rows] = values
        return array

    def _one_by_one(self, actions: Mapping[str, ArrayLike | None]) -> Float32:
        """Every agent's action. Raises ValueError for the first one that can't be used."""
        if not isinstance(actions, Mapping):
            raise TypeError(f"actions must be a dictionary with an action for each agent, got {type(actions).__name__}")
        rows: list[Float32] = []
        for agent in self.agents:
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; give one for each of env.agents")
            own = cast(ArrayLike, actions[agent])
            rows.append(action_array(own, (self._action_size,), f"the action of {agent}"))
            if not np.isfinite(rows[-1]).all():
                raise ValueError(f"the action of {agent} must be finite, got {rows[-1].tolist()}")
        return np.array(rows)

    def state(self) -> Float32:
        """The global state for centralised critics, explained by ``uuv_marl.envs.state.state_table``."""
        return self._batch.state()[0]


def parallel_env(
    scenario: ScenarioLike = "single_obstacle",
    num_vehicles: int | None = None,
    max_cycles: int | None = None,
    render_mode: str | None = None,
    *,
    render_options: RenderOptions | None = None,
    reward: Reward = "dense",
    info_terms: bool = False,
    observe: Observe = "positions",
    task: str | Mapping[str, object] | None = None,
    decision_period: float | None = None,
    overrides: Mapping[str, object] | None = None,
    for_policy: str | Mapping[str, str] | None = None,
) -> SwarmParallelEnv:
    """A PettingZoo parallel environment.

    Args:
        scenario: a name (``uuv_marl.scenario_names()``), a TOML file or a ``Scenario``.
        num_vehicles: number of vehicles; None for the scenario's number.
        max_cycles: decisions after which an episode is truncated; None for the scenario's time limit.
        render_mode: ``human``, ``rgb_array`` or None.
        render_options: a dictionary with any of ``size`` ((width, height) [px]), ``camera`` (``follow`` or ``map``) and
            ``sonar_of`` (index of a vehicle, to show its sonar).
        reward: ``dense`` (progress, costs and arrival), ``sparse`` (without progress; ``follow`` alone), ``geodesic``
            (progress along the collision-free path; ``hard_water`` alone), ``leader`` (informed vehicles get the mean;
            ``few_informed`` alone), ``team`` (all get the mean of ``dense``) or a function from the swarm to an array
            (world, vehicle).
        info_terms: put the reward's terms into every agent's info.
        observe: ``positions``, or ``closeness``: the same percept as values that grow as things come nearer, from which
            networks learn sooner; docs/environment.md has both tables.
        task: replaces the scenario's task: a name of ``uuv_marl.tasks.TASKS``, ``module:Class`` for your own, or a
            table with it as ``name`` and the task's numbers.
        decision_period: time between decisions [s], a multiple of the control step; replaces
            ``timing.decision_period_s``. Between decisions the force keeps its direction in the world frame.
        overrides: any field of the scenario, such as ``{"sonar.echo_reports": "surface"}``.
        for_policy: a policy or a team; the scenario gets its channels, yaw damping and decision period after all other
            changes (``uuv_marl.with_policy_requirements``).
    """
    batch = make_batched_env(
        scenario, max_cycles=max_cycles, reward=reward, observe=observe,
        keep_terms=info_terms, num_vehicles=num_vehicles, decision_period=decision_period, task=task,
        overrides=overrides, for_policy=for_policy,
    )  # fmt: skip
    return SwarmParallelEnv(batch, render_mode, info_terms, render_options)


def env(*args: Any, **kwargs: Any) -> AECEnv[str, Float32, Float32 | None]:
    """A PettingZoo AEC environment, in which agents act in turn. Its arguments are those of ``parallel_env``."""
    return OrderEnforcingWrapper(parallel_to_aec(parallel_env(*args, **kwargs)))
