"""An ONNX graph that formulas write: nodes and constants in the order in which they are made."""

import contextlib
from collections.abc import Generator, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.extras import extra

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import TensorProto, helper, numpy_helper


class Graph:
    """Nodes and constants, in the order in which formulas make them."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._named = 0

    def __call__(self, operator: str, *inputs: Any, name: str = "", **attributes: Any) -> "Value":
        """The output of a new node.

        Args:
            operator: of ONNX.
            inputs: values, arrays, or numbers, which become constants.
            name: of the output; made up where empty.
            attributes: of the operator.
        """
        name = name or self.fresh(operator)
        values = [each if isinstance(each, Value) else self.constant(each) for each in inputs]
        self.nodes.append(helper.make_node(operator, [value.name for value in values], [name], name, **attributes))
        return Value(self, name)

    @contextlib.contextmanager
    def within(self, nodes: "list[onnx.NodeProto]") -> Generator[None]:
        """What is made here goes into these nodes: those of a graph within this one."""
        outer, self.nodes = self.nodes, nodes
        try:
            yield
        finally:
            self.nodes = outer

    def split(self, value: "Value", sizes: Sequence[int]) -> "list[Value]":
        """Consecutive columns of a value (vehicle, sum of sizes)."""
        names = [self.fresh("part") for _ in sizes]
        inputs = [value.name, self.constant(np.array(sizes, np.int64)).name]
        self.nodes.append(helper.make_node("Split", inputs, names, self.fresh("Split"), axis=1))
        return [Value(self, name) for name in names]

    def fresh(self, stem: str) -> str:
        """A name that nothing has."""
        self._named += 1
        return f"{stem}_{self._named}"

    def used(self) -> "list[onnx.TensorProto]":
        """The constants that nodes use."""
        names = set(_inputs(self.nodes))
        return [constant for constant in self.constants if constant.name in names]

    def constant(self, value: NDArray[Any] | float) -> "Value":
        """An array or a number: double, or int64 where it is whole."""
        name = self.fresh("constant")
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return Value(self, name)


class Value:
    """A tensor of a graph; formulas of it add nodes."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def __add__(self, other: Any) -> "Value":
        return self.graph("Add", self, other)

    def __sub__(self, other: Any) -> "Value":
        return self.graph("Sub", self, other)

    def __mul__(self, other: Any) -> "Value":
        return self.graph("Mul", self, other)

    def __truediv__(self, other: Any) -> "Value":
        return self.graph("Div", self, other)

    def __rtruediv__(self, other: Any) -> "Value":
        return self.graph("Div", other, self)

    def at_least(self, bound: float) -> "Value":
        """No less than a bound."""
        return self.graph("Max", self, bound)

    def at_most(self, bound: float) -> "Value":
        """No more than a bound."""
        return self.graph("Min", self, bound)

    def norm(self) -> "Value":
        """Length along the last axis, which stays."""
        return self.graph("ReduceL2", self, np.array([-1]))

    def single(self) -> "Value":
        """The value in single precision."""
        return self.graph("Cast", self, to=TensorProto.FLOAT)

    def double(self) -> "Value":
        """The value in double precision."""
        return self.graph("Cast", self, to=TensorProto.DOUBLE)

    def shaped(self, *shape: int) -> "Value":
        """With 0 for an axis that stays."""
        return self.graph("Reshape", self, np.array(shape, np.int64))

    def where(self, flag: "Value") -> "Value":
        """Zero where a flag is not set."""
        return self.graph("Where", self.graph("Greater", flag, 0.0), self, 0.0)

    def total(self) -> "Value":
        """Sum over the middle axis, which goes."""
        return self.graph("ReduceSum", self, np.array([1]), keepdims=0)


def _inputs(nodes: Iterable[onnx.NodeProto]) -> Iterator[str]:
    """What nodes take, and those of graphs within them."""
    for node in nodes:
        yield from node.input
        for attribute in node.attribute:
            yield from _inputs(attribute.g.node)
