"""Checkpoints of learned policies: one safetensors file.

The file holds the weights, and in its header a ``Card`` as JSON, which says what they were trained on. Loading a
checkpoint executes no code.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pydantic
import safetensors
import safetensors.numpy
from numpy.typing import NDArray

from uuv_marl.atomic import replacing
from uuv_marl.baselines.learned.layers import Architecture, Sizes, shapes
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.sim.observation import observation_layout
from uuv_marl.types import Float32

Row = tuple[str, int, str, float]

WEIGHTS_FILE = "policy.safetensors"
"""The checkpoint within a folder."""
_SHIPPED = Path(__file__).parents[1] / "weights"
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


def vehicle_of(scenario: Scenario) -> dict[str, float | str]:
    """Hull and actuators of a scenario, by field; without the inner loop, which policies declare, and disturbances.

    A field that a vehicle's file may leave out is included only if it differs from its default: checkpoints of hulls
    without lift and rudder do not mention lift and rudder.
    """
    sections = {"vehicle": scenario.vehicle.model_dump(), "actuators": scenario.actuators.model_dump()}
    usual = {
        f"{section}.{name}": field.default
        for section, model in (("vehicle", Vehicle), ("actuators", Actuators))
        for name, field in model.model_fields.items()
        if not field.is_required()
    }
    every = {f"{section}.{name}": value for section, own in sections.items() for name, value in own.items()}
    fields = {field: value for field, value in every.items() if field not in usual or value != usual[field]}
    return {field: value for field, value in fields.items() if field not in _NOT_THE_VEHICLE}


class Card(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Facts about a policy and its training, in the header of its checkpoint."""

    format: Literal[1] = 1
    network: Architecture = Architecture()
    """What the network is made of."""
    filter: bool = False
    """Whether its actions pass the safety filter."""
    base_controller: str = ""
    """Name of the law to whose actions its own are added, if any."""
    percept: tuple[Row, ...]
    """Name, size, unit and scale of every row of the observation as ``closeness``, which the network is given."""
    decision_period_s: pydantic.PositiveFloat
    """Between decisions, in training as in use [s]."""
    yaw_damping_nms: float
    """Inner loop that it was trained with [N m s]."""
    channels: tuple[str, ...] = ()
    """Channels beyond the percept."""
    vehicle: dict[str, float | str]
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
        if self.base_controller:
            return "residual"
        return "end to end + filter" if self.filter else "end to end"

    @property
    def full_torque_nm(self) -> float:
        """Full torque of that vehicle [N m]."""
        return float(self.vehicle.get("actuators.max_torque_nm", Policy.full_torque_nm))

    @property
    def outputs_force(self) -> bool:
        """Whether its actions are forces: where that vehicle has no rudder."""
        return self.vehicle.get("actuators.kind") != "rudder"


class Checkpoint(NamedTuple):
    """A file's content."""

    card: Card
    tensors: Mapping[str, Float32]
    """By name, see ``layers.shapes``."""
    digest: str
    """First 16 hexadecimal digits of the SHA-256 of the tensors' bytes in the file, without the card."""


def card_rows(scenario: Scenario) -> tuple[Row, ...]:
    """What a network is given in a scenario, as a card keeps it."""
    table = observation_layout(scenario, "closeness").table
    return tuple((field.name, field.size, field.kind.unit, field.kind.scale) for field in table)


def card_of(scenario: Scenario, **more: Any) -> Card:
    """The card of a network that was trained on a scenario; ``more`` are its other fields."""
    return Card(
        percept=card_rows(scenario), decision_period_s=scenario.timing.decision_period_s,
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
    """A checkpoint from its file, from the folder that holds it, or by the name of a network that ships.

    Raises:
        PolicyError: there is none, or it can't be used; the message names what is wrong.
    """
    shipped = _SHIPPED / f"{path}.safetensors"
    path = shipped if isinstance(path, str) and path.isidentifier() and shipped.is_file() else user_path(path)
    file = path / WEIGHTS_FILE if path.is_dir() else path
    try:
        data = file.read_bytes()
    except OSError as error:
        raise PolicyError(
            f"policy {str(path)!r} can't be read ({error.strerror}: {file}); give a checkpoint, such as the folder "
            "best of a training, or the name of a network that ships"
        ) from None
    try:
        tensors: dict[str, NDArray[Any]] = safetensors.numpy.load(data)
        start = 8 + int.from_bytes(data[:8], "little")
        header = json.loads(data[8:start])
        card = Card.model_validate_json(header.get("__metadata__", {}).get(_CARD, "null"))
        checkpoint = Checkpoint(card, tensors, hashlib.sha256(data[start:]).hexdigest()[:16])
        _check(checkpoint)
    except (ValueError, KeyError, safetensors.SafetensorError) as error:
        raise PolicyError(
            f"{file} holds no policy of uuv_marl ({_reason(error)}); give a folder that uuv-marl train wrote"
        ) from None
    return checkpoint


def _reason(error: Exception) -> str:
    """What is wrong with a checkpoint, in a line."""
    if isinstance(error, pydantic.ValidationError):
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"]))
        return f"its card's {field}: {first['msg']}" if field else "it has no card"
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)


def _check(checkpoint: Checkpoint) -> None:
    """Raises ValueError that names what can't be run."""
    card, tensors = checkpoint.card, checkpoint.tensors
    for name, shape in shapes(card.network, card.sizes).items():
        array = tensors[name]
        if array.dtype != np.float32 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} {array.shape}, expected float32 {shape}")
        if not (np.abs(array) <= _MOST_WEIGHT).all():  # NaN is not either
            raise ValueError(f"{name} must hold finite numbers of at most {_MOST_WEIGHT:g}")
