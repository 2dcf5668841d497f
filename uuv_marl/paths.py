"""The one door of every path that a user gives."""

import os
from pathlib import Path

UserPath = str | os.PathLike[str]
"""What a user may give for a path."""


def user_path(path: UserPath) -> Path:
    """The path that a user means: ``~`` and ``~name`` at its start are home folders, as in a shell.

    As there, what names no known home stays as it is: it may be a file such as ``~backup.toml``.
    """
    return Path(os.path.expanduser(os.fsdecode(path)))  # noqa: PTH111 - Path.expanduser fails where no home is known
