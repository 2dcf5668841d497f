"""Atomic file writes, and locks on folders."""

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from uuv_marl.errors import ResultsError

_LOCK, _OWNER = ".lock", ".owner"


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an OSError within the context (full disk, missing rights) into a ResultsError that names ``path``."""
    try:
        yield
    except OSError as error:
        raise ResultsError(
            f"{path} can't be written ({error.strerror or error}). What was finished before is safe; make room there, "
            "permit writing or give another --output, and give the command again"
        ) from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to, which replaces ``path`` at the end of the context.

    A crash, a full disk or an exception leaves the previous file unchanged. The path is in the same folder, which must
    exist, and has the same suffix. Raises ResultsError if it can't be written.
    """
    partial = path.with_name(f"{path.stem}.partial{path.suffix}")
    with writing(path):
        try:
            yield partial
            with partial.open("rb+") as file:
                os.fsync(file)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 atomically, with line ends unchanged. Raises ResultsError."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="")


@contextmanager
def locked(folder: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Lock a folder for this context, and create it if it is missing.

    The operating system holds the lock and frees it when the process ends. Two hidden files remain in the folder:
    ``.lock``, and while locked ``.owner``, which names the process. A folder created here that stays empty is removed.
    Waits up to ``wait_s`` [s] for another context to end, in this process or another; then raises ResultsError.
    """
    lock, owner, is_new = FileLock(folder / _LOCK), folder / _OWNER, not folder.exists()
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=wait_s)
        except Timeout:
            holder = owner.read_text(encoding="utf-8") if owner.exists() else "another command"
            raise ResultsError(
                f"{folder} is in use by {holder}; wait until it has ended, or give another --output"
            ) from None
    try:
        since = time.strftime("%Y-%m-%d %H:%M:%S")
        write_text(owner, f"process {os.getpid()} on {socket.gethostname()} since {since}")
        yield
    finally:
        owner.unlink(missing_ok=True)
        lock.release()
        if is_new and {path.name for path in folder.iterdir()} <= {_LOCK}:  # it failed before it wrote anything
            (folder / _LOCK).unlink(missing_ok=True)
            folder.rmdir()
