"""Second trainings of the shipped networks: files by their names in tables."""

from pathlib import Path

SECOND = {file.stem: str(file) for file in sorted(Path(__file__).parent.glob("verify/weights/*.safetensors"))}
"""Paths by name."""


def runnable(policy: str) -> str:
    """The policy of a name in a table: the path of a second training, any other name unchanged."""
    return SECOND.get(policy, policy)


def first_of(policy: str) -> str:
    """The name of the network that a second training repeats: that of ``mappo_2`` is ``mappo``."""
    return policy.rpartition("_")[0]
