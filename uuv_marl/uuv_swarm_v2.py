"""PettingZoo's module form of the environment: ``from uuv_marl import uuv_swarm_v2``."""

from uuv_marl.envs.parallel_env import SwarmParallelEnv as raw_env
from uuv_marl.envs.parallel_env import env, parallel_env

__all__ = ["HISTORY", "env", "parallel_env", "raw_env"]

HISTORY = {
    "v0": "first version",
    "v1": 'the default reward is dense, with progress towards the reference; v0\'s is reward="sparse"; the clocks of '
    "starter are those of a learner",
    "v2": "reach, hard_water and few_informed reward staying at the goal instead of the first arrival; v1's is "
    'reward="first_arrival"; the state has the time left and what the task remembers; lanes and slots follow from the '
    "channel identity",
}
"""What changed in physics, observation, action or reward, by version of the environment."""
