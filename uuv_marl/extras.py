"""Optional libraries: where one is missing, the message names the extra that brings it; and how they are made quiet."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

from uuv_marl.errors import MissingExtraError, PictureError


@contextmanager
def extra(name: str, what: str | None = None) -> Iterator[None]:
    """Imports of an extra's libraries belong into this block.

    Args:
        name: of the extra, as in ``pip install 'uuv_marl[train]'``.
        what: what needs the library, as the message names it; by default the import itself.

    Raises:
        MissingExtraError: one of the libraries is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if isinstance(error, MissingExtraError) or library == "uuv_marl":
            raise
        raise MissingExtraError(
            f"{what or 'this'} needs {library}, which comes with the extra {name!r}: pip install 'uuv_marl[{name}]'",
            name=library,
        ) from None


@contextmanager
def pictures() -> Iterator[None]:
    """Imports of Matplotlib belong into this block. Raises PictureError where it refuses the variable MPLBACKEND."""
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
    """Let a library's logger tell nothing below this level for the block alone. To be entered once it is imported."""
    log = logging.getLogger(logger)
    before = log.level
    log.setLevel(level)
    try:
        yield
    finally:
        log.setLevel(before)
