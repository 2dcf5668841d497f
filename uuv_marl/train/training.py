"""``Training``: all that a training is. Its TOML is a recipe, and ``config.json`` of a run repeats it."""

import tomllib
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Self, cast

import pydantic

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import Card, card_of
from uuv_marl.baselines.learned.layers import Architecture
from uuv_marl.baselines.making import check_base_controller
from uuv_marl.baselines.requirements import FULL_TORQUE_NM, inner_loop_nms
from uuv_marl.envs.changes import Reward
from uuv_marl.envs.core import refuse_losses
from uuv_marl.errors import PolicyError, RewardError, ScenarioError, TrainingError
from uuv_marl.modules import named_object
from uuv_marl.paths import user_path
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.messages import explain
from uuv_marl.scenario.overrides import assign, plain

_PERIOD, _LOOP, _LOOP_NMS = "timing.decision_period_s", "actuators.yaw_damping_nms", 600.0
OVERRIDES: Mapping[str, object] = {_PERIOD: 0.5, _LOOP: _LOOP_NMS}
"""What training changes in a scenario that fixes neither (``timing.fixed``), with the paper's vehicle: a fifth of the
decisions, and an inner loop, so that noise on the torque does not spin a vehicle."""
CONTACT_COST = (1.0, 300.0)
"""What contacts cost beyond the rewards of the package's tasks: little at first, so that vehicles learn where to go."""
ROWS = 640
"""Vehicles at once, about."""

Count = Annotated[int, pydantic.Field(ge=1)]
Whole = Annotated[int, pydantic.Field(ge=0)]
Share = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]
Positive = Annotated[float, pydantic.Field(gt=0.0)]
NotNegative = Annotated[float, pydantic.Field(ge=0.0)]


def _paired(sizes: Any) -> Any:
    alone = isinstance(sizes, list | tuple)
    return [(each, 0) if isinstance(each, int) else each for each in cast(list[Any], sizes)] if alone else sizes


class Part(NamedTuple):
    """What of a training is stepped together."""

    name: str
    """The scenario's, or its file."""
    scenario: Scenario
    """With its number of vehicles."""
    worlds: int

    @property
    def vehicles(self) -> int:
        """Of each world."""
        return self.scenario.swarm.num_vehicles


class Ppo(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Numbers of the algorithm, see ``uuv_marl.train.ppo``."""

    gamma: Share = 0.99
    """Discount per decision; with 0.5 s rewards fade over 50 s."""
    gae_lambda: Share = 0.95
    """Weight of longer returns in advantages [1]."""
    horizon: Count = 64
    """Decisions between updates; a memory is trained through so many."""
    minibatches: Count = 10
    """Gradient steps of an epoch, at most; with a memory each is on the whole horizon of a part of the vehicles."""
    epochs: Count = 4
    """Passes over a batch, at most."""
    clip: Positive = 0.2
    """Clip range of PPO's ratio [1]."""
    kl_stop: Positive = 0.03
    """No further epoch where one has diverged further from the policy that sampled."""
    learning_rate: tuple[Positive, Positive] = (1e-3, 1e-4)
    """At the start and at the end."""
    noise: tuple[Positive, Positive] = (0.5, 0.1)
    """Standard deviation of actions [1], at the start and at the end. Noise is clipped at full force, and a policy that
    learned to make up for that overshoots without it: end with little."""
    collision_cost: tuple[NotNegative, NotNegative] | None = None
    """What a contact that begins costs beyond the reward, at the start and at the end, in equal ratios, or evenly from
    or to 0. If None: ``CONTACT_COST`` with the package's tasks and their rewards; nothing with one of your own."""
    max_gradient: Positive = 0.5
    """Norm to which gradients of actor and critic are clipped."""
    value_decay: Annotated[float, pydantic.Field(ge=0.0, lt=1.0)] = 0.99
    """Decay of the running mean and variance by which returns are normalised [1]."""


class Training(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """A training, field by field.

    Raises:
        TrainingError: a field is unknown or can't be used; the message names it, its value and the remedy.
        ScenarioError: the scenario can't be used.
        PolicyError: there is no law ``around``.
    """

    title: str = ""
    """What it is for, in words."""
    scenario: str = "starter"
    """Name or TOML file."""
    extra_scenarios: tuple[str, ...] = ()
    """Further scenarios for the same network, with the same observation, vehicle and clock; to equal parts."""
    overrides: dict[str, Any] = {}
    """Fields of ``scenario`` that differ from its file; ``OVERRIDES`` are added where they are not here."""
    sizes: Annotated[tuple[tuple[Count, Whole], ...], pydantic.BeforeValidator(_paired)] = ()
    """Vehicles and worlds of each swarm, or vehicles alone. If empty: the scenario's own. Without worlds, or with 0,
    about as many vehicles of each size, ``ROWS`` in all."""
    reward: str | None = None
    """One of the task's rewards, ``team``, or ``module:function`` of one's own: from the swarm after a decision to an
    array (world, vehicle). If None: the task's first."""
    critic: Literal["state", "own"] = "state"
    """What the critic sees beside the vehicle's observation: ``state``, the truth about the world (MAPPO); ``own``,
    nothing (IPPO)."""
    network: Architecture = Architecture()
    """What the policy's network is made of."""
    filter: bool = False
    """Whether actions pass the safety filter, in training as in use."""
    base_controller: str = ""
    """Name of a law to whose actions the network's are added, at half the force; none if empty."""
    expert: str = ""
    """Name of a policy that the network imitates before it learns from its reward; none if empty. At first the teacher
    acts, then the network more and more, always told what the teacher would do (as in DAgger, Ross et al. 2011)."""
    imitation_share: Annotated[float, pydantic.Field(ge=0.0, lt=1.0)] = 0.4
    """How much of the budget it imitates, if there is a teacher; ``ppo`` begins after it."""
    imitation_weight: NotNegative = 0.0
    """Weight in PPO's loss, after the lesson, of the mean squared distance from what the teacher would do [1]."""
    ppo: Ppo = Ppo()
    """Numbers of the algorithm."""
    minutes: Positive | None = None
    """Processor time, validations apart; 5 if neither this nor ``steps`` is given. Annealing ends with it."""
    steps: Count | None = None
    """Agent-steps: one is one decision of one vehicle. Unlike time they give the same training on every machine."""
    seed: int = pydantic.Field(0, ge=0)
    """Of weights, worlds and noise: it fixes a training that has ``steps``."""
    validations: Count = 15
    """How often the policy is validated, in even parts of the budget."""
    validation_episodes: Count = 16
    """Episodes of a validation, of all sizes together."""
    checkpoint_every: Count = 20
    """Iterations."""

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**plain(fields))
        except pydantic.ValidationError as error:
            cause = error.errors()[0].get("ctx", {}).get("error")
            known = isinstance(cause, ScenarioError | TrainingError | PolicyError)
            raise (cause if known else TrainingError(explain(error, fields, type(self)))) from None

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        """Fill in what is left out, and refuse what can't be run."""
        if self.expert and self.base_controller:
            raise TrainingError(
                f"expert {self.expert!r} and base_controller {self.base_controller!r} are both given; leave one out"
            )
        if self.imitation_weight and not self.expert:
            raise TrainingError(
                f"imitation_weight = {self.imitation_weight:g} needs an expert, and none is given; name one, or leave it out"
            )
        if self.minutes is not None and self.steps is not None:
            raise TrainingError(f"minutes = {self.minutes:g} and steps = {self.steps} are both given; leave one out")
        if self.minutes is None and self.steps is None:
            object.__setattr__(self, "minutes", 5.0)
        if self.ppo.collision_cost is None:
            own = ":" in "".join([self.reward or "", *(each.task.name for each in self._scenarios.values())])
            ppo = self.ppo.model_copy(update={"collision_cost": (0.0, 0.0) if own else CONTACT_COST})
            object.__setattr__(self, "ppo", ppo)
        for name, scenario in self._scenarios.items():
            refuse_losses(scenario, "training")
            known = (*scenario.task_class.rewards, "team")
            if self.reward is not None and ":" not in self.reward and self.reward not in known:
                raise TrainingError(
                    f"reward must be one of {', '.join(known)}, the rewards of task {scenario.task.name!r}, or "
                    f"module:function, got {self.reward!r}"
                )
            card = self._card(scenario)
            if differs := next((f for f in Card.model_fields if getattr(card, f) != getattr(self.card, f)), None):
                raise TrainingError(
                    f"also = {name!r} has another {differs} than {self.scenario!r}, and one network can't have both; "
                    "leave it out, or make them alike in a file of your own"
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
        loaded = {
            name: load_scenario(name, overrides=overrides_for(name, self.overrides if name == self.scenario else {}))
            for name in (self.scenario, *self.extra_scenarios)
        }
        return {
            name: with_policy_requirements(self.base_controller, each) if self.base_controller else each
            for name, each in loaded.items()
        }

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """All swarms that are stepped at once: of each scenario its sizes."""
        parts: list[Part] = []
        for name, scenario in self._scenarios.items():
            sizes = self.sizes or ((scenario.swarm.num_vehicles, 0),)
            share = ROWS / len(self._scenarios) / len(sizes)
            for n, worlds in sizes:
                parts.append(Part(name, load_scenario(scenario, num_vehicles=n), worlds or max(1, round(share / n))))
        return tuple(parts)

    @cached_property
    def card(self) -> Card:
        """What a checkpoint says of its policy."""
        return self._card(self.loaded)

    def _card(self, scenario: Scenario) -> Card:
        return card_of(scenario, network=self.network, filter=self.filter, base_controller=self.base_controller)

    def reward_for(self, scenario: Scenario) -> Reward:
        """What vehicles are paid for a decision. Raises RewardError where it can't be imported."""
        name = self.reward or next(iter(scenario.task_class.rewards))
        if ":" not in name:
            return cast(Reward, name)
        try:
            function = named_object(name)
        except ImportError as error:
            raise RewardError(f"reward {name!r} {error}; give module:function") from None
        if not callable(function):
            raise RewardError(f"reward {name!r} must be a function of the swarm, got {function!r}")
        return cast(Reward, function)


def overrides_for(scenario: str, own: Mapping[str, object]) -> dict[str, object]:
    """What training changes in a scenario: ``OVERRIDES``, with the inner loop of its vehicle, and fields of one's own.

    Args:
        scenario: name or TOML file.
        own: go before the others; they may name another vehicle.

    Raises:
        ScenarioError: the scenario can't be loaded with them.
    """
    # With a hold of one's own the scenario's decision period may be no multiple of it; the training's takes its place.
    clock = OVERRIDES if "timing.control_step_s" in own else {}
    bare = load_scenario(scenario, overrides={**clock, **own, _LOOP: own.get(_LOOP, 0.0)})
    if bare.timing.fixed:
        return dict(own)
    return {**OVERRIDES, _LOOP: inner_loop_nms(_LOOP_NMS, FULL_TORQUE_NM, bare), **own}


def recipe_fields(name: str) -> dict[str, Any]:
    """Fields of a training by the name of a scenario, or from a TOML file: a scenario's, or a recipe with such fields.

    A recipe names its ``scenario``; no scenario's file does.

    Raises:
        TrainingError: it can't be read.
    """
    if not name.endswith(".toml"):
        return {"scenario": name}
    try:
        fields = tomllib.loads(user_path(name).read_text(encoding="utf-8"))
    except OSError as error:
        raise TrainingError(
            f"{name} can't be read ({error.strerror}); give a scenario's name, or a TOML file of a scenario or training"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise TrainingError(f"{name} is no TOML ({error}); mend it there") from None
    return fields if "scenario" in fields else {"scenario": name}


TABLES = ("ppo", "network")
"""Fields that are tables."""


def changed_fields(fields: dict[str, Any], changes: Mapping[str, object]) -> dict[str, Any]:
    """Fields of a training with others in their place: its own, or fields of the scenario, which become ``overrides``.

    Args:
        told: of a recipe; changed in place.
        changes: by field, with dots as in ``ppo.gamma``.
    """
    for field, value in changes.items():
        table, dot, _ = field.partition(".")
        if table in (TABLES if dot else Training.model_fields):
            assign(fields, field, value)
        else:
            fields.setdefault("overrides", {})[field] = value
    return fields
