"""Checkpoints of learned policies: one safetensors file.

The file holds the weights, and in its header a ``Card`` as JSON, which says what they were trained on. Loading a
checkpoint executes no code.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, cast

import numpy as np
import pydantic
import safetensors
import safetensors.numpy
from numpy.typing import NDArray

from uuv_marl.atomic import replacing
from uuv_marl.baselines.learned.layers import Architecture, Sizes, shapes
from uuv_marl.baselines.learned.memory_features import NUM_MEMORY_FEATURES
from uuv_marl.baselines.learned.percept_features import BARRIER, num_features
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import ALL_TRIMS, Trim
from uuv_marl.paths import UserPath, user_path
from uuv_marl.percept import percept_table
from uuv_marl.scenario import Scenario, load_vehicle
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.sim.observation import observation_layout
from uuv_marl.types import Float32

Row = tuple[str, int, str, float]
Features = Literal["closeness", "percept", "memory"]

WEIGHTS_FILE = "policy.safetensors"
"""The checkpoint within a folder."""
_CARD = "uuv_marl"
_MOST_WEIGHT = 1e6
"""Larger weights are no result of training, and overflow in single precision."""
_NOT_THE_VEHICLE = {
    "vehicle.name",
    "vehicle.length_m",
    "vehicle.cruise_mps",
    "vehicle.max_mps",
    "vehicle.source",
    "actuators.yaw_damping_nms",
    "actuators.thrust_lag_s",
    "actuators.yaw_lag_s",
    "actuators.yaw_authority",
}
PERIODS_S = (0.1, 0.5)
"""Shortest and longest period between decisions that a policy of a training may be run with [s]."""
_FIRST_VEHICLE = "literature_185"
"""The vehicle of version 0.1.0, which wrote checkpoints without saying so."""


def vehicle_of(scenario: Scenario) -> dict[str, float | str]:
    """Hull and actuators of a scenario, by field; without the inner loop, which policies declare, and disturbances.

    A field that a vehicle's file may leave out is included only if it differs from its default: checkpoints of hulls
    without lift and rudder do not mention lift and rudder.
    """
    return _numbers({"vehicle": scenario.vehicle.model_dump(), "actuators": scenario.actuators.model_dump()})


def _numbers(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, float | str]:
    usual = {
        f"{section}.{name}": field.default
        for section, model in (("vehicle", Vehicle), ("actuators", Actuators))
        for name, field in model.model_fields.items()
        if not field.is_required()
    }
    every = {f"{section}.{name}": value for section, own in sections.items() for name, value in own.items()}
    kept = {field: value for field, value in every.items() if field not in usual or value != usual[field]}
    return {field: value for field, value in kept.items() if field not in _NOT_THE_VEHICLE}


def _all_gains(gains: Any) -> Any:
    if isinstance(gains, list) and len(cast(list[Any], gains)) != len(BioInspiredGains._fields):
        raise ValueError(f"must hold {', '.join(BioInspiredGains._fields)}, got {gains}")
    return cast(Any, gains)


class Card(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Facts about a policy and its training, in the header of its checkpoint."""

    format: Literal[1] = 1
    kind: Literal["mlp"] = "mlp"
    """What the tensors are: ``mlp``, tanh layers."""
    features: Features = "percept"
    """What the network is given: ``closeness``, an environment's observation, of which it makes an action; from the
    first trainer ``percept``, features of one percept of which it makes a force, or ``memory``, features of what is
    remembered, by which it trims ``law``."""
    network: Architecture = Architecture()
    """With ``closeness``: what it is made of."""
    filter: bool = False
    """Whether its actions pass the safety filter."""
    around: str = ""
    """Name of the law to whose actions its own are added, if any."""
    percept: tuple[Row, ...]
    """Name, size, unit and scale of every field of the percept, or of the observation as ``closeness``."""
    decision_period_s: tuple[float, float] = PERIODS_S
    """Shortest and longest period between decisions that it may be run with [s]."""
    yaw_damping_nms: float = 600.0
    """Inner loop that it was trained with [N m s]."""
    channels: tuple[str, ...] = ()
    """Channels beyond the percept."""
    barrier: Annotated[BioInspiredGains, pydantic.BeforeValidator(_all_gains)] = BARRIER
    """Gains of Eq. 20-21, whose force is added to what an actor without memory says."""
    law: ScoutGains = ScoutGains()
    """Gains of ``scout``'s law, which an actor with memory trims."""
    trims: tuple[Trim] = ALL_TRIMS
    """What such an actor trims, in the order of its outputs."""
    safety: Barrier = Barrier()
    """Margins and rates of the filter around it."""
    vehicle: dict[str, float | str] = pydantic.Field(default_factory=lambda: _numbers(load_vehicle(_FIRST_VEHICLE)))
    """Hull and actuators that it was trained on, by field of the scenario."""
    training: dict[str, Any] = {}
    """How it came about: settings, versions, agent-steps, validation."""

    @property
    def sizes(self) -> Sizes:
        """Name and entries of every row of ``percept``."""
        return [(name, size) for name, size, _, _ in self.percept]

    @property
    def policy_class(self) -> str:
        """What decides beside the network: nothing, the filter, a law."""
        if self.around or self.features != "closeness":
            return "around a law"
        return "end to end + filter" if self.filter else "end to end"

    @property
    def full_torque_nm(self) -> float:
        """Full torque of that vehicle [N m]."""
        return float(self.vehicle.get("actuators.max_torque_nm", Policy.full_torque_nm))

    @property
    def wishes_force(self) -> bool:
        """Whether its actions are forces: those of the law that it trims are; else where that vehicle has no rudder."""
        return self.features == "memory" or self.vehicle.get("actuators.kind") != "rudder"


class Layer(NamedTuple):
    """Weight (in, out) and bias (out,)."""

    weight: Float32
    bias: Float32


class Checkpoint(NamedTuple):
    """A file's content."""

    card: Card
    tensors: Mapping[str, Float32]
    """By name, see ``layers.shapes``."""
    digest: str
    """First 16 hexadecimal digits of the whole file's SHA-256."""

    @property
    def layers(self) -> tuple[Layer, ...]:
        """Those of a network of the first trainer."""
        numbers = range(max(len(self.tensors) // 2, 1))
        return tuple(Layer(self.tensors[f"{k}.weight"], self.tensors[f"{k}.bias"]) for k in numbers)


def card_rows(scenario: Scenario, features: Features = "closeness") -> tuple[Row, ...]:
    """What a network is given in a scenario, as a card keeps it; rows of the task only with ``closeness``."""
    sonar = scenario.sonar
    if features == "closeness":
        table = observation_layout(scenario, "closeness").table
    else:
        table = percept_table(sonar.num_sectors, sonar.num_active_sectors, sonar.channels)
    return tuple((field.name, field.size, field.kind.unit, field.kind.scale) for field in table)


def card_of(scenario: Scenario, **more: Any) -> Card:
    """The card of a network that was trained on a scenario; ``more`` are its other fields."""
    period = scenario.timing.decision_period_s
    return Card(
        features="closeness", percept=card_rows(scenario), decision_period_s=(period, period),
        yaw_damping_nms=scenario.actuators.yaw_damping_nms, channels=scenario.sonar.channels,
        vehicle=vehicle_of(scenario), **more,
    )  # fmt: skip


def is_checkpoint(name: str) -> bool:
    """Whether a policy's name means a file or folder."""
    return "/" in name or os.sep in name or (":" not in name and user_path(name).exists())


def save_checkpoint(path: UserPath, card: Card, tensors: Mapping[str, NDArray[Any]]) -> None:
    """Write a checkpoint file, whole or not at all; ``tensors`` by name, as ``layers.shapes`` has them."""
    path = user_path(path)
    contiguous = {name: np.ascontiguousarray(array, np.float32) for name, array in tensors.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        partial.write_bytes(safetensors.numpy.save(contiguous, {_CARD: card.model_dump_json()}))


def load_checkpoint(path: UserPath) -> Checkpoint:
    """A checkpoint from its file, or from the folder that holds it. Raises PolicyError naming what is wrong."""
    path = user_path(path)
    file = path / WEIGHTS_FILE if path.is_dir() else path
    try:
        data = file.read_bytes()
    except OSError as error:
        raise PolicyError(
            f"policy {str(path)!r} can't be read ({error.strerror}: {file}); give a checkpoint, such as the folder "
            "best of a training"
        ) from None
    try:
        tensors: dict[str, NDArray[Any]] = safetensors.numpy.load(data)
        header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
        card = Card.model_validate_json(header.get("__metadata__", {}).get(_CARD, "null"))
        made = Checkpoint(card, tensors, hashlib.sha256(data).hexdigest()[:16])
        _check(made)
    except (ValueError, KeyError, safetensors.SafetensorError) as error:
        raise PolicyError(
            f"{file} holds no policy of uuv_marl ({_reason(error)}); give a folder that uuv-marl train wrote"
        ) from None
    return made


def _reason(error: Exception) -> str:
    """What is wrong with a checkpoint, in a line."""
    if isinstance(error, pydantic.ValidationError):
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"]))
        return f"its card's {field}: {first['msg']}" if field else "it has no card"
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)


def _check(made: Checkpoint) -> None:
    """Raises ValueError that names what can't be run."""
    card, tensors = made.card, made.tensors
    if not 0.0 < card.decision_period_s[0] <= card.decision_period_s[1]:
        raise ValueError(f"its card's decision_period_s must be [shortest, longest], got {card.decision_period_s}")
    expected = shapes(card.network, card.sizes) if card.features == "closeness" else _first_shapes(made)
    for name, shape in expected.items():
        array = tensors[name]
        if array.dtype != np.float32 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} {array.shape}, expected float32 {shape}")
        if not (np.abs(array) <= _MOST_WEIGHT).all():  # NaN is not either
            raise ValueError(f"{name} must hold finite numbers of at most {_MOST_WEIGHT:g}")


def _first_shapes(made: Checkpoint) -> dict[str, tuple[int, ...]]:
    """Shapes of the tensors of a network of the first trainer: layers of any width, one after the other."""
    card, sizes = made.card, dict(made.card.sizes)
    remembers, found = card.features == "memory", dict[str, tuple[int, ...]]()
    width = NUM_MEMORY_FEATURES if remembers else num_features(sizes["heard"], sizes.get("echo", 0))
    for k, (weight, _) in enumerate(made.layers):
        inner = weight.ndim == 2 and k < len(made.layers) - 1
        outputs = weight.shape[-1] if inner else len(card.trims) if remembers else 2
        found |= {f"{k}.weight": (width, outputs), f"{k}.bias": (outputs,)}
        width = outputs
    return found
