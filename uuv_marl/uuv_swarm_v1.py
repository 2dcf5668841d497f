"""PettingZoo's module form of the environment: ``from uuv_marl import uuv_swarm_v1``."""

from uuv_marl.envs.parallel_env import SwarmParallelEnv as raw_env
from uuv_marl.envs.parallel_env import env, parallel_env

__all__ = ["HISTORY", "env", "parallel_env", "raw_env"]

HISTORY = {
    "v0": "first version",
    "v1": 'the default reward is dense, with progress towards the reference; v0\'s is reward="sparse"; the clocks of '
    "starter are those of a learner",
}
"""What changed in physics, observation, action or reward, by version of the environment."""
