# %% [markdown]
# # 3. Your own task
#
# You write a task, rendezvous: vehicles without a goal gather by sonar alone. A simple controller succeeds in most
# episodes, and a film shows how.
#
# - **Time**: about 2 minutes on two cores, of which 60 s are compiling at the first run.
# - **Needs**: the extra `render`; the first cell installs uuv_marl where it is missing. [Your own
#   policy](2-your-own-policy.ipynb) explains the controller.
#
# ## The task
#
# A task is a class whose methods give the start of an episode, the vehicles at their goal, the end of the episode, and
# the reward. `self.swarm` is the simulation: `state` holds positions and velocities, `facts` distances and collisions.
# A task must define `reward`, `at_goal` and `done`; all other methods have a default. Look at `at_goal`: it
# decides which vehicles succeed.

# %%
# %%writefile meet.py
import numpy as np

from uuv_marl import baselines
from uuv_marl.scenario.fields import Positive, Section
from uuv_marl.tasks import Task


class Rendezvous(Task):
    """Gather within near_m of the swarm's centre."""

    class Numbers(Section):
        near_m: Positive = 10.0

    rewards = {"dense": {"away": "-0.01/m for each decision", "collision": "-10 for each"}}

    def draw(self, world, rng):  # no vehicle observes l(t), and there are no obstacles
        drawn = super().draw(world, rng)
        return drawn._replace(informed=np.zeros_like(drawn.informed), obstacles=np.zeros((0, 3)))

    def away(self):  # distances from the swarm's centre [m], shape (world, vehicle)
        offset = self.swarm.state.eta[:, :, :2] - self.swarm.facts.centre[:, None]
        return np.linalg.norm(offset, axis=-1)

    def at_goal(self):  # which vehicles are at their goal, shape (world, vehicle)
        return self.away() <= self.numbers.near_m

    def done(self):  # in which worlds the episode ends, shape (world,)
        return np.all(self.at_goal(), axis=1)

    def reward(self, running):  # the terms of the reward, shape (world, vehicle)
        return {"away": -0.01 * self.away(), "collision": -10.0 * self.swarm.facts.vehicle_collisions}

    def marks(self, world):  # circles to draw: north, east and radius
        return np.array([[*self.swarm.facts.centre[world], self.numbers.near_m]])


class Join(baselines.Policy):
    """Move slowly towards detected vehicles, and away from near ones."""

    def decide(self, percept):
        detected, position = percept["detected"][..., None], percept["neighbour"]
        squared = np.maximum((position**2).sum(axis=-1, keepdims=True), 1.0)
        desired = (detected * position * (1.0 - 50.0 / squared)).sum(axis=-2)
        return np.clip(0.005 * desired, -0.1, 0.1).astype(np.float32)  # a force ahead and to starboard


# %% [markdown]
# `near_m` is a number that a scenario may change. `draw` removes the obstacles and l(t), the reference of other tasks.
# [The table of all methods](../tasks.md#write-a-task) says when each one is called.
#
# ## An episode
#
# Every environment takes a task as `module:Class`. Look at the number of vehicles at their goal at the start and at the
# end.

# %%
from meet import Join

import uuv_marl

env = uuv_marl.parallel_env("starter", task="meet:Rendezvous")
policy = Join(env.scenario)
percept = env.swarm.reset(seed=1)
print("at the goal at the start:", env.swarm.task.at_goal().sum(), "of", env.scenario.swarm.num_vehicles)
while not env.swarm.task.done()[0]:
    percept = env.swarm.step(policy.act(percept))
print("at the goal after", env.swarm.facts.time_s[0], "s:", env.swarm.task.at_goal().sum())

# %% [markdown]
# ## In a table
#
# The benchmark measures your task like those that ship. `idle` does nothing. Look at the column *swarm success*.

# %% language="bash"
# uuv-marl benchmark --scenario starter --set task=meet:Rendezvous --seeds 10 --output results/meet \
#     --policy meet:Join --policy idle

# %% [markdown]
# A swarm succeeds if every vehicle is at its goal and has had no collision. `Join` always succeeds. `idle` never does,
# because the vehicles start too far apart.
#
# ## A film
#
# `uuv-marl replay` draws any episode. The circle is the task's mark. The film also shows l(t), which no vehicle
# observes.

# %% language="bash"
# uuv-marl replay --scenario starter --set task=meet:Rendezvous --policy meet:Join --seed 1 --output meet.gif

# %%
from IPython.display import Image

Image("meet.gif", width=400)

# %% [markdown]
# [`examples/extending/task.py`](../../examples/extending/task.py) is the same task with an additional entry in the
# observation and an additional column in the table. To train a network on your task, add `--set task=meet:Rendezvous`
# to the command of the next tutorial.
#
# Next: [train a policy](4-train-and-watch.ipynb) instead of writing one.

# %% tags=["check"]
import uuv_marl.benchmark

runs = uuv_marl.benchmark.load("results/meet").set_index("policy")
success = runs["swarm_success"]
assert success["meet:Join"].sum() == 10
assert runs.loc["meet:Join", "collisions"].sum() == 0
assert success["idle"].sum() == 0
assert env.swarm.task.at_goal().sum() == 5
