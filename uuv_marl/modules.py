"""User code by name: ``module:attribute``."""

import hashlib
import importlib
import inspect
from pathlib import Path
from typing import Any


def named_object(name: str) -> object:
    """The object that ``module:attribute`` names. Raises ImportError with the reason and remedy, to follow the name."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        remedy = f"run in the folder of {module}.py, or add that folder to PYTHONPATH"
        raise ImportError(f"can't be imported: {error}; {remedy}") from None


def digest(data: bytes) -> str:
    """A short hash, 16 hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()[:16]


def file_digest(code: Any) -> str:
    """Hash of the file of a module, or of the one that defines a class."""
    return digest(Path(inspect.getfile(code)).read_bytes())
