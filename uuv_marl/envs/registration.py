"""Entries in the registries of Gymnasium and PettingZoo; an id that begins with ``uuv_marl:`` imports the package."""

import gymnasium
import pettingzoo


def register_environments() -> None:
    """Register for ``gymnasium.make``, ``gymnasium.make_vec`` and ``pettingzoo.make``."""
    gymnasium.register("uuv_marl/Swarm-v2", vector_entry_point="uuv_marl.envs.vector_env:vector_env")
    gymnasium.register("uuv_marl/Solo-v2", entry_point="uuv_marl.envs.solo:SoloEnv")
    pettingzoo.register("parallel", "uuv_marl/uuv_swarm_v2", "uuv_marl.envs.parallel_env:parallel_env")
    pettingzoo.register("aec", "uuv_marl/uuv_swarm_v2", "uuv_marl.envs.parallel_env:env")
