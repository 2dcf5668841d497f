"""Second trainings of networks that ship: files, by the names that tables and rows give them."""

from pathlib import Path

SECOND = {file.stem: str(file) for file in sorted(Path(__file__).parent.glob("verify/weights/*.safetensors"))}
"""Paths by name."""


def runnable(policy: str) -> str:
    """What ``make_policy`` takes for a policy's name in a table: a second training's path, any other name as it is."""
    return SECOND.get(policy, policy)
