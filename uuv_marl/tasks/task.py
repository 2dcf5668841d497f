"""``Task``: what a swarm is to do, in hooks that take and give arrays over worlds and vehicles."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.errors import RewardError, ScenarioError
from uuv_marl.percept import CHANNELS, FieldTable, percept_table
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.fields import Section
from uuv_marl.sim.episode_setup import EpisodeSetup, default_setup
from uuv_marl.sim.field import longest_duration
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.tables import allocate
from uuv_marl.tasks.measures import MEASURED
from uuv_marl.types import Bool, Float64, Int64

Terms = Mapping[str, NDArray[np.floating[Any]]]
"""Arrays by name."""


class StepReward(NamedTuple):
    """What pays a step while it is simulated, world by world. The arrays are zero before."""

    reward: Float64
    """Sum of the terms, shape (world, vehicle)."""
    terms: Float64
    """The weighted terms in the order of ``Task.terms``, shape (term, world, vehicle); no world if not kept."""
    fill: Callable[[int, int], None]
    """Fills both for a range of worlds, from its first to its end."""


def checked_reward(task: "Task", running: Bool) -> StepReward:
    """What a task's ``reward`` gives for the latest step, for worlds that are ``running``.

    Raises:
        RewardError: terms are missing or unknown, of another shape, or not finite.
    """
    terms_given, swarm = task.reward(running), task.swarm
    name = type(task).__name__
    if {*terms_given} != {*task.terms}:
        raise RewardError(f"reward of {name} must give the terms {', '.join(task.terms)}, got {', '.join(terms_given)}")
    shape = (swarm.num_worlds, swarm.num_vehicles)
    rewarded = running[:, None] & (swarm.state.alive | swarm.facts.lost)
    terms = np.zeros((len(task.terms), *shape))
    for k, term in enumerate(task.terms):
        own = np.asarray(terms_given[term], np.float64)
        if own.shape != shape:
            raise RewardError(f"reward of {name} must give {term} as an array {shape}, got {own.shape}")
        if not np.isfinite(own[rewarded]).all():
            raise RewardError(f"reward of {name} must give finite numbers, got others in {term}")
        terms[k][rewarded] = own[rewarded]
    return StepReward(terms.sum(axis=0), terms, lambda _begin, _end: None)


class Task:
    """What a swarm is to do: who goes where, what is paid, when it is done and well done, and what is measured.

    A subclass overrides hooks. Those with ``running`` are told which worlds go on, shape (world,), and give arrays over
    all worlds and vehicles; what they give for other worlds is not used. Those with ``world`` are about one.
    ``self.swarm`` is the simulation, in its present state, and ``self.numbers`` the task's own numbers.

    A subclass must say who is ``there``. Without other overrides the swarm starts, and its reference moves, as the
    scenario says; nothing is paid; the episode runs to its time limit.

    Args:
        swarm: of any number of worlds, before its first reset.
    """

    Numbers: ClassVar[type[Section]] = Section
    """The task's own numbers, which stand in the scenario's table ``task``; ranges as in ``scenario/fields.py``."""
    Memory: ClassVar[type[Any] | None] = None
    """Table of what the task remembers (``uuv_marl.sim.tables``): a NamedTuple of arrays over world and vehicle. Zero
    is nothing: so a world begins. It is part of the swarm's snapshots."""
    observed: ClassVar[FieldTable] = ()
    """Rows that the task adds to every percept and observation, see ``uuv_marl.percept.PerceptField``."""
    channels: ClassVar[Mapping[str, FieldTable]] = {}
    """Rows that it adds where ``sonar.channels`` grants them, by the channel's name: what no vehicle could measure."""
    rewards: ClassVar[tuple[str, ...]] = ("dense",)
    """Names of the rewards that the task knows; the first is the default."""
    terms: ClassVar[Mapping[str, str]] = {}
    """The terms of the first reward with their formulas, in order."""
    headline: ClassVar[str] = "success_share"
    """The metric, a share, by which policies are compared and trainings choose."""
    columns: ClassVar[Mapping[str, str]] = {}
    """The task's own metrics that tables show, with what they are and their unit."""
    traffic: ClassVar[bool] = True
    """Whether the scenario's ``traffic`` may move the obstacles that the task draws."""
    has_goal: ClassVar[bool] = True
    """Whether references say where to go: else no arrival is told, and pictures show a place."""
    reference_label: ClassVar[str] = "l(t), to follow"
    """What a reference is, in a legend's words; pictures call it by those before a comma."""
    mark_label: ClassVar[str] = ""
    """What ``marks`` are, in a legend's words."""
    ending: ClassVar[str] = "done"
    """Name of the ending of an episode that is ``done``."""
    reference_policy: ClassVar[str] = "bio_inspired"
    """Policy whose mean return is above that of ``idle`` and ``random``."""

    def __init__(self, swarm: Swarm) -> None:
        self.swarm = swarm
        self.reward_name: str = self.rewards[0]
        """Which of ``rewards`` an environment pays."""
        self.numbers: Any = swarm.scenario.task_numbers
        sizes = {"world": swarm.num_worlds, "vehicle": swarm.num_vehicles, **self.sizes(swarm.scenario)}
        self.memory: Any = allocate(self.Memory, sizes) if self.Memory else ()
        """What is remembered, the arrays of ``Memory``."""

    @classmethod
    def check(cls) -> None:
        """Raise ScenarioError for a class that can't be a task: it doesn't say who succeeds, or takes a name twice."""
        if cls.at_goal is Task.at_goal and cls.succeeded is Task.succeeded:
            raise ScenarioError(
                f"task {cls.__name__} must define at_goal(), the vehicles that are where they should be: it decides which "
                "succeed, and which policy a training keeps; where all are, return np.ones_like(self.swarm.state.alive)"
            )
        rows = [row.name for table in (cls.observed, *cls.channels.values()) for row in table]
        usual = {row.name for row in percept_table(1, 1)}
        for where, names, taken in (
            ("columns", cls.columns, MEASURED), ("observed or channels", rows, usual),
            ("channels", cls.channels, CHANNELS), ("rewards", cls.rewards, {"team"}),
        ):  # fmt: skip
            twice = sorted({name for name in names if name in taken or list(names).count(name) > 1})
            if twice:
                raise ScenarioError(
                    f"task {cls.__name__} can't have {', '.join(twice)} in {where}: the name is taken; choose another"
                )

    @classmethod
    def sizes(cls, scenario: Scenario) -> Mapping[str, int]:  # noqa: ARG003 - for those who override it
        """Lengths of axes: ``group``, ``point`` (corners), ``obstacle`` where unusual, and of those of ``Memory``."""
        return {}

    # What an episode starts from, and what moves.

    @classmethod
    def longest_s(cls, scenario: Scenario) -> float:
        """The largest ``duration_s`` that ``draw`` gives [s]."""
        return longest_duration(scenario)

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:  # noqa: ARG002
        """What a world starts from, drawn from its own generator; ``memory`` is cleared. VMAS: ``reset_world_at``."""
        return default_setup(self.swarm.scenario, rng)

    def begin(self, world: int) -> None:
        """A world was reset: look at how it stands, and remember what later hooks need."""

    def move(self, running: Bool) -> None:
        """Before a step: steer what policies don't, such as ``swarm.course.obstacle_velocity``; VMAS: ``pre_step``."""

    def update(self, running: Bool) -> None:
        """After a step: remember what later hooks need; VMAS: ``post_step``."""

    # What is told and paid.

    def observe(self, running: Bool) -> Terms:  # noqa: ARG002
        """The rows that are told by name, shape (world, vehicle, ...), physical units; VMAS: ``observation``."""
        return {}

    def reward(self, running: Bool) -> Terms:  # noqa: ARG002
        """What the latest step pays, weighted ``terms`` by name, shape (world, vehicle) each; VMAS: ``reward``."""
        return {}

    def step_reward(self, name: str, running: Bool, *, keep_terms: bool = True) -> StepReward | None:  # noqa: ARG002
        """Compiled pay for a reward by its name, its terms only if they are ``kept``; None for ``reward`` alone."""
        return None

    # When it is done, and well done.

    def done(self) -> Bool:
        """Worlds whose episode ends before the time limit, shape (world,); VMAS: ``done``."""
        return np.zeros(self.swarm.num_worlds, np.bool_)

    def at_goal(self) -> Bool:
        """Vehicles that are where they should be now, shape (world, vehicle); a subclass without it is refused."""
        return np.ones_like(self.swarm.state.alive)

    def succeeded(self) -> Bool:
        """Vehicles that would have done their task if the episode ended now: there, alive, and untouched all along."""
        state = self.swarm.state
        return self.at_goal() & state.alive & ~state.collided

    def arrived(self, world: int) -> bool:
        """Whether the task of a world is done, whether that ends the episode or not."""
        return bool(self.done()[world])

    def success(self, world: int, vehicle: int | None = None) -> bool:
        """Whether an episode that ends now is a success for a vehicle, or with None for all of them."""
        succeeded = self.succeeded()[world]
        return bool(succeeded.all() if vehicle is None else succeeded[vehicle])

    # What is measured and drawn.

    def path_length_m(self) -> Float64:
        """Length of the way that each vehicle has still to go [m], shape (world, vehicle): what a critic may know."""
        return self.swarm.facts.away

    def arrived_before(self) -> Bool:
        """Vehicles that have been paid for their arrival, shape (world, vehicle), likewise."""
        return np.zeros_like(self.swarm.state.alive)

    def metrics(self, world: int) -> dict[str, float | None]:
        """Measures of an episode that ends now, numbers by name; VMAS: ``info``.

        A subclass adds its own, by names not in ``uuv_marl.tasks.measures``, to these: ``success_share``, the share
        of vehicles that succeeded, and ``whole``, 1 if all did.
        """
        share = float(self.succeeded()[world].mean())
        return {"success_share": share, "swarm_success": float(share == 1.0)}

    def teams(self, world: int) -> Int64:
        """Number of each vehicle's team, from 0 on, which pictures show in one colour, shape (vehicle,)."""
        return self.swarm.world_map.group[world]

    def marks(self, world: int) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Circles to draw of the task: centre north, east and radius [m], shape (mark, 3); VMAS: ``extra_render``."""
        return np.zeros((0, 3))
