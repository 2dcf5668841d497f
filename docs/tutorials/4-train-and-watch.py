# %% [markdown]
# # 4. Train and watch
#
# One minute of training gives a policy that brings five vehicles past an obstacle. You see how it learns, watch it, and
# compare it with a controller.
#
# - **Time**: about 3 minutes on two cores, of which 60 s are compiling at the first run.
# - **Needs**: the extras `analysis`, `render` and `train`; the first cell installs uuv_marl where it is missing.
#
# ## Train
#
# One command trains a network, which all vehicles share, with MAPPO on 128 worlds at once. Look at how the last column
# falls.

# %% language="bash"
# uuv-marl train starter --minutes 1 --output runs/starter

# %% [markdown]
# Each line is a validation: the swarm success over 16 episodes (all vehicles arrived without a collision), the number
# of collisions, and the time of arrival. Your numbers differ a little from ours, because a training by time depends on
# the processor. With `--steps` in place of `--minutes` the same machine gives the same training again.
#
# ## How it learned
#
# The folder holds `progress.csv`, with a row for each iteration, and its plot, `curve.png`. Look at the reward.

# %%
from IPython.display import Image

Image("runs/starter/curve.png", width=700)

# %% [markdown]
# The reward rises in the first 20 seconds. It then fluctuates, because an iteration is 32 s of each world and covers
# other parts of the episodes than the one before.
#
# ## Watch it
#
# `best` is the policy of the best validation. A checkpoint's path can stand in place of any policy's name. Validations
# use the seeds from 900,000 on. Look at how near the vehicles come to each other.

# %% language="bash"
# uuv-marl replay --scenario starter --policy runs/starter/best --seed 900003 --output episode.png

# %%
Image("episode.png", width=700)

# %% [markdown]
# The picture shows four moments of one episode. `--output episode.gif` makes a film of it, and without `--output` you
# get a page with a time line.
#
# ## Compare it
#
# Training never uses the seeds of a benchmark, 0 to 9,999. Look at the two rows.

# %% language="bash"
# uuv-marl benchmark --scenario starter --seeds 10 --output results/trained \
#     --policy bio_inspired_plus --policy runs/starter/best

# %% [markdown]
# Your policy takes about as long as the tuned controller, `bio_inspired_plus`. It keeps less distance between vehicles,
# because its reward asks for only 5 m. It acts end to end, without a controller or a filter.
#
# `uuv-marl train --resume --output runs/starter --minutes 2` continues the training. [Train a policy](../training.md)
# has harder problems, rewards of your own, and ONNX.
#
# Next: [read and compare results](5-read-and-compare.ipynb).

# %% tags=["check"]
import pandas as pd

import uuv_marl.benchmark

progress = pd.read_csv("runs/starter/progress.csv")
assert progress["reward"][:3].mean() < progress["reward"].iloc[-5:].mean()
assert progress["swarm_success"].dropna().max() >= 0.8
runs = uuv_marl.benchmark.load("results/trained").set_index("policy")
assert runs.loc["runs/starter/best", "task_time_s"].notna().sum() >= 8
assert runs.loc["runs/starter/best", "task_time_s"].median() < 50.0
assert runs.loc["bio_inspired_plus", "task_time_s"].notna().all()
assert runs["min_spacing_m"]["runs/starter/best"].median() < runs["min_spacing_m"]["bio_inspired_plus"].median()
