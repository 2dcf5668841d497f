"""Hashes of the code that a compiled function depends on: its module and all that this module imports.

Numba notices an edit of a function's own file, but not of functions or constants in other files. So its cache is keyed
by all modules that the function can reach, without comments and docstrings.
"""

import ast
import functools
import hashlib
import importlib.util
import sys
from collections.abc import Iterator
from typing import Any, cast


@functools.cache
def source_key(module: str, settings: str = "") -> str | None:
    """Hash of the code that a module's functions are compiled from, and of ``settings``; None without sources.

    A package without sources (byte code only, or frozen) has no key, since changes would go unnoticed.
    """
    hashes = {name: _hash(name) for name in reached_modules(module)}
    if None in hashes.values():
        return None
    return hashlib.sha256(repr((settings, sorted(hashes.items()))).encode()).hexdigest()[:16]


@functools.cache
def reached_modules(module: str) -> frozenset[str]:
    """The module, and those of its own package and of uuv_marl that it imports, directly or through others."""
    packages = {"uuv_marl", module.partition(".")[0]}
    modules, waiting = set[str](), {module}
    while waiting:
        name = waiting.pop()
        modules.add(name)
        named = {other for other in _named(name) if other.partition(".")[0] in packages} - modules
        waiting |= {other for other in named if _is_module(other)}
    return frozenset(modules)


@functools.cache
def _tree(module: str) -> ast.Module | None:
    """Syntax tree of a module, also in a zip file, without docstrings; None if there is only byte code."""
    loader: Any = getattr(sys.modules.get(module), "__loader__", None)
    if loader is None:
        spec = importlib.util.find_spec(module)
        loader = spec and spec.loader
    try:
        source = loader.get_source(module) if hasattr(loader, "get_source") else None
    except (ImportError, OSError):
        return None
    tree = None if source is None else ast.parse(source)
    for node in ast.walk(tree) if tree else ():
        body = getattr(node, "body", None)
        if isinstance(body, list):
            cast(Any, node).body = [line for line in cast(list[ast.AST], body) if not _is_text(line)]
    return tree


@functools.cache
def _hash(module: str) -> str | None:
    tree = _tree(module)
    return tree and hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _named(module: str) -> Iterator[str]:
    """All modules and names in modules that a module's import statements name."""
    tree = _tree(module)
    own = sys.modules.get(module)
    for node in ast.walk(tree) if tree else ():
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            relative = "." * node.level + (node.module or "")
            home = importlib.util.resolve_name(relative, getattr(own, "__package__", None) or module)
            yield from (home, *(f"{home}.{alias.name}" for alias in node.names))


def _is_module(name: str) -> bool:
    try:
        return name in sys.modules or importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _is_text(line: ast.AST) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)
