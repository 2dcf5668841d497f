"""``Task``: what a swarm is to do.

All methods take and give arrays over worlds and vehicles. Those with ``running`` get the worlds that are stepped, shape
(world,); their results for other worlds are not used. Those with ``world`` concern one world, by its index.
``self.swarm`` is the simulation in its present state, ``self.numbers`` the task's own numbers.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from uuv_marl.errors import RewardError, ScenarioError
from uuv_marl.percept import CHANNELS, FLAG, FieldTable, PerceptField, percept_table
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.fields import Section
from uuv_marl.sim.episode_setup import EpisodeSetup, default_setup, longest_duration
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.tables import allocate
from uuv_marl.tasks.measures import MEASURED
from uuv_marl.tasks.reward import StepReward, Terms, valid_values
from uuv_marl.types import Bool, Float64, Int64


class Task(ABC):
    """The base of every task, with a default for everything but ``reward``, ``at_goal`` and ``done``.

    Args:
        swarm: of any number of worlds, before its first reset.
    """

    Numbers: ClassVar[type[Section]] = Section
    """The task's own numbers, in the scenario's table ``task``; ranges as in ``scenario/fields.py``."""
    Memory: ClassVar[type[Any] | None] = None
    """Table of the task's memory (``uuv_marl.sim.tables``): a NamedTuple of arrays over world and vehicle, zero at the
    start of an episode, and part of the swarm's snapshots."""
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {"dense": {}}
    """The task's rewards by name, each with its terms in order and their formulas; the first is the default. Every
    environment adds ``team``: the mean of the first over all vehicles, and a lost vehicle's own term ``loss``."""
    observed: ClassVar[FieldTable] = ()
    """Fields that the task adds to every percept and observation, see ``uuv_marl.percept.PerceptField``."""
    channels: ClassVar[Mapping[str, FieldTable]] = {}
    """Fields that it adds where ``sonar.channels`` has this name: what no sensor of a vehicle could measure."""
    headline: ClassVar[str] = "success_share"
    """The metric, a share, by which policies are compared and trainings choose."""
    columns: ClassVar[Mapping[str, str]] = {}
    """The task's own metrics that tables show, with their meaning and unit."""
    traffic: ClassVar[bool] = True
    """Whether the scenario's ``traffic`` may move the obstacles that the task draws."""
    has_goal: ClassVar[bool] = True
    """Whether references are goals; if not, no arrival is reported and pictures show a place."""
    reference_label: ClassVar[str] = "l(t), to follow"
    """The reference in a legend; pictures use the words before a comma."""
    mark_label: ClassVar[str] = ""
    """``marks`` in a legend."""
    ending: ClassVar[str] = "done"
    """Name of the ending of an episode that is ``done``."""
    reference_policy: ClassVar[str] = "bio_inspired"
    """A policy with a mean return above that of ``idle`` and ``random``."""

    def __init__(self, swarm: Swarm) -> None:
        self.swarm = swarm
        self.reward_name: str = next(iter(self.rewards))
        """Which of ``rewards`` an environment uses."""
        self.numbers: Any = swarm.scenario.task_numbers
        sizes = {"world": swarm.num_worlds, "vehicle": swarm.num_vehicles, **self.sizes(swarm.scenario)}
        self.memory: Any = allocate(self.Memory, sizes) if self.Memory else ()
        """The arrays of ``Memory``."""

    @property
    def terms(self) -> Mapping[str, str]:
        """The terms of the reward in use, with their formulas."""
        return self.rewards[self.reward_name]

    @classmethod
    def sizes(cls, scenario: Scenario) -> Mapping[str, int]:  # noqa: ARG003 - for subclasses
        """Lengths of axes: ``group``, ``point`` (corners), ``obstacle`` where unusual, and those of ``Memory``."""
        return {}

    @abstractmethod
    def reward(self, running: Bool) -> Terms:
        """The weighted ``terms`` of the latest step by name, shape (world, vehicle) each. VMAS: ``reward``."""

    @abstractmethod
    def at_goal(self) -> Bool:
        """Vehicles that are where they should be now, shape (world, vehicle)."""

    @abstractmethod
    def done(self) -> Bool:
        """Worlds whose episode ends before the time limit, shape (world,). VMAS: ``done``."""

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:  # noqa: ARG002
        """What a world starts from, drawn from its own generator: by default what the scenario itself says.

        ``memory`` is cleared before. VMAS: ``reset_world_at``.
        """
        return default_setup(self.swarm.scenario, rng)

    @classmethod
    def longest_s(cls, scenario: Scenario) -> float:
        """The largest ``duration_s`` that ``draw`` gives [s]."""
        return longest_duration(scenario)

    def begin(self, world: int) -> None:
        """Called after a world's reset, to remember what later methods need."""

    def move(self, running: Bool) -> None:
        """Called before a step, for instance to set ``swarm.world_map.obstacle_velocity``. VMAS: ``pre_step``."""

    def update(self, running: Bool) -> None:
        """Called after a step, to remember what later methods need. VMAS: ``post_step``."""

    def observe(self, running: Bool) -> Terms:  # noqa: ARG002
        """Fields of ``observed`` and ``channels`` by name, in physical units, shape (world, vehicle, ...)."""
        return {}

    def fields(self, running: Bool) -> Terms:
        """``observe``, and the fields of the channel ``episode`` where ``sonar.channels`` has it."""
        if "episode" not in self.swarm.scenario.sonar.channels:
            return self.observe(running)
        left = np.maximum(1.0 - self.swarm.facts.time_s / self.swarm.time_limit_s, 0.0)[:, None, None]
        arrived = self.arrived_before()[:, :, None]
        return {
            **self.observe(running), "arrived": arrived.astype(np.float64),
            "time_left": np.broadcast_to(left, arrived.shape),
        }  # fmt: skip

    @classmethod
    def state_fields(cls, scenario: Scenario) -> FieldTable:
        """Fields that the task adds to the global state (``uuv_marl.envs.state``).

        With the state's other fields they determine the reward of the coming step, but for what is random.
        """
        meaning = "per vehicle: 1 once it has had its reward for arriving"
        return (PerceptField("arrived", (scenario.swarm.num_vehicles,), FLAG, meaning),)

    def state(self) -> Terms:
        """The values of ``state_fields`` by name, shape (world, *shape) each."""
        return {"arrived": self.arrived_before().astype(np.float64)}

    def step_reward(self, running: Bool, *, keep_terms: bool = True) -> StepReward:  # noqa: ARG002
        """The reward of the coming step from ``reward``; a task with compiled code for it overrides this.

        Its ``fill`` raises RewardError unless ``reward`` gives the declared terms, finite and of the right shape.

        Args:
            running: worlds that are stepped, shape (world,).
            keep_terms: whether the terms are needed beside their sum.
        """
        owner, names, shape = type(self).__name__, [*self.terms], self.swarm.state.alive.shape
        total, terms = np.zeros(shape), np.zeros((len(names), *shape))

        def fill(_begin: int, _end: int) -> None:
            given: Any = self.reward(running)
            if not isinstance(given, Mapping) or {*given} != {*names}:
                got = ", ".join(given) if isinstance(given, Mapping) else type(given).__name__
                raise RewardError(
                    f"reward of {owner} must give a dictionary of the terms {', '.join(names) or 'none'}, got {got}; "
                    "declare terms in rewards"
                )
            for k, name in enumerate(names):
                terms[k] = valid_values(given[name], self.swarm, running, f"term {name!r} of {owner}")
            total[:] = terms.sum(axis=0)

        return StepReward(total, terms, fill)

    def succeeded(self) -> Bool:
        """Vehicles that succeed if the episode ends now: at their goals, alive and collision-free."""
        state = self.swarm.state
        return self.at_goal() & state.alive & ~state.collided

    def success(self, world: int, vehicle: int | None = None) -> bool:
        """Whether an episode that ends now is a success for a vehicle, or with None for all of them."""
        succeeded = self.succeeded()[world]
        return bool(succeeded.all() if vehicle is None else succeeded[vehicle])

    def arrived(self, world: int) -> bool:
        """Whether the task of a world is done, even if the episode goes on."""
        return bool(self.done()[world])

    def metrics(self, world: int) -> dict[str, float | None]:
        """Metrics of an episode that ends now. VMAS: ``info``.

        A subclass adds its own, by names not in ``uuv_marl.tasks.measures``, to these: ``success_share``, the share
        of vehicles that succeeded, and ``swarm_success``, 1 if all did.
        """
        share = float(self.succeeded()[world].mean())
        return {"success_share": share, "swarm_success": float(share == 1.0)}

    def path_length_m(self) -> Float64:
        """Length of the path to each vehicle's goal [m], shape (world, vehicle), for critics."""
        return self.swarm.facts.away

    def arrived_before(self) -> Bool:
        """Vehicles that have had the reward for their arrival, shape (world, vehicle)."""
        return np.zeros_like(self.swarm.state.alive)

    def teams(self, world: int) -> Int64:
        """Index of each vehicle's team, which pictures show in one colour, shape (vehicle,)."""
        return self.swarm.world_map.group[world]

    def marks(self, world: int) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Circles to draw: centre north, east and radius [m], shape (mark, 3). VMAS: ``extra_render``."""
        return np.zeros((0, 3))

    @classmethod
    def check(cls) -> None:
        """Raise ScenarioError for a class that lacks a required method or uses a name that is taken."""
        if missing := sorted(cls.__abstractmethods__):
            raise ScenarioError(f"task {cls.__name__} must define {', '.join(missing)}; see uuv_marl.tasks.Task")
        fields = [field.name for table in (cls.observed, *cls.channels.values()) for field in table]
        usual = {field.name for field in percept_table(1, 1)}
        for where, names, taken in (
            ("columns", cls.columns, MEASURED), ("observed or channels", fields, usual),
            ("channels", cls.channels, CHANNELS), ("rewards", cls.rewards, {"team"}),
        ):  # fmt: skip
            twice = sorted({name for name in names if name in taken or list(names).count(name) > 1})
            if twice:
                raise ScenarioError(
                    f"task {cls.__name__} can't have {', '.join(twice)} in {where}: the name is taken; choose another"
                )
