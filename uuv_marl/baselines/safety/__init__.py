"""The safety filter, and who keeps to it."""

from uuv_marl.baselines.safety.barrier import GUARD, Barrier

__all__ = ["GUARD", "Barrier"]
