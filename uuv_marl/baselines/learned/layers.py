"""The networks of learned policies, written once: NumPy, torch and ONNX run the same code, each with its operations."""

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Float32, Int64

ENCODED = 32  # features of an encoded sub-sector
_HEARD = (
    "closeness", "neighbour_direction", "link_identity", "link_velocity", "age", "ranged", "modem_identity",
    "modem_velocity", "modem_age",
)  # fmt: skip
_ECHO = ("echo_closeness", "echo_direction")
_POWERS = 4  # sums of a kind in ``moments``: directions, whose length is closeness, times its powers 0, 1, 2 and 4
Sizes = Sequence[tuple[str, int]]  # name and number of entries of every row of an observation, in order


class Architecture(pydantic.BaseModel, frozen=True, extra="forbid"):
    """Architecture of a network."""

    kind: Literal["mlp", "sectors", "moments"] = "mlp"
    """Input layer: ``mlp``, the observation; ``sectors``, one encoder shared by all sub-sectors, and the sum over them;
    ``moments``, the observation and sums over all sub-sectors of direction times a power of closeness, which show a
    memory how neighbours move through sub-sectors."""
    memory: bool = False
    """Whether a recurrent layer (GRU) precedes the hidden layers, which take its state beside its input."""
    hidden: Annotated[tuple[pydantic.PositiveInt, ...], pydantic.Field(min_length=1)] = (64, 64)
    """Units of the tanh layers; the recurrent layer has as many as the last."""


def columns(sizes: Sizes) -> tuple[dict[str, Int64], Int64]:
    """Columns of sub-sectors' entries, shape (sub-sector, entry), for ``heard`` and ``echo``; and all others."""
    at: dict[str, Int64] = {}
    sectors: dict[str, Int64] = {}
    first = 0
    for name, size in sizes:
        at[name], first = np.arange(first, first + size), first + size
    for kind, names in (("heard", _HEARD), ("echo", _ECHO)):
        num = len(at[names[0]]) if names[0] in at else 0
        if num:
            sectors[kind] = np.concatenate([at[name].reshape(num, -1) for name in names if name in at], axis=1)
    rest = [at[name] for name in at if name not in (*_HEARD, *_ECHO)]
    return sectors, np.concatenate(rest)


def shapes(architecture: Architecture, sizes: Sizes, outputs: int = 2) -> dict[str, tuple[int, ...]]:
    """Shape of each tensor of a network from such observations to actions, by name; weights are (in, out)."""
    width, tensor_shapes = sum(size for _, size in sizes), dict[str, tuple[int, ...]]()
    if architecture.kind == "sectors":
        sectors, rest = columns(sizes)
        width = len(rest) + ENCODED * len(sectors)
        for kind, entries in sectors.items():
            num, size = entries.shape
            tensor_shapes |= {f"{kind}.weight": (size, ENCODED), f"{kind}.place": (num, ENCODED)}
    elif architecture.kind == "moments":
        width += 2 * _POWERS * len(columns(sizes)[0])
    if architecture.memory:
        units = architecture.hidden[-1]
        tensor_shapes |= {"gru.weight": (width, 3 * units), "gru.bias": (3 * units,)}
        tensor_shapes |= {"gru.state_weight": (units, 3 * units), "gru.state_bias": (3 * units,)}
        width += units
    for k, units in enumerate((*architecture.hidden, outputs)):
        tensor_shapes |= {f"{k}.weight": (width, units), f"{k}.bias": (units,)}
        width = units
    return tensor_shapes


class Network:
    """A network of ``tensors`` (see ``shapes``) on rows of observations, with operations such as ``NumpyOps``."""

    def __init__(self, architecture: Architecture, sizes: Sizes, tensors: Mapping[str, Any], ops: Any) -> None:
        self.architecture, self._tensors, self._ops = architecture, tensors, ops
        self._sectors, self._rest = columns(sizes)

    def features(self, x: Any) -> Any:
        """Features of observations (row, entry): unchanged, with moments, or with sub-sectors encoded."""
        if self.architecture.kind == "mlp":
            return x
        if self.architecture.kind == "moments":
            return self._ops.joined([x, *self._moments(x)])
        ops, parts = self._ops, [self._ops.take(x, self._rest)]
        for kind, entries in self._sectors.items():
            num, size = entries.shape
            seen = ops.shaped(ops.take(x, entries.reshape(-1)), (-1, size))
            code = ops.shaped(ops.dense(seen, self._tensors[f"{kind}.weight"]), (-1, num, ENCODED))
            place = self._tensors[f"{kind}.place"]
            parts.append(ops.total(ops.relu(code + place) - ops.relu(place)))  # 0 where nothing is detected
        return ops.joined(parts)

    def _moments(self, x: Any) -> Iterator[Any]:
        """Sums over the sub-sectors that detect neighbours, and over those with echoes, shape (row, 2) each."""
        ops = self._ops
        for entries in self._sectors.values():
            near = ops.shaped(ops.take(x, entries[:, 0]), (-1, len(entries), 1))
            directions = ops.shaped(ops.take(x, entries[:, 1:3].reshape(-1)), (-1, len(entries), 2))
            square = near * near
            yield from (
                ops.total(each)
                for each in (directions, near * directions, square * directions, square * square * directions)
            )

    def gates(self, z: Any) -> Any:
        """Input of the recurrent layer's gates from features (row, entry), shape (row, 3 x unit)."""
        return self._ops.dense(z, self._tensors["gru.weight"], self._tensors["gru.bias"])

    def step(self, gates: Any, state: Any) -> Any:
        """Next state of the recurrent layer, shape (row, unit). Cho et al. 2014, in torch's form."""
        ops = self._ops
        own = ops.dense(state, self._tensors["gru.state_weight"], self._tensors["gru.state_bias"])
        (r, k, n), (own_r, own_k, own_n) = ops.parts(gates), ops.parts(own)
        update = ops.sigmoid(k + own_k)
        new = ops.tanh(n + ops.sigmoid(r + own_r) * own_n)
        return new + update * (state - new)

    def output(self, z: Any, state: Any = None) -> Any:
        """The action before its bounds, shape (row, 2), from features and the recurrent layer's state, if any."""
        x, last = z if state is None else self._ops.joined([z, state]), len(self.architecture.hidden)
        for k in range(last + 1):
            x = self._ops.dense(x, self._tensors[f"{k}.weight"], self._tensors[f"{k}.bias"])
            x = self._ops.tanh(x) if k < last else x
        return x


class NumpyOps:
    """Operations on arrays: some columns, columns side by side, the sum over the middle axis, thirds of the columns ...

    A row's result does not depend on other rows, which no BLAS library guarantees.
    """

    tanh, shaped = staticmethod(np.tanh), staticmethod(np.reshape)
    take, joined, total = (functools.partial(of, axis=1) for of in (np.take, np.concatenate, np.sum))
    parts = functools.partial(np.split, indices_or_sections=3, axis=1)

    @staticmethod
    def dense(x: Float32, weight: Float32, bias: Float32 | None = None) -> Float32:
        """A linear layer: (row, out) for (row, in)."""
        out: Float32 = np.empty((len(x), weight.shape[1]), np.float32)
        dense(x, weight, np.zeros_like(weight[0]) if bias is None else bias, out)
        return out

    @staticmethod
    def sigmoid(x: Float32) -> Float32:
        """Logistic function."""
        return np.float32(0.5) + np.float32(0.5) * np.tanh(np.float32(0.5) * x)

    @staticmethod
    def relu(x: Float32) -> Float32:
        """Rectifier."""
        return np.maximum(x, np.float32(0.0))


@compiled
def dense(x: Float32, weight: Float32, bias: Float32, out: Float32) -> None:
    """A linear layer: ``x`` (row, in), ``weight`` (in, out), ``bias`` (out,); fills ``out`` (row, out)."""
    for i in range(x.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = bias[k]
        for j in range(x.shape[1]):
            value = x[i, j]
            if value != 0.0:  # most sub-sectors are empty
                for k in range(out.shape[1]):
                    out[i, k] += value * weight[j, k]
