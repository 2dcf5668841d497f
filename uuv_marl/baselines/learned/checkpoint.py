"""Checkpoints of learned policies: one safetensors file.

The file holds the weights, and in its header a ``Card`` as JSON that describes the training. Loading a checkpoint
executes no code.
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
from uuv_marl.baselines.requirements import FULL_TORQUE_NM, PolicyRequirements
from uuv_marl.errors import PolicyError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.messages import explain
from uuv_marl.sim.observation import observation_layout
from uuv_marl.types import Float32

Row = tuple[str, int, str, float]

WEIGHTS_FILE = "policy.safetensors"  # the checkpoint within a folder
_SHIPPED = Path(__file__).parents[1] / "weights"
_CARD = "uuv_marl"
_MOST_WEIGHT = 1e6  # largest valid weight; larger ones overflow in single precision
_NOT_THE_VEHICLE = {
    "vehicle.name", "vehicle.length_m", "vehicle.cruise_mps", "vehicle.max_mps", "vehicle.source",
    "actuators.yaw_damping_nms", "actuators.thrust_lag_s", "actuators.yaw_lag_s", "actuators.yaw_authority",
}  # fmt: skip


def vehicle_of(scenario: Scenario) -> dict[str, float | str]:
    """Hull and actuators of a scenario, by field; without the inner loop, which policies require, and disturbances.

    An optional field of a vehicle's file is included only if it differs from its default: checkpoints of hulls without
    lift and rudder do not mention them.
    """
    sections = {"vehicle": scenario.vehicle, "actuators": scenario.actuators}
    fields = {
        f"{section}.{name}": value
        for section, model in sections.items()
        for name, value in model.model_dump(exclude_defaults=True).items()
    }
    return {field: value for field, value in fields.items() if field not in _NOT_THE_VEHICLE}


class Card(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Description of a policy and its training, in the header of its checkpoint."""

    format: Literal[1] = 1
    network: Architecture = Architecture()
    """Architecture of the network."""
    filter: bool = False
    """Whether the safety filter changes its actions."""
    base_controller: str = ""
    """Name of the controller to whose actions the network's are added, if any."""
    percept: tuple[Row, ...]
    """Name, size, unit and scale of every row of the observation as ``closeness``, the network's input."""
    decision_period_s: pydantic.PositiveFloat
    """Decision period, in training as in use [s]."""
    yaw_damping_nms: float
    """Inner loop of the training [N m s]."""
    channels: tuple[str, ...] = ()
    """Channels beyond the percept."""
    message_entries: int = 0
    """Numbers in a message that the network sends."""
    message_vectors: int = 0
    """Vectors among them."""
    vehicle: dict[str, float | str]
    """Hull and actuators of the training, by field of the scenario."""
    training: dict[str, Any] = {}
    """Origin: settings, versions, agent-steps, validation."""

    @property
    def sizes(self) -> Sizes:
        """Name and entries of every row of ``percept``."""
        return [(name, size) for name, size, _, _ in self.percept]

    @property
    def policy_class(self) -> str:
        """What acts besides the network: nothing, the safety filter, a base controller."""
        if self.base_controller:
            return "residual"
        return "end to end + filter" if self.filter else "end to end"

    @property
    def requirements(self) -> PolicyRequirements:
        """Channels, inner loop and decision period of the training; outputs are forces unless it had a rudder."""
        torque = float(self.vehicle.get("actuators.max_torque_nm", FULL_TORQUE_NM))
        force = self.vehicle.get("actuators.kind") != "rudder"
        return PolicyRequirements(
            self.channels, self.yaw_damping_nms, torque, self.decision_period_s, outputs_force=force,
            message_entries=self.message_entries, message_vectors=self.message_vectors,
        )  # fmt: skip


class Checkpoint(NamedTuple):
    """Content of a file."""

    card: Card
    tensors: Mapping[str, Float32]
    """By name, see ``layers.shapes``."""
    digest: str
    """First 16 hexadecimal digits of the SHA-256 of the tensors' bytes in the file, without the card."""


def card_rows(scenario: Scenario) -> tuple[Row, ...]:
    """Rows of a network's input in a scenario, as in ``Card.percept``."""
    table = observation_layout(scenario, "closeness").table
    return tuple((field.name, field.size, field.quantity.unit, field.quantity.scale) for field in table)


def card_of(scenario: Scenario, **more: Any) -> Card:
    """The card of a network trained on a scenario; ``more`` are its other fields."""
    return Card(
        percept=card_rows(scenario), decision_period_s=scenario.timing.decision_period_s,
        yaw_damping_nms=scenario.actuators.yaw_damping_nms, channels=scenario.sonar.channels,
        vehicle=vehicle_of(scenario), message_entries=scenario.modem.message_entries,
        message_vectors=scenario.modem.message_vectors, **more,
    )  # fmt: skip


def is_checkpoint(name: str) -> bool:
    """Whether a policy's name is a file or folder."""
    return "/" in name or os.sep in name or (":" not in name and user_path(name).exists())


def save_checkpoint(path: UserPath, card: Card, tensors: Mapping[str, NDArray[Any]]) -> None:
    """Write a checkpoint file atomically; ``tensors`` by name, as in ``layers.shapes``."""
    path = user_path(path)
    contiguous = {name: np.ascontiguousarray(array, np.float32) for name, array in tensors.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        partial.write_bytes(safetensors.numpy.save(contiguous, {_CARD: card.model_dump_json()}))


def load_checkpoint(path: UserPath) -> Checkpoint:
    """A checkpoint from its file, from the folder that holds it, or by the name of a network that ships.

    Raises PolicyError if it is missing or invalid.
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
    """The first problem of a checkpoint, in a line."""
    if isinstance(error, pydantic.ValidationError):
        return f"its card's {explain(error, None, Card)}" if error.errors()[0]["loc"] else "it has no card"
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)


def _check(checkpoint: Checkpoint) -> None:
    """Raise ValueError if weights are missing, not finite, or of another shape than the card's."""
    card, tensors = checkpoint.card, checkpoint.tensors
    for name, shape in shapes(card.network, card.sizes, 2 + card.message_entries).items():
        array = tensors[name]
        if array.dtype != np.float32 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} {array.shape}, expected float32 {shape}")
        if not (np.abs(array) <= _MOST_WEIGHT).all():  # NaN is not either
            raise ValueError(f"{name} must hold finite numbers of at most {_MOST_WEIGHT:g}")
