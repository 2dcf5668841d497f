"""The safety filter and the policies that use it."""

from uuv_marl.baselines.safety.barrier import GUARD, Barrier

__all__ = ["GUARD", "Barrier"]
