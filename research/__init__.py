"""Research with the package, not part of it: the paper again, the model, held-out seeds, shipped numbers checked."""

from pathlib import Path

from uuv_marl.extras import pictures

with pictures():
    import matplotlib as matplotlib  # first of all, so that every command says which variable it can not use

FOLDER = str(Path(__file__).resolve().parent)
"""Of this package: its lines are not shown as the user's own code."""
