"""Calls and expressions of compiled functions as nodes: what they read, compute and compare."""

import ast
import builtins
import functools
import inspect
import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from uuv_marl.baselines.export.numbers import KernelError, Numbers, Ref, Scalar, is_known, kind_of, mapped

Names = dict[str, Any]
"""Local names of a function, and how it is left, under keys that are no names:"""
RETURNED, RESULT, BROKEN, CONTINUED = "has returned", "its result", "has broken", "has continued"
_PART = "a part"
_ARITHMETIC: Mapping[type, str] = {ast.Add: "Add", ast.Sub: "Sub", ast.Mult: "Mul", ast.Div: "Div"}
_COMPARISON: Mapping[type, str] = {
    ast.Lt: "Less", ast.LtE: "LessOrEqual", ast.Gt: "Greater", ast.GtE: "GreaterOrEqual", ast.Eq: "Equal",
    ast.NotEq: "Equal",
}  # fmt: skip


class Expressions(Numbers, ast.NodeVisitor):
    """A graph that calls of compiled functions are written to; a subclass writes their statements.

    Args:
        replaced: functions that are not read, with what is called in their place.
    """

    def __init__(self, replaced: Mapping[Any, Callable[..., Any]]) -> None:
        super().__init__()
        self._replaced = replaced
        self._names: Names = {}
        self._function: Any = None

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        """Statements, one after the other."""
        raise NotImplementedError

    def _branch(self, condition: Scalar, body: Sequence[ast.stmt], other: Sequence[ast.stmt]) -> None:
        """Statements of which some run."""
        raise NotImplementedError

    def call(self, function: Any, *args: Any) -> Any:
        """What a compiled function returns for these arguments. Raises KernelError where it has no translation."""
        if function in self._replaced:
            return self._replaced[function](*args)
        plain: Any = getattr(function, "py_func", function)
        if hasattr(plain, "_fields"):
            return plain(*args)
        if not inspect.isfunction(plain):
            return self.function(plain, args)
        tree, outer = _source(plain), (self._names, self._function)
        given = inspect.signature(plain).bind(*args)
        given.apply_defaults()
        self._names, self._function = dict(given.arguments), plain
        try:
            self._block(tree.body)
            return self._result(tree)
        finally:
            self._names, self._function = outer

    def _result(self, tree: ast.FunctionDef) -> Any:
        """What the function returns, whose body has been written."""
        result, ways = self._names.get(RESULT), [node for node in ast.walk(tree) if isinstance(node, ast.Return)]
        if any(way.value for way in ways) and not _returns(tree.body):
            raise KernelError(f"function {tree.name} may end without a result")
        if len(ways) > 1 and "s" in _kinds(result):
            raise KernelError(f"function {tree.name} returns single precision, and may return double elsewhere")
        return result

    def visit(self, node: ast.AST) -> Any:
        """The value of a node; whatever goes wrong says where."""
        try:
            return super().visit(node)
        except _PlacedError:
            raise
        except Exception as error:
            where = f"line {getattr(node, 'lineno', '?')} of {inspect.getsourcefile(self._function)}"
            raise _PlacedError(f"function {self._function.__name__}, {where}: {error}") from error

    def generic_visit(self, node: ast.AST) -> Any:
        """Refuse what has no method here."""
        raise KernelError(f"{type(node).__name__} has no translation")

    def _truth(self, test: Any) -> Any:
        """What a condition says."""
        if kind_of(test) != "b" or not (is_known(test) or isinstance(test, Scalar)):
            raise KernelError("a condition must be a comparison, or true or false")
        return test

    def visit_Constant(self, node: ast.Constant) -> Any:
        """A number."""
        return node.value

    def visit_Name(self, node: ast.Name) -> Any:
        """A local, a global or one of Python's own."""
        code = self._function.__code__
        if node.id in self._names:
            return self._names[node.id]
        if node.id in (*code.co_varnames, *code.co_cellvars, *code.co_freevars):
            raise KernelError(f"{node.id} has a value on some ways only, or is of a function around")
        for names in (self._function.__globals__, vars(builtins)):
            if node.id in names:
                return names[node.id]
        raise KernelError(f"{node.id} is unknown")

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        """A part of a named tuple, a module, or the shape of an array."""
        value = self.visit(node.value)
        if isinstance(value, Scalar) or (isinstance(value, Ref) and node.attr != "shape"):
            raise KernelError(f"of an array only the shape can be asked for, not {node.attr}")
        return getattr(value, node.attr)

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """An entry or a view."""
        return self.at(self.visit(node.value), self._index(node.slice))

    def _index(self, it: ast.expr) -> Sequence[Any]:
        return [self.visit(part) for part in (it.elts if isinstance(it, ast.Tuple) else (it,))]

    def visit_Slice(self, node: ast.Slice) -> slice:
        """A slice, from one entry to another."""
        return slice(*(None if end is None else self.visit(end) for end in (node.lower, node.upper, node.step)))

    def visit_Tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        """Several values."""
        return tuple(self.visit(part) for part in node.elts)

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        """A sum, difference, product or quotient."""
        return self._computed(node.op, self.visit(node.left), self.visit(node.right))

    def _computed(self, by: ast.operator, a: Any, b: Any) -> Any:
        return self.binary(_ARITHMETIC[type(by)], a, b) if type(by) in _ARITHMETIC else self.generic_visit(by)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        """A number with the other sign, or whether something is not so."""
        value = self.visit(node.operand)
        if isinstance(node.op, ast.Not):
            return self.no(value)
        if not isinstance(node.op, ast.USub):
            self.generic_visit(node.op)
        return -value if is_known(value) else self.operation("Neg", value.kind, value)

    def visit_Compare(self, node: ast.Compare) -> Any:
        """Comparisons, of which all must be so."""
        values = [self.visit(part) for part in (node.left, *node.comparators)]
        result: Any = True
        for op, a, b in zip(node.ops, values, values[1:], strict=False):
            if type(op) not in _COMPARISON:
                self.generic_visit(op)
            one = self.compared(_COMPARISON[type(op)], a, b)
            result = self.both(result, self.no(one) if isinstance(op, ast.NotEq) else one)
        return result

    def visit_BoolOp(self, node: ast.BoolOp) -> Any:
        """Whether all are so, or one; a part is computed only where those before leave it open, as in Python."""
        every = isinstance(node.op, ast.And)
        result: Any = every
        for part in node.values:
            if is_known(result) and bool(result) != every:
                return result
            if isinstance(result, Scalar) and _may_fail(part):
                own, known = [_kept(part)], [_kept(ast.copy_location(ast.Constant(not every), part))]
                self._branch(result, own if every else known, known if every else own)
                result = self._truth(self._names.pop(_PART))
            else:
                result = (self.both if every else self.either)(result, self._truth(self.visit(part)))
        return result

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """One of two values."""
        test = self._truth(self.visit(node.test))
        if not isinstance(test, Scalar):
            return self.visit(node.body if test else node.orelse)
        if not (_may_fail(node.body) or _may_fail(node.orelse)):
            return self.chosen(test, self.visit(node.body), self.visit(node.orelse))
        self._branch(test, [_kept(node.body)], [_kept(node.orelse)])
        return self._names.pop(_PART)

    def visit_Call(self, node: ast.Call) -> Any:
        """A call, written out."""
        function = self.visit(node.func)
        args: list[Any] = [self.visit(arg) for arg in node.args]
        named = {word.arg: self.visit(word.value) for word in node.keywords}
        if named:
            names = list(inspect.signature(getattr(function, "py_func", function)).parameters)
            args += [named[name] for name in names[len(args) :]]
        return self.call(function, *args)


class _PlacedError(KernelError):
    """One that says where."""


@functools.cache
def _source(function: Any) -> ast.FunctionDef:
    """A function's syntax tree, with the lines of its file."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    return cast(ast.FunctionDef, ast.increment_lineno(tree, function.__code__.co_firstlineno - 1).body[0])


def _returns(body: Sequence[ast.stmt]) -> bool:
    """Whether statements can't end without a return."""
    last = body[-1] if body else None
    if isinstance(last, ast.If):
        return _returns(last.body) and _returns(last.orelse)
    return isinstance(last, ast.Return)


def _may_fail(part: ast.expr) -> bool:
    """Whether computing it in vain could fail, write to an array or take long."""
    return any(isinstance(node, (ast.Call, ast.Subscript)) for node in ast.walk(part))


def _kept(part: ast.expr) -> ast.Assign:
    """The statement that keeps a value under a name that none is."""
    name = ast.copy_location(ast.Name(_PART, ast.Store()), part)
    return ast.copy_location(ast.Assign([name], part), part)


def _kinds(result: Any) -> list[str]:
    """Kinds of the numbers of a result that is known only when the model runs."""
    found: list[str] = []

    def note(part: Any) -> None:
        if isinstance(part, Scalar):
            found.append(part.kind)

    mapped(note, result)
    return found
