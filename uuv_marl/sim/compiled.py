"""Numba behind one decorator: compiled code is cached on disk, and the cache never serves old physics.

Numba recompiles a function when its own file changes, but not when a function that it *calls* lives in another
file that has changed. So the cache lives in a folder named by a hash of every file that compiled code comes from.
"""

import functools
import hashlib
import logging
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.core import config

F = TypeVar("F", bound=Callable[..., Any])
_PACKAGE = Path(__file__).resolve().parent.parent
_COMPILED_PARTS = (".", "sim", "baselines", "envs")
_log = logging.getLogger("uuv_marl")


def source_hash(package: Path = _PACKAGE) -> str:
    """Hash of every source file that holds compiled code, or constants and layouts that compiled code freezes."""
    digest = hashlib.sha256()
    for part in _COMPILED_PARTS:
        for path in sorted((package / part).glob("*.py")):
            digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


@functools.cache
def cache_dir() -> Path | None:
    """Folder of the compiled code: under ``UUV_MARL_CACHE_DIR`` or the user's cache; None where it is unwritable."""
    root = Path(os.environ.get("UUV_MARL_CACHE_DIR") or platformdirs.user_cache_dir("uuv_marl"))
    folder = root / f"compiled-{source_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        _log.warning(
            "The compile cache %s can't be written (%s), so every start compiles anew, for half a minute. "
            "Set UUV_MARL_CACHE_DIR to a writable folder.",
            folder,
            error.strerror,
        )
        return None
    return folder


@functools.cache
def announce_compilation() -> None:
    """Log, once per process, that the first step takes long where nothing of this version has been compiled yet."""
    folder = cache_dir()
    if folder is not None and not any(folder.rglob("*.nbi")):
        _log.warning(
            "First run of this version of uuv_marl: compiling takes about half a minute, once. It is kept in %s.",
            folder,
        )


def compiled(function: F) -> F:
    """Compile with Numba on the first call; strict IEEE arithmetic, so that results don't depend on the caller."""
    return _jit(function)


def compiled_inline(function: F) -> F:
    """As ``compiled``, but always copied into its callers: for what loops are to run on vector registers."""
    return _jit(function, forceinline=True)


def compiled_parallel(function: F) -> F:
    """Compile with Numba, ``prange`` running over threads."""
    return _jit(function, parallel=True)


def _jit(function: F, **options: object) -> F:
    folder = cache_dir()
    # Numba picks a function's cache folder while decorating it: set ours for that moment and for nobody else.
    settings = cast(Any, config)
    before = settings.CACHE_DIR
    try:
        if folder is not None:
            settings.CACHE_DIR = str(folder)
        # Without Numba's runtime nothing is allocated, and no array's references are counted: with it, that counting
        # takes more time than the physics, since every call counts every array it is given.
        decorate = cast(Any, numba).njit(
            cache=folder is not None, **options, error_model="numpy", nogil=True, _nrt=False
        )
        return cast(F, decorate(function))
    finally:
        settings.CACHE_DIR = before
