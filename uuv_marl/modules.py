"""User code by name: ``module:attribute``."""

import importlib


def named_object(name: str) -> object:
    """The object that ``module:attribute`` names. Raises ImportError with the reason and remedy, to follow the name."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        remedy = f"run in the folder of {module}.py, or add that folder to PYTHONPATH"
        raise ImportError(f"can't be imported: {error}; {remedy}") from None
