"""Numbers and arrays of compiled functions as nodes of an ONNX graph.

There are two times: what is known when the model is written is a number of Python and leaves no node; what is known
only when the model runs is a ``Scalar``, the name of a tensor. An array is a tensor with one axis; each write to it
makes a new one.
"""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.export.graph import Graph, Value
from uuv_marl.extras import extra

with extra("onnx", "export to ONNX"):
    from onnx import TensorProto

TYPES = {"f": TensorProto.DOUBLE, "s": TensorProto.FLOAT, "i": TensorProto.INT64, "b": TensorProto.BOOL}
"""ONNX's type of each kind of number: double, single, whole, true or false."""
_DTYPES = {"f": np.float64, "s": np.float32, "i": np.int64, "b": np.bool_}
_OF_ONE: Mapping[Any, tuple[str, Callable[[Any], Any]]] = {
    math.sqrt: ("Sqrt", np.sqrt), np.sqrt: ("Sqrt", np.sqrt), math.exp: ("Exp", np.exp),
    math.floor: ("Floor", np.floor), abs: ("Abs", abs), float: ("", float),
}  # fmt: skip
"""Functions of one number: the operator, and what computes it now."""
_OF_TWO: Mapping[Any, tuple[str, Callable[[Any, Any], Any]]] = {
    min: ("Min", min), max: ("Max", max), math.hypot: ("", math.hypot), math.copysign: ("", math.copysign),
}  # fmt: skip
_KNOWN: Mapping[str, Callable[[Any, Any], Any]] = {
    "Add": lambda a, b: a + b,
    "Sub": lambda a, b: a - b,
    "Mul": lambda a, b: a * b,
    "Div": lambda a, b: float(np.divide(a, b, dtype=np.float64)),
    "Less": lambda a, b: a < b,
    "LessOrEqual": lambda a, b: a <= b,
    "Greater": lambda a, b: a > b,
    "GreaterOrEqual": lambda a, b: a >= b,
    "Equal": lambda a, b: a == b,
}


class KernelError(TypeError):
    """A compiled function holds what has no translation."""


@dataclass(frozen=True)
class Scalar:
    """A number that is known when the model runs."""

    name: str
    """Name of the tensor, which has no axis."""
    kind: str
    """One of ``TYPES``."""


@dataclass(eq=False)
class Cells:
    """An array that code may write to."""

    size: int
    single: bool = False
    """Its entries are single precision; its tensor is double all the same."""


@dataclass(frozen=True)
class Ref:
    """A view of an array."""

    cells: Cells
    offset: "int | Scalar"
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    """How many entries of the array each axis steps over."""


def view_of(cells: Cells, shape: tuple[int, ...], first: int = 0) -> Ref:
    """All of an array, or what lies from an entry on."""
    return Ref(cells, first, shape, tuple(math.prod(shape[k + 1 :]) for k in range(len(shape))))


def is_known(value: Any) -> TypeGuard[float]:
    """Whether it is a number of Python, or a double of NumPy."""
    return isinstance(value, (bool, int, float, np.integer, np.bool_))


def kind_of(value: Any) -> str:
    """Kind of a number; of what is none, f."""
    if isinstance(value, Scalar):
        return value.kind
    if isinstance(value, (bool, np.bool_)):
        return "b"
    return "i" if isinstance(value, (int, np.integer)) else "f"


def wider(a: Any, b: Any) -> str:
    """The kind of what two numbers give, as Numba has it: single precision and whole numbers make double."""
    kinds = {kind_of(a), kind_of(b)}
    if len(kinds) == 1:
        return kinds.pop()
    return "f" if kinds & {"f", "s"} else "i"


def known_as(value: float, kind: str) -> Any:
    """A known number as one of a kind."""
    return _DTYPES[kind](value).item()


def mapped(function: Callable[..., Any], *values: Any) -> Any:
    """A function of numbers, arrays or None on all parts of tuples of the same form."""
    first: Any = values[0]
    if not isinstance(first, tuple):
        return function(*values)
    parts = [mapped(function, *each) for each in zip(*values, strict=True)]
    form = cast(Any, type(values[0]))
    return form(*parts) if hasattr(form, "_fields") else tuple(parts)


def _ends(part: Any, length: int) -> tuple[int, int]:
    """Where a slice of an axis begins and ends."""
    if not all(end is None or is_known(end) for end in (part.start, part.stop)) or part.step is not None:
        raise KernelError("a slice must have known ends and no step")
    start, stop, _ = part.indices(length)
    return start, max(start, stop)


class Numbers(Graph):
    """A graph with arithmetic of numbers, and arrays that can be written to."""

    def __init__(self) -> None:
        super().__init__()
        self.tensors: dict[Cells, str] = {}
        """The tensor that holds each array now."""
        self._scalars: dict[tuple[str, bytes], Scalar] = {}
        self._fixed: dict[int, tuple[NDArray[Any], Ref]] = {}
        self._fixed_tensors: dict[Cells, str] = {}

    def emit(self, operator: str, *inputs: str, **attributes: Any) -> str:
        """Name of the output of a new node, from names of inputs."""
        return self(operator, *(Value(self, name) for name in inputs), **attributes).name

    # Arrays

    def array(self, tensor: str, shape: tuple[int, ...], single: bool = False) -> Ref:
        """An array that begins as a double tensor with one axis."""
        ref = view_of(Cells(math.prod(shape), single), shape)
        self.tensors[ref.cells] = tensor
        return ref

    def zeros(self, shape: tuple[int, ...], single: bool = False) -> Ref:
        """An array of zeros."""
        return self.array(self.constant(np.zeros(math.prod(shape))).name, shape, single)

    def at(self, array: Any, index: Sequence[Any]) -> Any:
        """A view or an entry of an array, or a part of a tuple."""
        if isinstance(array, tuple):
            return cast(Any, array)[index[0]]
        if isinstance(array, np.ndarray):
            fixed = cast(NDArray[Any], array)
            ref = self._fixed_array(fixed)
            if len(index) == fixed.ndim and all(map(is_known, index)):
                self.view(ref, index)  # refuses what lies outside
                return fixed[tuple(index)].item()
            array = ref
        ref = self.view(array, index)
        return ref if ref.shape else self._load(ref)

    def _fixed_array(self, array: NDArray[Any]) -> Ref:
        """A constant array as one whose entries can be taken when the model runs."""
        if array.dtype.char not in "d?":
            raise KernelError(f"an array of {array.dtype} has no translation")
        if id(array) not in self._fixed:
            ref = view_of(Cells(array.size), array.shape)
            self._fixed[id(array)] = array, ref
            self._fixed_tensors[ref.cells] = self.constant(np.ascontiguousarray(array, np.float64).ravel()).name
        return self._fixed[id(array)][1]

    def view(self, ref: Ref, index: Sequence[Any]) -> Ref:
        """A part of an array, for numbers and slices. Numbers known only when the model runs must lie inside."""
        offset, shape, strides = ref.offset, list[int](), list[int]()
        every = [*index, *([slice(None)] * (len(ref.shape) - len(index)))]
        for own, length, stride in zip(every, ref.shape, ref.strides, strict=True):
            if isinstance(own, slice):
                start, stop = _ends(own, length)
                offset = self.binary("Add", offset, start * stride)
                shape.append(stop - start)
                strides.append(stride)
            else:
                if kind_of(own) != "i" or (is_known(own) and not 0 <= own < length):
                    raise KernelError(f"index {own} does not lie in an axis of length {length}")
                offset = self.binary("Add", offset, self.binary("Mul", own, stride))
        return Ref(ref.cells, offset, tuple(shape), tuple(strides))

    def _load(self, ref: Ref) -> Scalar:
        tensor = self.tensors.get(ref.cells) or self._fixed_tensors[ref.cells]
        entry = Scalar(self.emit("Gather", tensor, self.scalar(ref.offset, "i").name), "f")
        return self.scalar(entry, "s") if ref.cells.single else entry

    def store(self, ref: Ref, value: Any) -> None:
        """Write an entry, or one known number to all entries of an array."""
        if ref.shape:
            if not is_known(value) or math.prod(ref.shape) != ref.cells.size:
                raise KernelError("of a whole array, only a known number can be the new content of all entries")
            self.tensors[ref.cells] = self.constant(np.full(ref.cells.size, float(value))).name
            return
        entry = self.scalar(self.scalar(value, "s") if ref.cells.single else value, "f")
        inputs = (self.emit("Reshape", x.name, self._one) for x in (self.scalar(ref.offset, "i"), entry))
        self.tensors[ref.cells] = self.emit("ScatterElements", self.tensors[ref.cells], *inputs)

    @functools.cached_property
    def _one(self) -> str:
        """The shape of a vector with one entry."""
        return self.constant(np.array([1])).name

    # Numbers

    def scalar(self, value: Any, kind: str = "") -> Scalar:
        """A number as a tensor, of a kind."""
        kind = kind or kind_of(value)
        if isinstance(value, Scalar):
            return value if value.kind == kind else Scalar(self.emit("Cast", value.name, to=TYPES[kind]), kind)
        if not is_known(value):
            raise KernelError(f"{value!r} is no number")
        number = np.array(value, _DTYPES[kind])
        key = kind, number.tobytes()
        if key not in self._scalars:
            self._scalars[key] = Scalar(self.constant(number).name, kind)
        return self._scalars[key]

    def operation(self, operator: str, kind: str, *inputs: Any, of: str = "") -> Scalar:
        """A number of a kind, that an operator makes of numbers of a kind, the same unless said."""
        return Scalar(self.emit(operator, *(self.scalar(x, of or kind).name for x in inputs)), kind)

    def binary(self, name: str, a: Any, b: Any) -> Any:
        """Add, Sub, Mul or Div."""
        if is_known(a) and is_known(b):
            with np.errstate(all="ignore"):
                return _KNOWN[name](a, b)
        neutral = {"Add": 0, "Mul": 1}.get(name)
        for one, other in ((a, b), (b, a)):
            if neutral is not None and one == neutral and kind_of(one) == kind_of(other) == "i":
                return other
        kind = wider(a, b)
        if kind == "b":
            raise KernelError("whether something is so is no number to compute with")
        return self.operation(name, "f" if name == "Div" and kind in "ib" else kind, a, b)

    def compared(self, name: str, a: Any, b: Any) -> Any:
        """Less, LessOrEqual, Greater, GreaterOrEqual or Equal."""
        if is_known(a) and is_known(b):
            return _KNOWN[name](a, b)
        return self.operation(name, "b", a, b, of=wider(a, b))

    def no(self, value: Any) -> Any:
        """Whether it is not so."""
        return not value if is_known(value) else self.operation("Not", "b", value)

    def both(self, a: Any, b: Any) -> Any:
        """Whether both are so."""
        for one, other in ((a, b), (b, a)):
            if is_known(one):
                return other if one else False
        return self.operation("And", "b", a, b)

    def either(self, a: Any, b: Any) -> Any:
        """Whether at least one is so."""
        return self.no(self.both(self.no(a), self.no(b)))

    def chosen(self, condition: Scalar, a: Any, b: Any) -> Any:
        """One of two numbers, or of two tuples of them."""

        def choose(x: Any, y: Any) -> Scalar:
            kind = wider(x, y)
            return Scalar(self.emit("Where", condition.name, *(self.scalar(z, kind).name for z in (x, y))), kind)

        return mapped(choose, a, b)

    def function(self, function: Any, args: Sequence[Any]) -> Any:
        """What one of Python's functions of numbers gives."""
        if function in _OF_ONE and len(args) == 1:
            operator, known = _OF_ONE[function]
            return self._now(known, args) if is_known(args[0]) else self._of_one(function, operator, args[0])
        if function not in _OF_TWO or len(args) < 2:
            raise KernelError(f"{function} of {len(args)} has no translation")
        return functools.reduce(functools.partial(self._of_two, function), args)

    def _now(self, known: Callable[..., Any], args: Sequence[float]) -> Any:
        """A function of known numbers, which raises nothing, as in compiled code."""
        with np.errstate(all="ignore"):
            result = known(*args)
        return int(result) if known is np.floor else getattr(result, "item", lambda: result)()

    def _of_one(self, function: Any, operator: str, x: Scalar) -> Scalar:
        if function is abs:
            return self.operation(operator, x.kind, x)
        kind = "s" if x.kind == "s" else "f"
        if function is float:  # Numba leaves single precision as it is
            return self.scalar(x, kind)
        result = self.operation(operator, kind, x)
        return self.scalar(result, "i") if function is math.floor else result

    def _of_two(self, function: Any, a: Any, b: Any) -> Any:
        operator, known = _OF_TWO[function]
        if is_known(a) and is_known(b):
            return self._now(known, (a, b))
        if function is math.hypot:
            return self._hypot(a, b)
        return self._signed(a, b) if function is math.copysign else self.operation(operator, wider(a, b), a, b)

    def _hypot(self, a: Any, b: Any) -> Scalar:
        """The root of the squares' sum: above 1e154 it overflows, which lengths in metres never reach."""
        squares = (self.binary("Mul", x, x) for x in (self.scalar(a, "f"), self.scalar(b, "f")))
        length = self.operation("Sqrt", "f", self.binary("Add", *squares))
        return self.scalar(length, "s") if wider(a, b) == "s" else length

    def _signed(self, size: Any, sign: Any) -> Any:
        """A size with a sign; that of -0.0 counts as plus."""
        size = self.scalar(self.function(abs, [size]), "f")
        return self.chosen(self.scalar(self.compared("Less", sign, 0.0)), self.operation("Neg", "f", size), size)
