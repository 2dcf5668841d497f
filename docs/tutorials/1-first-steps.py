# %% [markdown]
# # 1. First steps
#
# A swarm of five vehicles passes an obstacle. You will see what one vehicle observes, how the episode ends, a replay,
# and how to make a scenario of your own.
#
# - **Time**: about 2 minutes on two cores, of which 60 s are compiling at the first run.
# - **Needs**: the extras `analysis` and `render`; the first cell installs uuv_marl where it is missing.
#
# ## A swarm and its controller
#
# A scenario holds every number of a simulation. `starter` is the smallest that ships: five vehicles, one obstacle, half
# a minute. `for_policy` adds the observations and control loops that a policy requires. Look at those of
# `bio_inspired_plus`.

# %%
import uuv_marl

env = uuv_marl.parallel_env("starter", for_policy="bio_inspired_plus")
print(env.scenario.title)
print("yaw damping:", env.scenario.actuators.yaw_damping_nms, "N m s")

# %% [markdown]
# The policy requires yaw damping, an inner loop that brakes turns, but no compass and no messages.
# [Policies](../policies.md) lists the requirements of each policy.
#
# The environment is a PettingZoo `ParallelEnv`. `reset` gives one observation per vehicle. Look at the length of an
# observation.

# %%
policy = uuv_marl.make_policy("bio_inspired_plus", env)
observations, infos = env.reset(seed=0)
print(env.agents)
print("one observation:", observations["uuv_0"].shape, observations["uuv_0"].dtype)

# %% [markdown]
# ## What one vehicle observes
#
# An observation is a row of 98 numbers, each divided by a scale. `Percept.from_observation` turns the row back into
# fields in physical units. Look at the fields' names: they are also in [the observation's
# table](../environment.md#observation).

# %%
import pandas as pd

from uuv_marl.percept import Percept, PerceptLayout

layout = PerceptLayout.of(env.scenario)
percept = Percept.from_observation(observations["uuv_0"], layout)
rows = [(layout.starts[f.name], f.size, f.quantity.unit, f.quantity.scale) for f in layout.table]
pd.DataFrame(rows, index=list(percept.names), columns=["first entry", "entries", "unit", "scale"])

# %% [markdown]
# All positions are relative to the vehicle: the first number is the distance ahead, the second the distance to
# starboard, the vehicle's right-hand side.
#
# Each of the 21 sub-sectors of the sonar detects its nearest vehicle, or none. Look at how many vehicles are detected,
# and how far away they are.

# %%
import numpy as np

detected = percept["detected"] == 1.0
ahead, starboard = percept["neighbour"][detected].T.astype(float)
neighbours = pd.DataFrame({"ahead [m]": ahead, "to starboard [m]": starboard}, index=np.flatnonzero(detected))
neighbours["distance [m]"] = np.hypot(ahead, starboard)
neighbours.round(1)

# %% [markdown]
# Every row is a sub-sector in which `uuv_0` detects a vehicle. The row has no name, because sonar does not identify
# vehicles. A vehicle behind another in the same sub-sector is not detected.
#
# ## Run the episode
#
# The loop is that of any PettingZoo environment: actions in, observations out, until no agent is left. Look at `ending`
# and `collisions` in the last `infos`.

# %%
while env.agents:
    observations, rewards, terminations, truncations, infos = env.step(policy(observations))
infos["uuv_0"]

# %% [markdown]
# The swarm arrived without a collision. The policy follows l(t), a point that moves for 30 s, so no swarm can arrive
# earlier. `time_s` also includes the 2 s for which the swarm must stay at the end.
#
# ## Watch it
#
# `record` runs an episode as the benchmark does and keeps all of it. `inspect` lists the vehicles to record the sonar
# of. `Replay` shows the recording in a notebook. Press the space bar, and click on vehicle 0 to see its detections.

# %%
from uuv_marl.replay.page import Replay
from uuv_marl.replay.record import record

recording = record(uuv_marl.load_scenario("starter"), "bio_inspired_plus", seed=0, inspect=[0])
Replay([recording])

# %% [markdown]
# `uuv-marl replay` makes the same page, a film or a picture from the command line ([Watch an
# episode](../benchmark.md#watch-an-episode)).
#
# ## Your own scenario
#
# A scenario of your own is a TOML file with the differences from another scenario. All other fields are those of
# `starter`. Look at the loaded values, and at the error for a misspelt field.

# %%
from pathlib import Path

from uuv_marl.scenario import ScenarioError

Path("two.toml").write_text("""
extends = "starter"
title = "Two obstacles"
source = "mine"
version = 1

[swarm]
num_vehicles = 6

[[obstacles]]
centre_m = [30.0, 20.0]
radius_m = 10.0

[[obstacles]]
centre_m = [70.0, -15.0]
radius_m = 8.0
""")
scenario = uuv_marl.load_scenario("two.toml")
print(scenario.title, scenario.swarm.num_vehicles, [disc.radius_m for disc in scenario.obstacles])
try:
    uuv_marl.load_scenario("two.toml", overrides={"swarm.num_vehicle": 7})
except ScenarioError as error:
    print(error)

# %% [markdown]
# You can give the file's path wherever a scenario's name is expected. `overrides` changes a field without a file.
# [Scenarios](../scenarios.md) has more.
#
# Next: [write a policy of your own](2-your-own-policy.ipynb).

# %% tags=["check"]
assert len(observations["uuv_0"]) == 98
assert len(detected) == 21
assert 1 <= detected.sum() <= 4
assert infos["uuv_0"]["ending"] == "arrival"
assert infos["uuv_0"]["collisions"] == 0
assert 32.0 <= infos["uuv_0"]["time_s"] < 40.0
