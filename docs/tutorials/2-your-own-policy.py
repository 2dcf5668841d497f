# %% [markdown]
# # 2. Your own policy
#
# A controller of a dozen lines brings five vehicles past an obstacle as early as possible, without a collision. In
# harder scenarios it collides with obstacles, except with the safety filter that ships.
#
# - **Time**: about 2 minutes on two cores, of which 60 s are compiling at the first run.
# - **Needs**: nothing but uuv_marl; the first cell installs it where it is missing. [First steps](1-first-steps.ipynb)
#   explains the observation.
#
# ## The controller
#
# A policy is a class with a method `decide`. It gets the percept, the observations of all vehicles, and returns a force
# ahead and to starboard for each vehicle, as shares of the full force: so are actions where vehicles decide every
# 0.5 s, which the class requires. All arrays begin with the axes world and vehicle, so code for one vehicle acts for
# all. The cell saves the class in a file for the benchmark.

# %%
# %%writefile mine.py
import numpy as np

from uuv_marl import baselines


class Careful(baselines.Policy):
    """Move to l(t), and away from every detected vehicle and obstacle."""

    requirements = baselines.PolicyRequirements(decision_period_s=0.5, yaw_damping_nms=600.0)

    def decide(self, percept):
        detected = np.concatenate([percept["detected"], percept["echo"]], axis=-1)[..., None]
        position = np.concatenate([percept["neighbour"], percept["echo_position"]], axis=-2)
        squared = np.maximum((position**2).sum(axis=-1, keepdims=True), 1.0)
        away = -(detected * position / squared).sum(axis=-2)
        desired = percept["reference_velocity"] + 0.2 * percept["reference"] + 40.0 * away
        return (0.12 * desired).astype(np.float32)


# %% [markdown]
# `desired` has three parts: the velocity of l(t), the point that the swarm follows; an attraction to l(t); and a
# repulsion from every detection, which halves when the distance doubles. [The observation's
# table](../environment.md#observation) lists the fields that a controller can use.
#
# ## In a table
#
# The benchmark takes the class as `module:Class`. It runs all policies on the same seeds. Look at the columns *task
# time* and *obstacle distance*.

# %% language="bash"
# uuv-marl benchmark --scenario starter --seeds 10 --output results/starter \
#     --policy mine:Careful --policy bio_inspired_plus --policy scout

# %% [markdown]
# `Careful` arrives after 30 s, when l(t) comes to rest, so no policy can be faster. It has no collision, but comes
# within some 2 m of the obstacle. `scout` is about as fast and keeps much more distance.
#
# The benchmark also writes figures. Each panel shows the paths of a policy with one seed.

# %%
from IPython.display import Image

Image("results/starter/figures/starter_routes.png", width=700)

# %% [markdown]
# ## In a harder scenario
#
# `random_field` has another trajectory and other obstacles for each seed. `safety_filter=true` after a policy's name
# puts the policy inside [the safety filter](../policies.md#the-safety-filter), which changes only unsafe actions. Look
# at the collisions.

# %% language="bash"
# uuv-marl benchmark --scenario random_field --set swarm.num_vehicles=10 --seeds 10 --output results/fields \
#     --policy mine:Careful --policy mine:Careful,safety_filter=true --policy scout

# %% [markdown]
# `Careful` collides with obstacles in every seed; a negative distance means inside the disc. Its repulsion depends on
# the distance to the obstacle's centre, which the sonar gives, and the surface of a large obstacle is far from its
# centre. Inside the filter it has no collision and arrives as early.
#
# To improve the controller, use `percept["echo_range"]`, the distance to the surface. After each change of `mine.py`
# add `--restart` to the command: it runs your policy again and keeps the runs of the others. Your policy can also have
# [a memory](../policies.md#policies-with-memory).
#
# Next: [a task of your own](3-your-own-task.ipynb).

# %% tags=["check"]
import uuv_marl.benchmark

runs = uuv_marl.benchmark.load("results/starter").set_index("policy")
assert runs["task_time_s"].notna().all()
assert runs["collisions"].sum() == 0
assert runs.loc["mine:Careful", "task_time_s"].max() < 31.0
assert 1.0 < runs.loc["mine:Careful", "min_obstacle_distance_m"].min() < 3.0
assert runs.loc["scout", "min_obstacle_distance_m"].min() > 10.0
runs = uuv_marl.benchmark.load("results/fields").set_index("policy")
assert (runs.loc["mine:Careful", "collisions"] > 0).all()
assert runs.loc["mine:Careful", "min_obstacle_distance_m"].min() < 0.0
assert runs.loc["mine:Careful,safety_filter=true", "collisions"].sum() == 0
assert runs["task_time_s"].notna().all()
