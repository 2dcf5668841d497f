"""Memory of a vehicle's surroundings, from its own percepts alone; ``Policy`` clears it at a reset."""

from uuv_marl.baselines.memory.surroundings import OwnModel, update_memory
from uuv_marl.baselines.memory.table import Surroundings

__all__ = ["OwnModel", "Surroundings", "update_memory"]
