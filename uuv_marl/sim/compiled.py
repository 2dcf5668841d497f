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
_COMPILED_PARTS = (".", "sim", "baselines")
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
            "The compile cache %s can't be written (%s), so every start compiles anew, for about a minute. "
            "Set UUV_MARL_CACHE_DIR to a writable folder.",
            folder,
            error.strerror,
        )
        return None
    return folder


def is_first_compilation() -> bool:
    """Whether nothing of this version has been compiled and kept yet, so that the first step takes long."""
    folder = cache_dir()
    return folder is None or not any(folder.rglob("*.nbi"))


def compiled(function: F) -> F:
    """Compile with Numba on the first call; strict IEEE arithmetic, so that results don't depend on the caller."""
    return _jit(function)


def compiled_inline(function: F) -> F:
    """As ``compiled``, but copied into its callers: for innermost bodies, where a call costs more than they do."""
    return _jit(function, inline="always")


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
        decorate = cast(Any, numba).njit(cache=folder is not None, **options, error_model="numpy", nogil=True)
        return cast(F, decorate(function))
    finally:
        settings.CACHE_DIR = before
