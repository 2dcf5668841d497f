"""Paths that users give."""

import os
from pathlib import Path

UserPath = str | os.PathLike[str]
"""Types of a path that a user gives."""


def user_path(path: UserPath) -> Path:
    """The path, with ``~`` and ``~name`` at its start expanded to home folders, as in a shell.

    An unknown home is left as it is: it may be a file such as ``~backup.toml``.
    """
    return Path(os.path.expanduser(os.fsdecode(path)))  # noqa: PTH111 - Path.expanduser fails where no home is known
