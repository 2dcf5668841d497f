"""Research with the package, not part of it: the paper again, the model, held-out seeds, shipped numbers checked."""

from pathlib import Path

FOLDER = str(Path(__file__).resolve().parent)
"""Of this package: its lines are not shown as the user's own code."""
