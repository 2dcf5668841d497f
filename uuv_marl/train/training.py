"""``Training``: all that a training is. Its TOML is a recipe, and ``config.json`` of a run repeats it."""

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib import resources
from typing import Annotated, Any, Literal, cast

import numpy as np
import pydantic

from uuv_marl.baselines.learned.checkpoint import PERIODS_S
from uuv_marl.baselines.policy import Policy, inner_loop_nms
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import ALL_TRIMS, Trim
from uuv_marl.envs.reward import RewardFunction
from uuv_marl.errors import RewardError, ScenarioError, TrainingError
from uuv_marl.modules import named_object
from uuv_marl.paths import user_path
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.overrides import assign, plain
from uuv_marl.scenario.scale import Scale
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks import Follow
from uuv_marl.tasks.task import paid
from uuv_marl.train.episodes import Conditions, Episodes
from uuv_marl.train.reward import Weights
from uuv_marl.types import Float64

_PERIOD, _LOOP, _LOOP_NMS = "timing.decision_period_s", "actuators.yaw_damping_nms", 600.0
OVERRIDES: Mapping[str, object] = {_PERIOD: 0.5, _LOOP: _LOOP_NMS}
"""What training changes in a scenario of the paper's vehicle: a fifth of the decisions, and an inner loop, as our tuned
policies have it, so that noise on the torque does not spin a vehicle."""
MIXED = ((10, 20), (25, 9), (54, 5), (100, 3))
"""Vehicles and worlds of each swarm: about as many vehicles of each size."""
MIXED_VALIDATION = ((10, 4), (54, 8), (100, 2))
"""Vehicles and episodes of each size."""

Count = Annotated[int, pydantic.Field(ge=1)]
Share = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]
Positive = Annotated[float, pydantic.Field(gt=0.0)]
AsTable = pydantic.PlainSerializer(lambda numbers: numbers._asdict())
"""Numbers are written with their names, as a recipe has them."""


def swarms_of(sizes: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Vehicles and worlds for these sizes: about as many vehicles of each, and in all as many as ``MIXED`` has."""
    share = sum(n * worlds for n, worlds in MIXED) / len(sizes)
    return tuple((n, max(1, round(share / n))) for n in sizes)


def _with_worlds(sizes: Any) -> Any:
    alone = isinstance(sizes, list) and sizes and all(isinstance(n, int) and n > 0 for n in cast(list[Any], sizes))
    return swarms_of(cast(list[int], sizes)) if alone else sizes


class Hyperparameters(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Numbers of MAPPO, see ``uuv_marl.train.mappo``."""

    hidden: tuple[Count, ...] = (96, 96)
    """Units of the actor's and of the critic's layers, tanh."""
    gamma: Share = 0.98
    """Discount per decision; with 0.5 s a horizon of 25 s, about the time that passing an obstacle takes."""
    gae_lambda: Share = 0.95
    """Weight of longer returns in advantages [1]."""
    horizon: Count = 48
    """Decisions between updates."""
    minibatch: Count = 2048
    """Rows of a gradient step, at most."""
    actor_epochs: Count = 3
    critic_epochs: Count = 2
    """Passes over a batch."""
    clip: Positive = 0.2
    """Clip range of PPO's ratio [1]."""
    kl_stop: Positive = 0.02
    """The actor's epochs end where a minibatch diverges further from the policy that sampled it."""
    learning_rate: tuple[Positive, Positive] = (1.5e-3, 1.5e-4)
    """The actor's, at the start and at the end. Where noise is small, so is the share of a return that it caused, and
    steps must be small too."""
    critic_rate: Positive = 1.0
    """The critic's learning rate, in the actor's."""
    critic_first: Share = 0.0
    """Share of the training in which the critic learns alone: an actor that begins well is spoilt by a critic that
    knows nothing (Silver, Allen, Tenenbaum and Kaelbling, Residual policy learning, 2018)."""
    noise: tuple[Positive, Positive] = (0.4, 0.08)
    """Standard deviation of outputs [1], at the start and at the end."""
    shared_noise: Share = 0.0
    """Share of that variance which all vehicles of a world have in common, so that what a swarm does together is
    tried: one vehicle alone moves its centre by 1/n. The objective takes each output as if it were drawn alone."""
    noise_kept: Share = 0.0
    """Share of the noise that is left at the next decision [1]: what takes seconds to show is tried for seconds."""
    first_outputs: tuple[float, ...] = ()
    """Outputs of the actor before it has learned [1]; zeros unless given. A trim that is bounded on one side can't be
    learned from beyond its bound, where it changes nothing: begin on the side where it does."""
    max_gradient: Positive = 1.0
    """Norm to which gradients are clipped."""
    value_decay: Share = 0.99
    """Decay of the running mean and variance by which returns are normalised [1]."""
    average: Share = 0.98
    """Decay per update of the mean over the actor's past weights, which is the policy: the last weights oscillate."""


class Training(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """A training, field by field.

    Raises:
        TrainingError: a field is unknown or can't be used; the message names it, its value and the remedy.
        ScenarioError: the scenario can't be used.
    """

    title: str = ""
    """What it is for, in words."""

    # What is trained on.
    scenario: str = "random_field"
    """Name or TOML file."""
    overrides: dict[str, Any] = {}
    """Fields of the scenario that differ from its file; ``OVERRIDES`` are added where they are not here."""
    sizes: Annotated[tuple[tuple[Count, Count], ...], pydantic.BeforeValidator(_with_worlds)] = ()
    """Vehicles and worlds of each swarm, or vehicles alone (``swarms_of``). If empty: 10 to 100 vehicles at once
    (``MIXED``), or only swarms of the scenario's own size where ``overrides`` name it, or it is another than usual."""
    episodes: Episodes | None = None
    """What differs from one episode to the next."""

    # What is paid.
    weights: Annotated[Weights, AsTable] = Weights()
    """Weights of the training's reward."""
    reward: str | None = None
    """A reward of one's own in its place, ``module:function``: from the swarm after a decision to an array (world,
    vehicle)."""

    # What acts.
    sees: Literal["percept", "memory"] = "percept"
    """What the actor sees: features of one percept, its output being a force; or ``memory``, what is remembered, its
    output trimming the gains of ``law``, inside the safety filter."""
    held_s: float = pydantic.Field(0.0, ge=0.0, le=10.0)
    """An output of the actor is held for so long [s], rounded to whole decisions; 0: for one decision."""
    law: Annotated[ScoutGains, AsTable] = ScoutGains()
    """With memory: of the hand-made law that the actor trims."""
    safety: Annotated[Barrier, AsTable] = Barrier()
    """With memory: margins and rates of the safety filter."""
    trims: tuple[Trim] = ALL_TRIMS
    """With memory: what the actor changes."""

    # How it learns, and for how long.
    mappo: Hyperparameters = Hyperparameters()
    """Numbers of the algorithm."""
    steps: Count = 30_000_000
    """Agent-steps: one is one decision of one vehicle. Annealing ends here."""
    seed: int = pydantic.Field(0, ge=0)
    """Of weights, worlds, noise and drawn conditions: it fixes a training."""
    start: str | None = None
    """A folder with a learner to start from: ``best`` or a checkpoint of another training."""
    device: str = "cpu"
    """Torch's name of where networks and batches are: cpu, cuda. Worlds are always on the CPU."""

    # How it is judged and kept.
    validation: tuple[tuple[Count, Count], ...] = ()
    """Vehicles and episodes of each size. If empty: those of ``MIXED_VALIDATION``, or four of each size trained on."""
    validate_every: Count = 20
    """Iterations; a multiple of ``checkpoint_every`` wastes least where a training is cut off."""
    checkpoint_every: Count = 20
    """Iterations."""
    chosen: Literal["best", "last"] = "best"
    """Which policy ``best`` holds: that of the best validation, or the last one."""

    def __init__(self, **told: Any) -> None:
        try:
            super().__init__(**plain(told))
        except pydantic.ValidationError as error:
            raise _explained(error) from None

    @pydantic.model_validator(mode="after")
    def _whole(self) -> "Training":
        """Fill sizes in, and refuse what can't be run."""
        usual = load_scenario(Training.model_fields["scenario"].default).swarm.num_vehicles
        n = self.loaded.swarm.num_vehicles
        mixed = "swarm.num_vehicles" not in self.overrides and n == usual
        sizes = self.sizes or (MIXED if mixed else swarms_of([n]))
        validation = self.validation or (MIXED_VALIDATION if sizes == MIXED else tuple((n, 4) for n, _ in sizes))
        object.__setattr__(self, "sizes", sizes)
        object.__setattr__(self, "validation", validation)
        if len(self.mappo.first_outputs) not in (0, self.outputs):
            raise TrainingError(
                f"mappo.first_outputs must have a number for each of {self.outputs} outputs, got "
                f"{len(self.mappo.first_outputs)}"
            )
        _need_periods(self)
        return self

    @property
    def outputs(self) -> int:
        """Numbers that the actor gives for a vehicle: one for each trim, or a force."""
        return len(self.trims) if self.sees == "memory" else 2

    @cached_property
    def loaded(self) -> Scenario:
        """The scenario that is trained on."""
        return in_si_units(load_scenario(self.scenario, overrides=overrides_for(self.scenario, self.overrides)))

    @cached_property
    def loaded_for_validation(self) -> Scenario:
        """The scenario that is validated on: that of the training, but with the benchmark's decision period."""
        kept = {
            field: value for field, value in overrides_for(self.scenario, self.overrides).items() if field != _PERIOD
        }
        return load_scenario(self.scenario, overrides=kept)

    @cached_property
    def conditions(self) -> Conditions:
        """Fields of the scenario for one episode: every world goes through these, an episode each, in this order."""
        return self.episodes.draw(self.scenario, self.seed) if self.episodes else ()

    @cached_property
    def validation_conditions(self) -> Conditions:
        """Fields of the scenario of further validation episodes."""
        return self.episodes.draw_validated(self.scenario) if self.episodes else ()

    @cached_property
    def paid(self) -> RewardFunction:
        """What vehicles are paid for a decision. Raises RewardError where it can't be imported.

        Without ``reward`` these are the ``weights`` in ``follow``, and in another task what the task itself pays.
        """
        if self.reward is None:
            return self.weights if issubclass(self.loaded.task_class, Follow) else own_pay
        try:
            function = named_object(self.reward)
        except ImportError as error:
            raise RewardError(f"reward {self.reward!r} {error}; give module:function") from None
        if not callable(function):
            raise RewardError(f"reward {self.reward!r} must be a function of the swarm, got {function!r}")
        return cast(RewardFunction, function)


def own_pay(swarm: Swarm) -> Float64:
    """What a swarm's task pays for the latest decision by its first reward, shape (world, vehicle)."""
    return paid(swarm.task, np.ones(swarm.num_worlds, np.bool_)).reward


def overrides_for(scenario: str, own: Mapping[str, object]) -> dict[str, object]:
    """What training changes in a scenario: ``OVERRIDES``, with the inner loop of its vehicle, and fields of one's own.

    Args:
        scenario: name or TOML file.
        own: go before the others; they may name another vehicle.

    Raises:
        ScenarioError: the scenario can't be loaded with them, or is in another scale.
    """
    # Before the decision period, which is no multiple of a hold in another scale, so that the scale is what is named.
    clock = OVERRIDES if "timing.control_hold_s" in own else {}
    bare = in_si_units(load_scenario(scenario, overrides={**clock, **own, _LOOP: own.get(_LOOP, 0.0)}))
    return {**OVERRIDES, _LOOP: inner_loop_nms(_LOOP_NMS, Policy.full_torque_nm, bare), **own}


def in_si_units(scenario: Scenario) -> Scenario:
    """The scenario. Raises ScenarioError for one in a vehicle's scale, in whose units learners do not read percepts."""
    if scenario.scale == Scale():
        return scenario
    raise ScenarioError(
        f"scale = 'vehicle' puts scenario {scenario.name!r} into the scale of {scenario.vehicle.name}, which training "
        "does not know; leave scale out, and set trajectory.speed_mps and start.speed_max_mps"
    )


def _need_periods(training: Training) -> None:
    """Raise ScenarioError where a policy would be trained or validated at a period that it can't be run with."""
    drawn = [float(str(c[_PERIOD])) for c in (*training.conditions, *training.validation_conditions)]
    of = f"{_PERIOD} of scenario {training.loaded.name!r}"
    periods = [(training.loaded.timing.decision_period_s, of), *((t, f"{_PERIOD} of an episode") for t in drawn)]
    judged = training.loaded_for_validation.timing.decision_period_s
    for period, what in [*periods, (judged, f"{of}, with which policies are validated,")]:
        if not PERIODS_S[0] - 1e-9 <= period <= PERIODS_S[1] + 1e-9:
            raise ScenarioError(
                f"{what} is {period:g}, but trained policies decide every {PERIODS_S[0]:g} to {PERIODS_S[1]:g} s; "
                "choose a period in this range"
            )


def recipes() -> Sequence[str]:
    """Names of the recipes that come with the package."""
    return sorted(path.name.removesuffix(".toml") for path in _folder().iterdir() if path.name.endswith(".toml"))


def _folder() -> Any:
    return resources.files("uuv_marl.train") / "recipes"


def read_recipe(name: str) -> dict[str, Any]:
    """The fields that a recipe gives, by its name or from a TOML file: ``Training(**read_recipe("mappo"))``.

    Raises:
        TrainingError: it can't be read.
    """
    path = user_path(name) if name.endswith(".toml") else _folder() / f"{name}.toml"
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TrainingError(
            f"recipe {name!r} can't be read ({error.strerror}); give one of {', '.join(recipes())}, or a TOML file"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise TrainingError(f"recipe {name!r} is no TOML ({error}); mend it there") from None


TABLES: Mapping[str, Sequence[str]] = {
    "": [*Training.model_fields], "mappo": [*Hyperparameters.model_fields], "episodes": [*Episodes.model_fields],
    "weights": Weights._fields, "law": ScoutGains._fields, "safety": Barrier._fields,
}  # fmt: skip
"""Names of all fields, by table."""


def changed_fields(told: dict[str, Any], changes: Mapping[str, object]) -> dict[str, Any]:
    """Fields of a training with others in their place: its own, or fields of the scenario, which become ``overrides``.

    Args:
        told: of a recipe; changed in place.
        changes: by field, with dots as in ``mappo.gamma``.
    """
    for field, value in changes.items():
        table, dot, _ = field.partition(".")
        if table in (TABLES if dot else Training.model_fields):
            assign(told, field, value)
        else:
            told.setdefault("overrides", {})[field] = value
    return told


def _explained(error: pydantic.ValidationError) -> Exception:
    """What is wrong first, as an error of ours."""
    first = error.errors()[0]
    if first["type"] == "value_error" and "ctx" in first:
        told = first["ctx"]["error"]
        return told if isinstance(told, ScenarioError | TrainingError) else TrainingError(str(told))
    *place, last = map(str, first["loc"])
    field = ".".join([*place, last])
    if first["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        there = TABLES.get(".".join(place), ())
        near = difflib.get_close_matches(last, there, n=1)
        remedy = f"did you mean {near[0]!r}?" if near else f"the fields here are {', '.join(there)}"
        return TrainingError(f"{field} is unknown; {remedy}")
    return TrainingError(f"{field} {first['msg'].removeprefix('Input ')}, got {first['input']!r}")
