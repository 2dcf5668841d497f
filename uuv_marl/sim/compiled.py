"""Decorators that compile with Numba, and the on-disk cache of compiled code.

The cache's key is a hash of all the code that a function is compiled from (``uuv_marl.sim.sources``), so that it is
never out of date.
"""

import contextlib
import functools
import glob
import logging
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.core import caching as _caching
from numba.core import config as _config

from uuv_marl.paths import user_path
from uuv_marl.sim.sources import source_key

F = TypeVar("F", bound=Callable[..., Any])
_log = logging.getLogger("uuv_marl")
_UNUSED_S = 30 * 86400.0
"""Compiled code unused for this time is deleted."""
_QUIET_S = 60.0
"""Functions compiled within this time of each other share one message."""
_settings, caching = cast(Any, _config), cast(Any, _caching)
_last_compiled = -_QUIET_S


@functools.cache
def cache() -> Path | None:
    """Folder of compiled code, in ``UUV_MARL_CACHE_DIR`` or the user's cache folder; None if it can't be used.

    It may be read-only where it was prepared by others, as in a container's image.
    """
    folder: Path | str = "of the user"
    try:
        folder = user_path(os.environ.get("UUV_MARL_CACHE_DIR") or platformdirs.user_cache_dir("uuv_marl"))
        if folder.parts[0].startswith("~"):
            raise OSError(0, "no home folder is known")
        for name in ("uuv_marl-compiled", f"numba-{numba.__version__}"):
            folder = folder / name
            _make(folder)
        return folder
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder is known
        _log.warning(
            "The compile cache %s can't be used (%s), so every start compiles again, for up to a minute. "
            "Set UUV_MARL_CACHE_DIR to a writable folder of your own.",
            folder,
            getattr(error, "strerror", None) or error,
        )
        return None


def _make(folder: Path) -> None:
    """Make a folder that only this user or root may write to, since loading compiled code executes it.

    Raises OSError if it is another's.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o755)
    status = folder.stat()
    if hasattr(os, "getuid") and (status.st_uid not in (os.getuid(), 0) or status.st_mode & 0o022):
        raise OSError(0, "it belongs to another user, or others may write to it")


class _Locator(caching._CacheLocator):
    """Numba's locator of a function's files, by the hash of its code."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file = py_file
        self._key = _key(py_func)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(cache())

    def get_source_stamp(self) -> str:
        return cast(str, self._key)

    get_disambiguator = get_source_stamp


class _Implementation(caching.CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _Cache(caching.FunctionCache):
    """Numba's cache of one function, which tolerates broken files and a full disk, and logs compilations."""

    _impl_class = _Implementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load the code compiled for these types, or None."""
        index = Path(self._cache_file._index_path)
        try:
            overload: Any = caching.FunctionCache.load_overload(self, sig, target_context)
        except Exception:  # a truncated file can raise any error of unpickling
            overload = None
            with contextlib.suppress(OSError):
                index.unlink(missing_ok=True)
        if overload is None:
            _announce(cast(Path, cache()))
        else:
            with contextlib.suppress(OSError):
                os.utime(index)
        return overload

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save compiled code."""
        if not os.access(cast(Path, cache()), os.W_OK):
            return
        try:
            caching.FunctionCache.save_overload(self, sig, data)
        except OSError as error:
            _log.warning("%s can't be kept (%s), so the next start compiles again.", self.cache_path, error.strerror)
            self.disable()


def _announce(folder: Path) -> None:
    """Log that compiling takes long, and delete unused code meanwhile."""
    global _last_compiled  # noqa: PLW0603 - a clock of this process
    if time.monotonic() - _last_compiled > _QUIET_S:
        writable = os.access(folder, os.W_OK)
        outcome = "is kept in %s" if writable else "can't be kept, since %s can't be written to"
        _log.warning(f"Compiling a part of uuv_marl: this takes up to a minute, and {outcome}.", folder)
        if writable:
            prune(folder.parent)
    _last_compiled = time.monotonic()


def prune(folder: Path) -> None:
    """Delete compiled code unused for a month, also of other versions of Numba."""
    for index in folder.glob("numba-*/*.nbi*"):
        with contextlib.suppress(OSError):  # another process may delete, too; folders that are not empty stay
            if time.time() - index.stat().st_mtime > _UNUSED_S:
                for path in index.parent.glob(f"{glob.escape(index.name.partition('.nbi')[0])}.*nb[ci]*"):
                    path.unlink(missing_ok=True)
                index.parent.rmdir()


def _key(function: Callable[..., Any]) -> str | None:
    """Key of a function's compiled code in the cache, None if it can't be kept."""
    return source_key(function.__module__, repr((_settings.BOUNDSCHECK, _settings.OPT, _OPTIONS)))


# Without Numba's runtime (_nrt) no references are counted, which would take longer than the physics.
_OPTIONS: dict[str, object] = {"error_model": "numpy", "nogil": True, "_nrt": False}


def compiled(function: F) -> F:
    """Compile with Numba on the first call; IEEE arithmetic is strict, so that results don't depend on the caller."""
    return _jit(function)


def compiled_inline(function: F) -> F:
    """Compile as ``compiled`` does, but inline the function into its callers, so that loops are vectorised."""
    return _jit(function, forceinline=True)


def compiled_inner(function: F) -> F:
    """As ``compiled``, for compiled callers only: functions of many arrays compile faster without Python wrappers."""
    dispatcher = cast(Any, _jit(function, no_cpython_wrapper=True, no_cfunc_wrapper=True))

    def refuse(*_args: object, **_names: object) -> None:
        raise TypeError(f"{function.__name__} can be called by compiled code only")

    # A call from Python would crash in the missing wrapper, so that it must be refused.
    def ignore(*_args: object) -> None:
        return

    dispatcher._insert, dispatcher._compile_for_args = ignore, refuse
    return cast(F, dispatcher)


def from_source(name: str, parameters: str, value: str, scope: dict[str, Any]) -> Callable[..., Any]:
    """A function that returns the value of an expression, to be compiled; ``scope`` holds its module's globals.

    For expressions made from a declaration, since Numba can't loop over the fields of a NamedTuple.
    """
    source, made = f"def {name}({parameters}):\n    return {value}\n", dict[str, Any]()
    exec(compile(source, scope["__file__"], "exec"), scope, made)  # noqa: S102 - the source is the package's own
    return made[name]


def entry(function: F, *arguments: object) -> F:
    """A ``compiled`` function for exactly these types of arguments, which a call doesn't check.

    For functions of many arrays, where checking takes up to a third of a step. An array of another type, number of axes
    or memory layout goes unnoticed.
    """
    dispatcher = cast(Any, function)
    if _settings.DISABLE_JIT:
        return function
    return cast(F, dispatcher.compile(tuple(cast(Any, numba).typeof(argument) for argument in arguments)))


def _jit(function: F, **options: object) -> F:
    dispatcher = cast(Any, numba).njit(**options, **_OPTIONS)(function)
    if not _settings.DISABLE_JIT and cache() is not None and _key(function) is not None:
        dispatcher._cache = _Cache(function)
    return cast(F, dispatcher)
