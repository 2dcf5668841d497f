"""Optional libraries: messages that name the extra to install, and quiet loggers."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

from uuv_marl.errors import MissingExtraError, PictureError


@contextmanager
def extra(name: str, what: str | None = None) -> Iterator[None]:
    """Context for imports of the extra ``name``'s libraries, which ``what`` needs (by default the import itself).

    Raises MissingExtraError, which names ``pip install 'uuv_marl[name]'``, if a library is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if isinstance(error, MissingExtraError) or library == "uuv_marl":
            raise
        raise MissingExtraError(
            f"{what or 'this'} needs {library}, which comes with the extra {name!r}: pip install 'uuv_marl[{name}]', or "
            f"in a checkout pip install -c constraints.txt '.[{name}]'",
            name=library,
        ) from None


@contextmanager
def pictures() -> Iterator[None]:
    """Context for imports of Matplotlib. Raises PictureError if it rejects the variable MPLBACKEND."""
    try:
        yield
    except ValueError as error:
        backend = os.environ.get("MPLBACKEND")
        if not backend or backend not in str(error):
            raise
        raise PictureError(
            f"MPLBACKEND must be a backend of Matplotlib, got {backend!r}; unset it, or set it to agg"
        ) from None


@contextmanager
def silenced(logger: str, level: int) -> Iterator[None]:
    """Suppress a library's log messages below a level within the context. Enter it after the library's import."""
    log = logging.getLogger(logger)
    before = log.level
    log.setLevel(level)
    try:
        yield
    finally:
        log.setLevel(before)
