"""What a compiled function is made of: every statement that its source reaches, in its own file and in others.

Numba notices an edit of a function's own file, but not one of a function that it calls, or of a constant or a tuple's
fields in another file. So its cache is keyed by the code reached. Comments, docstrings and neighbours don't count.
"""

import ast
import contextlib
import functools
import hashlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast


def source_key(function: Callable[..., Any], *settings: object) -> str:
    """Hash of all the code that a function is compiled from, and of ``settings``."""
    text = "\n".join([repr(settings), *(f"{place}: {code}" for place, code in sorted(reached(function).items()))])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def reached(function: Callable[..., Any]) -> dict[tuple[str, str], str]:
    """The function and all of its package and of uuv_marl that it uses: code by module and name."""
    packages = {"uuv_marl", function.__module__.partition(".")[0]}
    found: dict[tuple[str, str], str] = {}
    waiting = [(function.__module__, function.__name__)]
    while waiting:
        module, name = waiting.pop()
        name, _, attribute = name.partition(".")
        statement = _statements(module).get(name)
        if statement is None or (module, name) in found:
            continue
        if attribute:
            home = _module(statement, name)
            if home.partition(".")[0] in packages:
                waiting.append((home, attribute))
            continue
        if isinstance(statement, ast.Import | ast.ImportFrom):
            home = statement.module or "" if isinstance(statement, ast.ImportFrom) else ""
            if home.partition(".")[0] in packages:
                waiting.append((home, next(a.name for a in statement.names if name in (a.name, a.asname))))
            continue
        found[module, name], names = _content(module, name)
        waiting += [(module, used) for used in names]
    return found


def _module(statement: ast.stmt, name: str) -> str:
    """The module that a statement binds a name to, where it imports one."""
    if not isinstance(statement, ast.Import | ast.ImportFrom):
        return ""
    whole = next(alias.name for alias in statement.names if name in (alias.name, alias.asname))
    return f"{statement.module}.{whole}" if isinstance(statement, ast.ImportFrom) else whole


@functools.cache
def _statements(module: str) -> dict[str, ast.stmt]:
    """A module's statements by the names that they bind."""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        with contextlib.suppress(ModuleNotFoundError):  # a parameter that is called as a function elsewhere is none
            spec = importlib.util.find_spec(module)
            file = spec and spec.origin
    tree = ast.parse(Path(file).read_bytes()) if file and Path(file).is_file() else ast.Module([], [])
    return {name: statement for statement in tree.body for name in _bound(statement)}


def _bound(statement: ast.stmt) -> Iterator[str]:
    for node in [statement] if isinstance(statement, ast.FunctionDef | ast.ClassDef) else ast.walk(statement):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id


@functools.cache
def _content(module: str, name: str) -> tuple[str, frozenset[str]]:
    """The code of a statement and the names that it uses, but for its decorators'; of a class the fields alone."""
    statement = _statements(module)[name]
    parts: list[ast.AST] = [statement]
    annotations: list[ast.AST] = []
    decorators: list[ast.expr] = []  # they say whether it is copied into its callers
    if isinstance(statement, ast.ClassDef):
        fields = [line for line in statement.body if isinstance(line, ast.AnnAssign)]
        parts = [*statement.bases, *(part for line in fields for part in (line.target, line.value) if part)]
        annotations = [
            line.annotation for line in fields
        ]  # values bring their types along; but what is named there counts
    elif isinstance(statement, ast.FunctionDef):
        parts = [statement.args, *(line for line in statement.body if not _is_text(line))]
        decorators = statement.decorator_list
    nodes = [node for part in [*parts, *annotations] for node in ast.walk(part)]
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    used |= {
        f"{node.value.id}.{node.attr}"
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
    }
    return "; ".join(ast.dump(part) for part in [*parts, *decorators]), frozenset(used - {name})


def _is_text(line: ast.stmt) -> bool:
    return isinstance(line, ast.Expr) and isinstance(cast(Any, line.value), ast.Constant)
