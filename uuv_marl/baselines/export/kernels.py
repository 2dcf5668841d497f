"""Compiled functions as ONNX nodes: the source that Numba compiles is read, and every number it computes is a node.

So memory, law and filter have one definition. A branch whose condition is known when the model is written leaves no
node; other branches become ``If``, loops ``Loop``, and calls are written out. Of::

    def nearest(away, num):
        best, least = -1, math.inf
        for k in range(num):
            if away[k] < least:
                best, least = k, away[k]
        return best

``Translator.call`` makes a ``Loop`` with two numbers that go from round to round, best and least, and in its body a
``Gather``, a ``Less``, and an ``If`` that gives both anew. What lies outside the part of Python that our compiled
functions use raises ``KernelError``.
"""

import ast
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

import numpy as np

from uuv_marl.baselines.export.expressions import BROKEN, CONTINUED, RESULT, RETURNED, Expressions, Names
from uuv_marl.baselines.export.numbers import (
    TYPES,
    Cells,
    KernelError,
    Ref,
    Scalar,
    is_known,
    kind_of,
    known_as,
    mapped,
    wider,
)
from uuv_marl.extras import extra

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import helper

_ENDS = (RETURNED, BROKEN, CONTINUED)
"""Ways out of statements."""


class _Way(NamedTuple):
    """Some statements, written as a graph of their own."""

    nodes: list[onnx.NodeProto]
    names: Names
    """After them."""
    tensors: dict[Cells, str]
    """After them."""


@dataclass
class _Doors:
    """What goes into a graph within a graph, and out of it."""

    heads: list[onnx.ValueInfoProto] = field(default_factory=list[onnx.ValueInfoProto])
    """Its inputs."""
    tails: tuple[list[onnx.ValueInfoProto], ...] = ()
    """Its outputs; of each way, where there are two."""
    starts: list[str] = field(default_factory=list[str])
    """Tensors outside that are its first inputs."""
    outputs: list[str] = field(default_factory=list[str])
    """What its outputs are called outside."""


class Translator(Expressions, ast.NodeVisitor):
    """Writes calls of compiled functions as nodes: ``call``."""

    # Statements

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        """Statements, up to where they are left; the rest in a branch where that is not known."""
        for k, statement in enumerate(statements):
            self.visit(statement)
            left = functools.reduce(self.either, (self._names.get(name, False) for name in _ENDS), False)
            if isinstance(left, Scalar) and statements[k + 1 :]:
                self._branch(self.scalar(self.no(left)), statements[k + 1 :], (), anew=True)
            if isinstance(left, Scalar) or left:
                return

    def visit_Assign(self, node: ast.Assign) -> None:
        """Targets = value."""
        value = self.visit(node.value)
        for target in node.targets:
            self._assign(target, value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        """Target += value, or another operator."""
        self._assign(node.target, self._computed(node.op, self.visit(node.target), self.visit(node.value)))

    def _assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self._names[target.id] = value
        elif isinstance(target, ast.Tuple):
            for part, own in zip(target.elts, value, strict=True):
                self._assign(part, own)
        elif isinstance(target, ast.Subscript):
            self.store(self.view(self.visit(target.value), self._index(target.slice)), value)
        else:
            self.generic_visit(target)

    def visit_If(self, node: ast.If) -> None:
        """A branch."""
        test = self._truth(self.visit(node.test))
        if isinstance(test, Scalar):
            self._branch(test, node.body, node.orelse)
        else:
            self._block(node.body if test else node.orelse)

    def visit_Return(self, node: ast.Return) -> None:
        """The end of a function."""
        self._names[RESULT] = None if node.value is None else self.visit(node.value)
        self._names[RETURNED] = True

    def visit_Break(self, node: ast.Break) -> None:  # noqa: ARG002 - as visitors are called
        """The end of a loop."""
        self._names[BROKEN] = True

    def visit_Continue(self, node: ast.Continue) -> None:  # noqa: ARG002 - as visitors are called
        """The end of a round."""
        self._names[CONTINUED] = True

    def visit_Expr(self, node: ast.Expr) -> None:
        """A call for its effect, or a docstring."""
        self.visit(node.value)

    # Branches

    def _way(self, statements: Sequence[ast.stmt], changes: Names, tensors: Mapping[Cells, str]) -> _Way:
        """Statements as a graph of their own, in which some names and arrays are others."""
        outer, nodes = (self._names, self.tensors), list[onnx.NodeProto]()
        self._names, self.tensors = {**self._names, **changes}, {**self.tensors, **tensors}
        with self.within(nodes):
            self._block(statements)
        way = _Way(nodes, self._names, self.tensors)
        self._names, self.tensors = outer
        return way

    def _branch(
        self, condition: Scalar, body: Sequence[ast.stmt], other: Sequence[ast.stmt], anew: bool = False
    ) -> None:
        """Statements of which some run, as ``If``; ``anew``: the condition says that nothing has been left before."""
        ways = self._way(body, dict.fromkeys(_ENDS, False) if anew else {}, {}), self._way(other, {}, {})
        doors = _Doors(tails=([], []))
        self._names = self._joined_names(ways, doors)
        for cells in self.tensors:
            a, b = (way.tensors[cells] for way in ways)
            if a != b:
                self.tensors = {**self.tensors, cells: _out(ways, doors, (a, b), "f", self.fresh, cells.size)}
        if doors.outputs:
            graphs = [
                helper.make_graph(way.nodes, self.fresh("way"), [], tails)
                for way, tails in zip(ways, doors.tails, strict=True)
            ]
            node = helper.make_node("If", [condition.name], doors.outputs, then_branch=graphs[0], else_branch=graphs[1])
            self.nodes.append(node)

    def _joined_names(self, ways: tuple[_Way, _Way], doors: _Doors) -> Names:
        """Names after two ways; one that has a value on one of them only has none."""
        joined: Names = {}
        for name in {**ways[0].names, **ways[1].names}:  # in order: the same file each time
            a, b = (way.names.get(name, False if name in _ENDS else None) for way in ways)
            if name == RESULT:
                a, b = (mapped(_zero, b) if a is None else a), (mapped(_zero, a) if b is None else b)
            if (a is None) == (b is None):
                joined[name] = mapped(functools.partial(self._joined, ways, doors), a, b)
        return joined

    def _joined(self, ways: tuple[_Way, _Way], doors: _Doors, a: Any, b: Any) -> Any:
        """What is a on one way, and b on the other."""
        if a is b or (is_known(a) and is_known(b) and kind_of(a) == kind_of(b) and a == b):
            return a
        if isinstance(a, Ref) and isinstance(b, Ref) and (a.cells, a.shape, a.strides) == (b.cells, b.shape, b.strides):
            return Ref(a.cells, self._joined(ways, doors, a.offset, b.offset), a.shape, a.strides)
        if isinstance(a, Ref) or isinstance(b, Ref):
            raise KernelError("a name stands for one of two arrays")
        kind, inner = wider(a, b), list[str]()
        for value, way in zip((a, b), ways, strict=True):
            with self.within(way.nodes):
                inner.append(self.scalar(value, kind).name)
        return Scalar(_out(ways, doors, inner, kind, self.fresh), kind)

    # Loops

    def visit_For(self, node: ast.For) -> None:
        """A loop over a range."""
        call = node.iter
        ranged = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        bounds = [self.visit(arg) for arg in call.args] if isinstance(call, ast.Call) and ranged else []
        if not 1 <= len(bounds) <= 2 or node.orelse or not isinstance(node.target, ast.Name):
            raise KernelError("a loop must run over range(end) or range(first, end), and have no else")
        first, end = (0, bounds[0]) if len(bounds) == 1 else bounds
        trips = self.binary("Sub", end, first)
        ends = {name: self._names.pop(name) for name in (BROKEN, CONTINUED) if name in self._names}
        if is_known(trips) and trips <= 1:
            for _ in range(int(trips)):
                self._assign(node.target, first)
                self._block(node.body)
        else:
            self._loop(node, first, trips)
        for name in (BROKEN, CONTINUED):
            self._names.pop(name, None)
        self._names |= ends

    def _loop(self, it: ast.For, first: Any, trips: Any) -> None:
        """A loop that runs more than once, or nobody knows how often.

        Its body is written again until it is known which arrays it changes, and which numbers become doubles in it.
        """
        target = cast(ast.Name, it.target).id
        stored = {node.id for node in ast.walk(it) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        inner = {cast(ast.Name, node.target).id for node in ast.walk(it) if isinstance(node, ast.For)}
        begins = {name: self._names[name] for name in sorted(stored & self._names.keys() - inner)}
        changed: list[Cells] = []
        while True:
            count = Scalar(self.fresh("round"), "i")
            heads = {name: mapped(self._head, value) for name, value in begins.items()}
            given = {cells: self.fresh("cells") for cells in changed}
            self._names[target] = 0
            way = self._round(it, count, first, heads, given)
            new = [c for c in self.tensors if c not in given and way.tensors[c] != self.tensors[c]]
            wide = {name: mapped(_widened, value, way.names[name]) for name, value in begins.items()}
            if not new and mapped(kind_of, tuple(wide.values())) == mapped(kind_of, tuple(begins.values())):
                break
            begins, changed = wide, changed + new
        del self._names[target]
        if way.names.get(RETURNED, False) is not False:
            begins |= {RETURNED: False, RESULT: mapped(_zero, way.names[RESULT])}
            heads |= {name: mapped(self._head, begins[name]) for name in (RETURNED, RESULT)}
        self._close(way, count, trips, [(name, begins[name], heads[name]) for name in begins], given)

    def _round(self, it: ast.For, count: Scalar, first: Any, heads: Names, given: Mapping[Cells, str]) -> _Way:
        """The body of a loop."""
        before: list[onnx.NodeProto] = []
        with self.within(before):
            number = self.binary("Add", count, first)
        way = self._way(it.body, {**heads, cast(ast.Name, it.target).id: number}, given)
        return way._replace(nodes=[*before, *way.nodes])

    def _close(
        self, way: _Way, count: Scalar, trips: Any, carried: Iterable[tuple[str, Any, Any]], given: Mapping[Cells, str]
    ) -> None:
        """``Loop`` with a body; names and arrays that it changes go from round to round.

        Args:
            way: the body.
            count: number of the round.
            trips: how many rounds there are at most.
            carried: names, what they stand for before, and in the body's inputs.
            given: tensors of arrays, as the body's inputs.
        """
        with self.within(way.nodes):
            stop = self.either(way.names.get(BROKEN, False), way.names.get(RETURNED, False))
            on = self.emit("Identity", self.scalar(self.no(stop), "b").name)
        doors = _Doors(tails=([_info(on, "b")],))
        doors.heads += [_info(count.name, "i"), _info(self.fresh("on"), "b")]

        def carry(begin: Any, head: Any, tail: Any) -> Any:
            if head is None:
                return None
            doors.heads.append(_info(head.name, head.kind))
            doors.starts.append(self.scalar(begin, head.kind).name)
            with self.within(way.nodes):
                inner = self.scalar(tail, head.kind).name
            return Scalar(_out([way], doors, [inner], head.kind, self.fresh), head.kind)

        for name, begin, head in carried:
            self._names[name] = mapped(carry, begin, head, way.names.get(name, begin))
        for cells, head in given.items():
            doors.heads.append(_info(head, "f", cells.size))
            doors.starts.append(self.tensors[cells])
            after = _out([way], doors, [way.tensors[cells]], "f", self.fresh, cells.size)
            self.tensors = {**self.tensors, cells: after}
        if doors.outputs:
            body = helper.make_graph(way.nodes, self.fresh("body"), doors.heads, doors.tails[0])
            inputs = [self.scalar(trips, "i").name, "", *doors.starts]
            self.nodes.append(helper.make_node("Loop", inputs, doors.outputs, body=body))

    def _head(self, value: Any) -> Any:
        """A name for what a loop's body is given."""
        if isinstance(value, Ref):
            raise KernelError("a name stands for another array in each round")
        return None if value is None else Scalar(self.fresh("head"), kind_of(value))


def _info(name: str, kind: str, size: int | None = None) -> onnx.ValueInfoProto:
    """A number, or an array of a size."""
    return helper.make_tensor_value_info(name, TYPES[kind], [] if size is None else [size])


def _out(
    ways: Sequence[_Way], doors: _Doors, tensors: Sequence[str], kind: str, fresh: Callable[[str], str],
    size: int | None = None,
) -> str:  # fmt: skip
    """The name outside of what comes out of a graph, by one of its ways."""
    for way, tails, tensor in zip(ways, doors.tails, tensors, strict=True):
        name = fresh("tail")  # an output must be made inside
        way.nodes.append(helper.make_node("Identity", [tensor], [name]))
        tails.append(_info(name, kind, size))
    doors.outputs.append(fresh("out"))
    return doors.outputs[-1]


def _zero(like: Any) -> Any:
    """What stands for a result on the way on which there is none."""
    if isinstance(like, (Ref, np.ndarray)):
        raise KernelError("an array is returned on one way only")
    return None if like is None else known_as(0, kind_of(like))


def _widened(begin: Any, end: Any) -> Any:
    """What a name stands for before a loop, as a number of the kind that it has after a round."""
    if begin is None or isinstance(begin, Ref):
        return begin
    kind = wider(begin, end)
    if kind == kind_of(begin):
        return begin
    if isinstance(begin, Scalar):
        raise KernelError("a name becomes a number of another kind in a loop")
    return known_as(begin, kind)
