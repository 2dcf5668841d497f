"""What vehicles remember of their surroundings, from their own percepts alone."""

from uuv_marl.baselines.memory.surroundings import Model, listen
from uuv_marl.baselines.memory.table import Surroundings

__all__ = ["Model", "Surroundings", "listen"]
