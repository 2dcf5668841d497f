"""Numba behind one decorator: compiled code is kept on disk, and never serves old physics.

Each function is kept under a hash of all the code that it is compiled from (``uuv_marl.sim.sources``), whatever
checkout or version it belongs to: who edits a kernel compiles what uses it, and nothing else.
"""

import contextlib
import functools
import importlib
import logging
import os
import tempfile
import time
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.core import caching as _caching
from numba.core import config as _config

from uuv_marl.sim.sources import source_key

F = TypeVar("F", bound=Callable[..., Any])
_log = logging.getLogger("uuv_marl")
_UNUSED_S = 30 * 86400.0
"""Compiled code that nobody loaded for so long is deleted."""
_SPINS = {"GOMP_SPINCOUNT": "2000"}
"""Some microseconds: from 2,000 on, steps are as fast on an idle machine as by default; with 0, three times as slow."""
_QUIET_S = 60.0
"""One message is enough for functions that are compiled closer together than this."""
_settings, caching = cast(Any, _config), cast(Any, _caching)
_last_compiled = -_QUIET_S


@functools.cache
def cache_dir() -> Path | None:
    """Folder of the compiled code: ``UUV_MARL_CACHE_DIR`` or the user's cache; None where it can't be used."""
    root = Path(os.environ.get("UUV_MARL_CACHE_DIR") or platformdirs.user_cache_dir("uuv_marl"))
    folder = root / f"numba-{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        # Loading compiled code executes it, so nobody else may be able to put some there.
        if hasattr(os, "getuid") and (folder.stat().st_uid != os.getuid() or folder.stat().st_mode & 0o002):
            raise OSError(0, "it belongs to another user, or everybody may write to it")
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        _log.warning(
            "The compile cache %s can't be used (%s), so every start compiles anew, for up to a minute. "
            "Set UUV_MARL_CACHE_DIR to a writable folder of your own.",
            folder,
            error.strerror,
        )
        return None
    return folder


class _Locator(caching._CacheLocator):
    """Names a function's files in the cache by the code that it is compiled from."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file = py_file
        self._key = source_key(py_func, _settings.BOUNDSCHECK, _settings.OPT, _OPTIONS)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(cache_dir())

    def get_source_stamp(self) -> str:
        return self._key

    def get_disambiguator(self) -> str:
        return self._key


class _Implementation(caching.CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _Cache(caching.FunctionCache):
    """Numba's cache of one function, which survives broken files and a full disk, and says when it compiles."""

    _impl_class = _Implementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for these types, or None."""
        index = Path(self._cache_file._index_path)
        try:
            found: Any = caching.FunctionCache.load_overload(self, sig, target_context)
        except Exception:  # a file cut off by a power cut raises whatever unpickling meets
            found = None
            with contextlib.suppress(OSError):
                index.unlink(missing_ok=True)
        if found is None:
            _announce(index.parent)
        else:
            _touch(index)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled."""
        try:
            caching.FunctionCache.save_overload(self, sig, data)
        except OSError as error:
            _log.warning("%s can't be kept (%s), so the next start compiles anew.", self.cache_path, error.strerror)
            self.disable()


def _touch(index: Path) -> None:
    """Remember that a file was used, once a day."""
    with contextlib.suppress(OSError):
        if time.time() - index.stat().st_mtime > 86400.0:
            os.utime(index)


def _announce(folder: Path) -> None:
    """Say that compiling takes long, and tidy up meanwhile."""
    global _last_compiled  # noqa: PLW0603 - a clock of this process
    if time.monotonic() - _last_compiled > _QUIET_S:
        _log.warning("Compiling a part of uuv_marl, once: this takes up to a minute, and is kept in %s.", folder)
        prune(folder.parent)
    _last_compiled = time.monotonic()


def prune(root: Path) -> None:
    """Delete compiled code that has not been used for a month, version 0.1.0's too; ``root`` is the cache's folder."""
    for folder in [*root.glob("compiled-*"), *root.glob("numba-*")]:
        old = [index for index in folder.rglob("*.nbi") if time.time() - index.stat().st_mtime > _UNUSED_S]
        with contextlib.suppress(OSError):  # another process may tidy up, too
            for path in [file for index in old for file in index.parent.glob(f"{index.stem}*")]:
                path.unlink(missing_ok=True)
            for place in sorted([folder, *folder.rglob("*/")], reverse=True):
                if not any(place.iterdir()):
                    place.rmdir()


# Without Numba's runtime nothing is allocated, and no array's references are counted: with it, that counting takes more
# time than the physics, since every call counts every array it is given.
_OPTIONS: dict[str, object] = {"error_model": "numpy", "nogil": True, "_nrt": False}


def compiled(function: F) -> F:
    """Compile with Numba on the first call; strict IEEE arithmetic, so that results don't depend on the caller."""
    return _jit(function)


def compiled_inline(function: F) -> F:
    """Compile as ``compiled`` does, but copy the function into its callers, so that loops run on vector registers."""
    return _jit(function, forceinline=True)


def compiled_inner(function: F) -> F:
    """As ``compiled``, for compiled callers alone: what takes all arrays of a world compiles faster without a door."""
    dispatcher = cast(Any, _jit(function, no_cpython_wrapper=True, no_cfunc_wrapper=True))

    def refuse(*_args: object, **_names: object) -> None:
        raise TypeError(f"{function.__name__} can be called by compiled code only")

    # A call from Python would run into the missing door; so Numba is never told of one, and asked to open one, refuses.
    def ignore(*_args: object) -> None:
        return

    dispatcher._insert, dispatcher._compile_for_args, dispatcher.is_inner = ignore, refuse, True
    return cast(F, dispatcher)


@functools.cache
def interpreted(function: F) -> F:
    """The Python of a ``compiled_inner`` function and of those that it calls; functions with a door stay compiled."""
    plain = getattr(function, "py_func", None)
    if plain is None:  # Numba is switched off: it is Python already
        return function
    used = {name: plain.__globals__[name] for name in plain.__code__.co_names if name in plain.__globals__}
    inner = {name: interpreted(value) for name, value in used.items() if getattr(value, "is_inner", False)}
    space = {**plain.__globals__, **inner}
    return cast(F, types.FunctionType(plain.__code__, space, plain.__name__))


def compiled_parallel(function: F) -> F:
    """Compile with Numba, ``prange`` running over threads."""
    _let_idle_threads_sleep()
    return _jit(function, parallel=True)


@functools.cache
def _let_idle_threads_sleep() -> None:
    """Load the pool of threads that Numba takes from OpenMP so that a thread without work soon sleeps.

    By default it spins for milliseconds, and takes the core from other programs: beside two of them, a benchmark took
    ten times as long. GNU's OpenMP reads how long to spin when it is loaded; users who have set that keep their own.
    """
    if not {*_SPINS, "OMP_WAIT_POLICY"} & {*os.environ}:
        os.environ.update(_SPINS)
        try:
            importlib.import_module("numba.np.ufunc.omppool")
        except ImportError:
            _log.debug("Numba has no OpenMP on this machine, so its threads wait in their own way.")
        finally:
            for name in _SPINS:
                del os.environ[name]


def _jit(function: F, **options: object) -> F:
    dispatcher = cast(Any, numba).njit(**options, **_OPTIONS)(function)
    if cache_dir() is not None and not _settings.DISABLE_JIT:
        dispatcher._cache = _Cache(function)
    return cast(F, dispatcher)
