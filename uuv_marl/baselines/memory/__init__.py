"""What vehicles remember of their surroundings, from their own percepts alone."""

from uuv_marl.baselines.memory.surroundings import OwnModel, update_memory
from uuv_marl.baselines.memory.table import Surroundings

__all__ = ["OwnModel", "Surroundings", "update_memory"]
