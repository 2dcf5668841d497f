"""Swarms of unmanned underwater vehicles: a PettingZoo environment, reference controllers and a benchmark.

``parallel_env()``, ``env()`` and ``vector_env(num_envs)`` make environments, ``make_policy(name, env)`` a controller,
``evaluate(name, scenario)`` its metrics, ``load_scenario(name)`` a configuration. ``uuv-marl --help`` shows the command
line. Importing registers ``uuv_marl/Swarm-v2`` and ``uuv_marl/Solo-v2`` with Gymnasium, and ``uuv_marl/uuv_swarm_v2``
with PettingZoo; ``gymnasium.make("uuv_marl:uuv_marl/Solo-v2")`` imports the package itself, also in worker processes.
"""

import importlib
from typing import TYPE_CHECKING, Any

from uuv_marl.envs import registration

__version__ = "0.2.0"

if TYPE_CHECKING:
    from uuv_marl import baselines, uuv_swarm_v2
    from uuv_marl.baselines import make_policy, with_policy_requirements
    from uuv_marl.benchmark.evaluate import evaluate
    from uuv_marl.envs.parallel_env import env, parallel_env
    from uuv_marl.envs.vector_env import vector_env
    from uuv_marl.scenario import load_scenario, scenario_names

__all__ = [
    "__version__", "baselines", "env", "evaluate", "load_scenario", "make_policy", "parallel_env", "scenario_names",
    "uuv_swarm_v2", "vector_env", "with_policy_requirements",
]  # fmt: skip

_HOMES = {
    "uuv_marl.baselines": ("make_policy", "with_policy_requirements"),
    "uuv_marl.benchmark.evaluate": ("evaluate",),
    "uuv_marl.envs.parallel_env": ("env", "parallel_env"),
    "uuv_marl.envs.vector_env": ("vector_env",),
    "uuv_marl.scenario": ("load_scenario", "scenario_names"),
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that ``import uuv_marl`` is quick."""
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(module), name)
    if name in ("baselines", "uuv_swarm_v2"):
        return importlib.import_module(f"uuv_marl.{name}")
    raise AttributeError(f"module 'uuv_marl' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names, for tab completion: they are imported on first use."""
    return sorted(__all__)


registration.register_environments()
