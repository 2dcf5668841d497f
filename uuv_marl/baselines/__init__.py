"""Policies: percepts in, actions out. ``make(name, scenario_or_env)`` gives one; ``POLICIES`` lists them."""

from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.registry import POLICIES, EnvPolicy, granted, make

__all__ = ["POLICIES", "EnvPolicy", "Policy", "PolicyError", "granted", "make"]
