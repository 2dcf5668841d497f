"""Learned policies: an actor from a checkpoint, in NumPy, beside a fixed short-range barrier.

A checkpoint is one safetensors file: the weights, and in its header a ``Card`` as JSON, which says what they were
trained on. Loading it executes nothing.
"""

import functools
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, cast

import numpy as np
import pydantic
import safetensors
import safetensors.numpy
from numpy.typing import NDArray

from uuv_marl.atomic import replacing
from uuv_marl.baselines.bio_inspired import Gains, neighbour_force, obstacle_force
from uuv_marl.baselines.policy import Limits, Policy, PolicyError
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.scenario import Scenario, load_vehicle
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.vehicle import project
from uuv_marl.sim.views import Starts, fields

Float32 = NDArray[np.float32]
Int64 = NDArray[np.int64]
Row = tuple[str, int, str, float]

WEIGHTS_FILE = "policy.safetensors"
"""The checkpoint within a folder."""
BARRIER = Gains(zeta_l=0.0, zeta_n=0.8, delta_n=35.0, zeta_o=0.3, delta_o=140.0)
"""Eq. 20-21 at short range, without the pull to l(t): half the paper's delta_n, and weaker but steeper at obstacles."""
MOST_BARRIER = 8.0
"""The barrier is bounded here [full force]; the action is bounded by 1 after the sum."""
_CARD = "uuv_marl"
_MOST_WEIGHT = 1e6
"""Larger weights are no result of training, and overflow in single precision."""
_FIRST_VEHICLE = "literature_185"
"""The vehicle of version 0.1.0, which wrote checkpoints without saying so."""


NOT_THE_VEHICLE = ("name", "yaw_damping_nms", "thrust_lag_s", "yaw_lag_s", "yaw_authority")
"""Fields in which a scenario may differ from a training's: the inner loop, which policies declare themselves, and what
disturbs the actuators, like all that disturbs a vehicle."""


def vehicle_of(scenario: Scenario) -> dict[str, float]:
    """Hull and actuators of a scenario, by field; without ``NOT_THE_VEHICLE``."""
    return _numbers({"vehicle": scenario.vehicle.model_dump(), "actuators": scenario.actuators.model_dump()})


def _numbers(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    every = {f"{section}.{name}": value for section, own in sections.items() for name, value in own.items()}
    return {field: every[field] for field in every if field.partition(".")[2] not in NOT_THE_VEHICLE}


def _all_gains(gains: Any) -> Any:
    if isinstance(gains, list) and len(cast(list[Any], gains)) != len(Gains._fields):
        raise ValueError(f"must hold {', '.join(Gains._fields)}, got {gains}")
    return cast(Any, gains)


class Card(pydantic.BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """What a checkpoint says of itself."""

    format: Literal[1] = 1
    kind: Literal["mlp"] = "mlp"
    """What the tensors are: ``mlp``, tanh layers."""
    features: Literal["percept"] = "percept"
    """What the first layer is given: ``percept``, what ``Features`` make of one percept."""
    percept: tuple[Row, ...]
    """Name, size, unit and scale of every field of the percept."""
    decision_period_s: tuple[float, float] = (0.1, 0.5)
    """Shortest and longest period between decisions that it may be run with [s]."""
    yaw_damping_nms: float = 600.0
    """Inner loop that it was trained with [N m s]."""
    channels: tuple[str, ...] = ()
    """Channels beyond the percept."""
    barrier: Annotated[Gains, pydantic.BeforeValidator(_all_gains)] = BARRIER
    """Of Eq. 20-21; what the actor says is added to their force."""
    vehicle: dict[str, float] = pydantic.Field(default_factory=lambda: _numbers(load_vehicle(_FIRST_VEHICLE)))
    """Hull and actuators that it was trained on, by field of the scenario."""
    training: dict[str, Any] = {}
    """How it came about: settings, versions, agent-steps, validation."""


class Layer(NamedTuple):
    """Weight (in, out) and bias (out,)."""

    weight: Float32
    bias: Float32


class Checkpoint(NamedTuple):
    """A file's content."""

    card: Card
    layers: tuple[Layer, ...]
    digest: str
    """Of the whole file."""


class Learned(Policy):
    """A checkpoint's actor: tanh layers from local, body-frame features to a force, plus the barrier. Deterministic.

    Args:
        scenario: gives the percept's layout and the vehicle's limits.
        num_worlds: first axis of the percepts.
        trained: the actor, and the name by which messages call it.
        any_vehicle: run it also on a vehicle that it was not trained on.

    Raises:
        PolicyError: the scenario has another percept, period, inner loop or vehicle than the training had.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, trained: "Trained", any_vehicle: bool = False
    ) -> None:
        self.name, self.checkpoint, card = trained.name, trained.checkpoint, trained.checkpoint.card
        self.channels, self.yaw_damping_nms = card.channels, card.yaw_damping_nms  # pyright: ignore[reportAttributeAccessIssue] - an instance's own
        super().__init__(scenario, num_worlds)
        tables = ({f"field {k}": row for k, row in enumerate(rows)} for rows in (card.percept, rows_of(self.layout)))
        vehicles = () if any_vehicle else (card.vehicle, vehicle_of(scenario))
        for what, other, remedy in (
            ("percept", _difference(*tables), "use a scenario with the sonar suite of its training"),
            (
                "vehicle",
                vehicles and _difference(*vehicles),
                "leave it out, run it all the same with make(..., any_vehicle=True)",
            ),
        ):
            if other:
                raise PolicyError(
                    f"{self.name} was trained on another {what} than scenario {scenario.name!r} has: {other}; {remedy}"
                    ", or train on this one (uuv-marl train mappo --scenario)"
                )
        shortest, longest = card.decision_period_s
        if not shortest - 1e-9 <= scenario.timing.decision_period_s <= longest + 1e-9:
            raise PolicyError(
                f"{self.name} decides every {shortest:g} to {longest:g} s, and scenario {scenario.name!r} every "
                f"{scenario.timing.decision_period_s:g} s; override timing.decision_period_s"
            )
        self._features = Features(scenario, card.barrier)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        acting = np.flatnonzero(self.active)
        flat = self.flat(percept)
        worlds, n = len(acting), flat.shape[1]
        features, barrier = np.empty((worlds, n, self._features.size), np.float32), np.empty((worlds, n, 2), np.float32)
        clamps = np.zeros(worlds, np.int64)
        self._features.look(flat[acting], features, barrier, clamps)
        self.clamps[acting] += clamps
        wish = forward(self.checkpoint.layers, features.reshape(worlds * n, -1))
        action = np.empty((worlds * n, 2), np.float32)
        _add(wish, barrier.reshape(worlds * n, 2), action)
        whole = np.zeros((len(self.active), n, 2), np.float32)
        whole[acting] = action.reshape(worlds, n, 2)
        return whole


class Features:
    """What actors see of a percept: bounded features, the same in training and in use, and the barrier's force.

    Args:
        scenario: gives the percept's layout and the vehicle's limits.
        gains: the barrier's.
    """

    def __init__(self, scenario: Scenario, gains: Gains) -> None:
        self._at = PerceptLayout.of(scenario).offsets
        self._gains = gains
        self._limits = Limits.of(scenario)
        self.size = 11 + 4 * scenario.sonar.num_sectors + 4 * scenario.sonar.num_active_sectors

    def look(self, flat: Float32, features: Float32, barrier: Float32, clamps: Int64) -> None:
        """Fill features (world, vehicle, size) and barrier (world, vehicle, 2) [full force] from flat percepts.

        ``clamps`` (world,) counts numerical bounds that bound.
        """
        _look(flat, self._at, self._gains, self._limits, features, barrier, clamps)


def forward(layers: Sequence[Layer], x: Float32) -> Float32:
    """The network's output (row, out) for inputs (row, in): tanh between layers, none after the last.

    A row's result does not depend on the rows beside it, which a BLAS library does not promise.
    """
    for k, layer in enumerate(layers):
        y = np.empty((len(x), len(layer.bias)), np.float32)
        _dense(x, layer.weight, layer.bias, y)
        x = np.tanh(y) if k < len(layers) - 1 else y
    return x


def rows_of(layout: PerceptLayout) -> tuple[Row, ...]:
    """A percept's table as a card keeps it."""
    return tuple((field.name, field.size, field.kind.unit, field.kind.scale) for field in layout.table)


def is_checkpoint(name: str) -> bool:
    """Whether a policy's name means a file or folder."""
    return "/" in name or os.sep in name or (":" not in name and Path(name).exists())


class Trained:
    """A learned policy before it is made for a scenario: call it with the arguments of ``Learned``.

    Args:
        name: by which messages call it.
        path: of the checkpoint, a file or the folder that holds it; read when something of it is asked for.
        doc: what it is.
    """

    def __init__(self, name: str, path: Path, doc: str | None = Learned.__doc__) -> None:
        self.name, self._path, self.__doc__ = name, path, doc

    @functools.cached_property
    def checkpoint(self) -> Checkpoint:
        """What the file holds. Raises PolicyError where that is no policy."""
        return load_checkpoint(self._path)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels needed beyond the percept."""
        return self.checkpoint.card.channels

    @property
    def yaw_damping_nms(self) -> float:
        """Inner loop that it was trained with [N m s]."""
        return self.checkpoint.card.yaw_damping_nms

    def __call__(self, scenario: Scenario, num_worlds: int = 1, *, any_vehicle: bool = False) -> Learned:
        """The policy for a scenario. Raises PolicyError as ``Learned`` does."""
        return Learned(scenario, num_worlds, trained=self, any_vehicle=any_vehicle)


def shipped(name: str, doc: str) -> Trained:
    """The policy of a checkpoint in ``uuv_marl/baselines/trained``."""
    return Trained(name, Path(__file__).parent / "trained" / f"{name}.safetensors", doc)


def save_checkpoint(path: Path, card: Card, layers: Sequence[Layer]) -> None:
    """Write a checkpoint file, whole or not at all."""
    tensors = {f"{k}.{name}": array for k, layer in enumerate(layers) for name, array in layer._asdict().items()}
    contiguous = {name: np.ascontiguousarray(array, np.float32) for name, array in tensors.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        partial.write_bytes(safetensors.numpy.save(contiguous, {_CARD: card.model_dump_json()}))


def load_checkpoint(path: Path) -> Checkpoint:
    """A checkpoint from its file, or from the folder that holds it. Raises PolicyError naming what is wrong."""
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
        layers = tuple(Layer(tensors[f"{k}.weight"], tensors[f"{k}.bias"]) for k in range(max(len(tensors) // 2, 1)))
        _check(card, layers)
    except (ValueError, KeyError, safetensors.SafetensorError) as error:
        raise PolicyError(
            f"{file} holds no policy of uuv_marl ({_reason(error)}); give a folder that uuv-marl train wrote"
        ) from None
    return Checkpoint(card, layers, hashlib.sha256(data).hexdigest()[:16])


def _reason(error: Exception) -> str:
    """What is wrong with a checkpoint, in a line."""
    if isinstance(error, pydantic.ValidationError):
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"]))
        return f"its card's {field}: {first['msg']}" if field else "it has no card"
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)


def _check(card: Card, layers: Sequence[Layer]) -> None:
    """Raises ValueError that names what can't be run."""
    sizes: Mapping[str, int] = {name: size for name, size, _, _ in card.percept}
    if not 0.0 < card.decision_period_s[0] <= card.decision_period_s[1]:
        raise ValueError(f"its card's decision_period_s must be [shortest, longest], got {card.decision_period_s}")
    width = 11 + 4 * sizes["heard"] + 4 * sizes.get("echo", 0)
    for k, (weight, bias) in enumerate(layers):
        outputs = weight.shape[-1] if weight.ndim == 2 and k < len(layers) - 1 else 2
        for name, array, shape in (("weight", weight, (width, outputs)), ("bias", bias, (outputs,))):
            if array.dtype != np.float32 or array.shape != shape:
                raise ValueError(f"{k}.{name} is {array.dtype} {array.shape}, expected float32 {shape}")
            if not (np.abs(array) <= _MOST_WEIGHT).all():  # NaN is not either
                raise ValueError(f"{k}.{name} must hold finite numbers of at most {_MOST_WEIGHT:g}")
        width = outputs


def _difference(then: Mapping[str, object], now: Mapping[str, object]) -> str:
    """The first entry that differs, for a message; nothing where none does."""
    other = (name for name in {**then, **now} if then.get(name) != now.get(name))
    return next((f"{name} was {then.get(name)} and is {now.get(name)}" for name in other), "")


@compiled
def _dense(x: Float32, weight: Float32, bias: Float32, out: Float32) -> None:
    for i in range(x.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = bias[k]
        for j in range(x.shape[1]):
            value = x[i, j]
            if value != 0.0:  # most sub-sectors hear nobody
                for k in range(out.shape[1]):
                    out[i, k] += value * weight[j, k]


@compiled
def _add(wish: Float32, barrier: Float32, action: Float32) -> None:
    """Body-frame shares of full force, summed and projected onto the unit disc."""
    for i in range(wish.shape[0]):
        a_x, a_y = project(wish[i, 0] + barrier[i, 0], wish[i, 1] + barrier[i, 1])
        action[i, 0], action[i, 1] = a_x, a_y


@compiled
def _put(p_x: float, p_y: float, near: float, out: Float32, k: int) -> None:
    """A position [m] as four features: its direction, longer the nearer than about ``near`` it is, and itself."""
    length = np.sqrt(p_x * p_x + p_y * p_y)
    weight = near / ((length + 0.5 * near) * max(length, 1e-3))
    far = 1.0 / max(64.0, 0.5 * length)
    out[k], out[k + 1], out[k + 2], out[k + 3] = weight * p_x, weight * p_y, far * p_x, far * p_y


@compiled
def _look(
    flat: Float32, at: Starts, gains: Gains, limits: Limits, features: Float32, barrier: Float32, clamps: Int64
) -> None:
    """``Features.look``. Every feature is bounded: by about 2, velocities by what the vehicle can do."""
    see = fields(flat, at)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            out = features[w, i]
            out[:] = 0.0
            out[0], out[1], out[2] = see.velocity[w, i, 0] / 4.0, see.velocity[w, i, 1], see.yaw_rate[w, i, 0]
            out[3], out[4] = see.reference_velocity[w, i, 0] / 4.0, see.reference_velocity[w, i, 1] / 4.0
            l_x, l_y = see.reference[w, i, 0], see.reference[w, i, 1]
            length = np.sqrt(l_x * l_x + l_y * l_y)
            out[5], out[6] = l_x / max(64.0, 0.5 * length), l_y / max(64.0, 0.5 * length)
            out[7], out[8] = l_x / (length + 8.0), l_y / (length + 8.0)
            f_x, f_y, k = 0.0, 0.0, 9
            for s in range(see.heard.shape[2]):
                if see.heard[w, i, s] > 0.0:
                    p_x, p_y = see.neighbour[w, i, s, 0], see.neighbour[w, i, s, 1]
                    _put(p_x, p_y, 10.0, out, k)
                    d_x, d_y, clamped = neighbour_force(p_x, p_y, gains)
                    f_x, f_y, clamps[w] = f_x + d_x, f_y + d_y, clamps[w] + clamped
                k += 4
            for a in range(see.echo.shape[2]):
                if see.echo[w, i, a] > 0.0:
                    p_x, p_y = see.echo_position[w, i, a, 0], see.echo_position[w, i, a, 1]
                    reach = see.echo_range[w, i, a]
                    away = max(np.sqrt(p_x * p_x + p_y * p_y), 1e-3)
                    out[k], out[k + 1] = 20.0 / (reach + 10.0), reach / 64.0
                    out[k + 2], out[k + 3] = out[k] * p_x / away, out[k] * p_y / away
                    d_x, d_y, clamped = obstacle_force(p_x, p_y, gains)
                    f_x, f_y, clamps[w] = f_x + d_x, f_y + d_y, clamps[w] + clamped
                k += 4
            f_x, f_y = f_x / limits.max_force, f_y * limits.lever_arm / limits.max_torque
            shrink = min(1.0, MOST_BARRIER / max(np.sqrt(f_x * f_x + f_y * f_y), 1e-9))
            barrier[w, i, 0], barrier[w, i, 1] = shrink * f_x, shrink * f_y
            away = 1.0 + np.sqrt(barrier[w, i, 0] ** 2 + barrier[w, i, 1] ** 2)
            out[k], out[k + 1] = barrier[w, i, 0] / away, barrier[w, i, 1] / away
