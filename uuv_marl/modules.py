"""User code by name: ``module:attribute``."""

import importlib


def named_object(name: str) -> object:
    """The object that ``module:attribute`` names. Raises ImportError with a reason that continues the name."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ImportError(f"can't be imported: {error}") from None
