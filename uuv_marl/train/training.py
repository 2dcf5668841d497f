"""``Training``: the description of a training, read from a TOML recipe and saved in a run's ``config.json``."""

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Self, cast

import pydantic
from pydantic import NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import Card, card_of
from uuv_marl.baselines.learned.layers import Architecture
from uuv_marl.baselines.making import check_base_controller
from uuv_marl.baselines.requirements import FULL_TORQUE_NM, inner_loop_nms
from uuv_marl.baselines.team import shared_scenario
from uuv_marl.baselines.team_names import TeamName, parse_team
from uuv_marl.envs.changes import Reward
from uuv_marl.errors import PolicyError, RewardError, ScenarioError, TrainingError
from uuv_marl.modules import named_object
from uuv_marl.paths import user_path
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.documents import read_toml
from uuv_marl.scenario.messages import explain
from uuv_marl.scenario.overrides import assign, plain

_PERIOD, _LOOP, _LOOP_NMS = "timing.decision_period_s", "actuators.yaw_damping_nms", 600.0
OVERRIDES: Mapping[str, object] = {_PERIOD: 0.5, _LOOP: _LOOP_NMS}
"""Changes to a scenario without ``timing.fixed``, for the paper's vehicle: a fifth of the decisions, and a yaw damping,
so that action noise does not spin the vehicle."""
LEARNER = "<learner>"
"""Name of the learner in a team with ``Training.others``."""
COLLISION_COST = (1.0, 300.0)
"""Cost of a collision beyond the rewards of the package's tasks: small at first, so that vehicles learn to move."""
ROWS = 640
"""Approximate number of vehicles that are simulated together."""

Share = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]


def _paired(sizes: Any) -> Any:
    alone = isinstance(sizes, list | tuple)
    return [(each, 0) if isinstance(each, int) else each for each in cast(list[Any], sizes)] if alone else sizes


class Part(NamedTuple):
    """Worlds of a training that are stepped together."""

    name: str
    """Name or file of the scenario."""
    scenario: Scenario
    """With its number of vehicles."""
    worlds: int

    @property
    def vehicles(self) -> int:
        """Number of vehicles in each world."""
        return self.scenario.swarm.num_vehicles


class Ppo(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Hyperparameters of ``uuv_marl.train.ppo``."""

    gamma: Share = 0.99
    """Discount per decision; with 0.5 s rewards fade over 50 s."""
    gae_lambda: Share = 0.95
    """Weight of longer returns in advantages [1]."""
    horizon: PositiveInt = 64
    """Decisions between updates, and length of backpropagation through time."""
    minibatches: PositiveInt = 10
    """Gradient steps of an epoch, at most."""
    epochs: PositiveInt = 4
    """Passes over a batch, at most."""
    clip: PositiveFloat = 0.2
    """Clip range of PPO's ratio [1]."""
    kl_stop: PositiveFloat = 0.03
    """Divergence from the policy that sampled, beyond which no further epoch runs."""
    learning_rate: tuple[PositiveFloat, PositiveFloat] = (1e-3, 1e-4)
    """At the start and at the end."""
    noise: tuple[PositiveFloat, PositiveFloat] = (0.5, 0.1)
    """Standard deviation of actions [1], at the start and at the end. Actions are clipped at full force, and a policy
    that learns to compensate for this overshoots without noise: end with a small value."""
    message_noise: tuple[PositiveFloat, PositiveFloat] | None = None
    """Standard deviation of the entries of messages [1], at the start and at the end; that of forces if None."""
    collision_cost: tuple[NonNegativeFloat, NonNegativeFloat] | None = None
    """Cost of a collision beyond the reward, at the start and at the end, see ``annealed``. If None: ``COLLISION_COST``
    with the package's tasks and rewards; 0 with a task or reward of your own."""
    max_gradient: PositiveFloat = 0.5
    """Norm to which the gradients of actor and critic are clipped."""
    value_decay: Annotated[float, pydantic.Field(ge=0.0, lt=1.0)] = 0.99
    """Decay of the running mean and variance that normalise returns [1]."""


class Training(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Description of a training.

    Raises:
        TrainingError: a field is unknown or invalid; the message names it, its value and the remedy.
        ScenarioError: the scenario is invalid.
        PolicyError: there is no such base controller.
    """

    title: str = ""
    """Text above ``curve.png``; if empty, the scenario's title."""
    scenario: str = "starter"
    """Name or TOML file."""
    extra_scenarios: tuple[str, ...] = ()
    """Further scenarios for the same network, in equal parts, with the same observation, vehicle and clock."""
    overrides: dict[str, Any] = {}
    """Changed fields of ``scenario``; ``OVERRIDES`` apply to fields that are not given. ``sonar.channels`` changes
    ``extra_scenarios``, too, which need the same observation."""
    sizes: Annotated[tuple[tuple[PositiveInt, NonNegativeInt], ...], pydantic.BeforeValidator(_paired)] = ()
    """Pairs of numbers of vehicles and worlds, or numbers of vehicles; the scenario's own if empty. Without a number of
    worlds, or with 0, each size gets about the same number of vehicles, ``ROWS`` in total."""
    reward: str | None = None
    """One of the task's rewards, ``team``, or your own ``module:function`` from the swarm after a decision to an array
    (world, vehicle). The task's first if None, and in scenarios whose task does not have it."""
    critic: Literal["pooled", "own"] = "pooled"
    """Input of the critic beyond the vehicle's observation: ``pooled``, means and extremes over the true state of the
    world (MAPPO); ``own``, nothing (IPPO)."""
    network: Architecture = Architecture()
    """Architecture of the policy's network."""
    filter: bool = False
    """Whether actions pass the safety filter, in training and in use."""
    base_controller: str = ""
    """Name of a controller to whose actions the network's are added, at half the force; none if empty."""
    others: str = ""
    """Vehicles that do not learn, with the policies that they run: a team's name (``uuv_marl.make_policy``) that leaves
    vehicles to the learner, as in ``scout@30%`` or ``scout@uuv_0``; none if empty. They give it no samples."""
    expert: str = ""
    """Name of a policy that the network imitates before it learns from its reward; none if empty. The network gradually
    takes over the acting, with the expert's actions as targets (as in DAgger, Ross et al. 2011)."""
    imitation_share: Annotated[float, pydantic.Field(ge=0.0, lt=1.0)] = 0.4
    """Share of the budget for imitation, if there is an expert; PPO starts after it."""
    imitation_weight: NonNegativeFloat = 0.0
    """Weight in PPO's loss of the mean squared distance from the expert's actions [1]."""
    ppo: Ppo = Ppo()
    """Hyperparameters of PPO."""
    minutes: PositiveFloat | None = None
    """Budget of processor time without validations; 5 if neither this nor ``steps`` is given."""
    steps: PositiveInt | None = None
    """Budget of agent-steps (decisions of one vehicle), which gives the same training on every run."""
    seed: NonNegativeInt = 0
    """Seed of weights, worlds and noise; determines a training that has ``steps``."""
    validations: PositiveInt = 15
    """Number of validations, at equal parts of the budget."""
    validation_episodes: PositiveInt = 16
    """Episodes of a validation, over all sizes."""
    checkpoint_every: PositiveInt = 20
    """Iterations between checkpoints."""

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**plain(fields))
        except pydantic.ValidationError as error:
            cause = error.errors()[0].get("ctx", {}).get("error")
            known = isinstance(cause, ScenarioError | TrainingError | PolicyError)
            raise (cause if known else TrainingError(explain(error, fields, type(self)))) from None

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        """Fill in defaults that depend on other fields, and check the combination of fields."""
        if self.expert and self.base_controller:
            raise TrainingError(
                f"expert {self.expert!r} and base_controller {self.base_controller!r} are both given; leave one out"
            )
        if self.imitation_weight and not self.expert:
            weight = f"imitation_weight = {self.imitation_weight:g}"
            raise TrainingError(f"{weight} needs an expert, and none is given; name one, or leave it out")
        if self.minutes is not None and self.steps is not None:
            raise TrainingError(f"minutes = {self.minutes:g} and steps = {self.steps} are both given; leave one out")
        if self.minutes is None and self.steps is None:
            object.__setattr__(self, "minutes", 5.0)
        if self.ppo.collision_cost is None:
            own = ":" in "".join([self.reward or "", *(each.task.name for each in self._scenarios.values())])
            ppo = self.ppo.model_copy(update={"collision_cost": (0.0, 0.0) if own else COLLISION_COST})
            object.__setattr__(self, "ppo", ppo)
        known = dict.fromkeys(name for each in self._scenarios.values() for name in (*each.task_class.rewards, "team"))
        if self.reward is not None and ":" not in self.reward and self.reward not in known:
            tasks = ", ".join(dict.fromkeys(repr(each.task.name) for each in self._scenarios.values()))
            raise TrainingError(
                f"reward must be one of {', '.join(known)}, the rewards of task {tasks}, or module:function, "
                f"got {self.reward!r}"
            )
        for part in self.parts if self.others else ():
            self.swarm_scenario(part)
        for name, scenario in self._scenarios.items():
            card = self._card(scenario)
            if differs := next((f for f in Card.model_fields if getattr(card, f) != getattr(self.card, f)), None):
                raise TrainingError(
                    f"extra_scenarios has {name!r} with another {differs} than {self.scenario!r}, and one network "
                    "needs the same; leave it out, or make them equal in a file of your own"
                )
        return self

    @property
    def budget(self) -> float:
        """Agent-steps, or seconds of processor time."""
        return self.steps or 60.0 * (self.minutes or 0.0)

    @cached_property
    def loaded(self) -> Scenario:
        """The first scenario that is trained and validated on."""
        return next(iter(self._scenarios.values()))

    @cached_property
    def _scenarios(self) -> dict[str, Scenario]:
        if self.base_controller:
            check_base_controller(self.base_controller)
        shared = {field: value for field, value in self.overrides.items() if field == "sonar.channels"}
        loaded = {
            name: load_scenario(
                name, overrides=overrides_for(name, self.overrides if name == self.scenario else shared)
            )
            for name in (self.scenario, *self.extra_scenarios)
        }
        return {
            name: with_policy_requirements(self.base_controller, each) if self.base_controller else each
            for name, each in loaded.items()
        }

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """All groups of worlds: each scenario with each size."""
        parts: list[Part] = []
        for name, scenario in self._scenarios.items():
            sizes = self.sizes or ((scenario.swarm.num_vehicles, 0),)
            share = ROWS / len(self._scenarios) / len(sizes)
            for n, worlds in sizes:
                parts.append(Part(name, load_scenario(scenario, num_vehicles=n), worlds or max(1, round(share / n))))
        return tuple(parts)

    def team(self, learner: str) -> TeamName:
        """The team of a policy, by its name, and ``others``. Raises TrainingError where these leave it no vehicle."""
        team = parse_team(f"{self.others}+{learner}")
        if team is None or team.members[-1] != learner or team.rest != len(team.members) - 1:
            raise TrainingError(
                f"others = {self.others!r} must name vehicles for each policy, and leave some to the learner, as in "
                "scout@30% or scout@uuv_0"
            )
        return team

    def swarm_scenario(self, part: Part) -> Scenario:
        """The scenario of a part, also with what ``others`` require, of which the learner observes nothing.

        Raises:
            TrainingError: ``others`` leave no vehicle to the learner.
            PolicyError: they do not exist, or require another clock than the training's.
        """
        if not self.others:
            return part.scenario
        team = self.team(LEARNER)
        if (team.assigned(part.vehicles, 0) != team.rest).all():
            raise TrainingError(
                f"others = {self.others!r} leave none of {part.vehicles} vehicles to the learner; name fewer"
            )
        suited = {member: with_policy_requirements(member, part.scenario) for member in team.members[:-1]}
        return shared_scenario(self.others, {LEARNER: part.scenario, **suited})

    @cached_property
    def card(self) -> Card:
        """Card of the policy's checkpoint."""
        return self._card(self.loaded)

    def _card(self, scenario: Scenario) -> Card:
        return card_of(scenario, network=self.network, filter=self.filter, base_controller=self.base_controller)

    def reward_for(self, scenario: Scenario) -> Reward:
        """The reward on a scenario. Raises RewardError where it can't be imported."""
        first = next(iter(scenario.task_class.rewards))
        name = self.reward or first
        if ":" not in name:
            return cast(Reward, name if name in (*scenario.task_class.rewards, "team") else first)
        try:
            function = named_object(name)
        except ImportError as error:
            raise RewardError(f"reward {name!r} {error}; give module:function") from None
        if not callable(function):
            raise RewardError(f"reward {name!r} must be a function of the swarm, got {function!r}")
        return cast(Reward, function)


def overrides_for(scenario: str, own: Mapping[str, object]) -> dict[str, object]:
    """Fields that training changes in a scenario: ``OVERRIDES``, scaled to its vehicle, and the given ones.

    Args:
        scenario: name or TOML file.
        own: given fields, which take precedence and may name another vehicle.

    Raises:
        ScenarioError: the scenario can't be loaded with them.
    """
    # The scenario's decision period need not be a multiple of a given control step; the training's replaces it.
    clock = OVERRIDES if "timing.control_step_s" in own else {}
    bare = load_scenario(scenario, overrides={**clock, **own, _LOOP: own.get(_LOOP, 0.0)})
    if bare.timing.fixed:
        return dict(own)
    return {**OVERRIDES, _LOOP: inner_loop_nms(_LOOP_NMS, FULL_TORQUE_NM, bare), **own}


def recipe_fields(name: str) -> dict[str, Any]:
    """Fields of a training, from the name of a scenario, or from the TOML file of a scenario or recipe.

    A recipe names its ``scenario``; no scenario's file does.

    Raises:
        ScenarioError: it can't be read.
    """
    fields = read_toml(user_path(name)).data if name.endswith(".toml") else {}
    return fields if "scenario" in fields else {"scenario": name}


def changed_fields(fields: dict[str, Any], changes: Mapping[str, object]) -> dict[str, Any]:
    """Fields of a training with changes, of which fields of the scenario become ``overrides``.

    Args:
        fields: of a recipe; changed in place.
        changes: values by field, with dots as in ``ppo.gamma``.
    """
    for field, value in changes.items():
        table, dot, _ = field.partition(".")
        if table in (("ppo", "network") if dot else Training.model_fields):
            assign(fields, field, value)
        else:
            fields.setdefault("overrides", {})[field] = value
    return fields
