# %% [markdown]
# # 5. Read and compare results
#
# Of two policies on random fields, `scout` is faster by some seconds and keeps more distance from obstacles. You find
# this out with pandas, and also how certain it is.
#
# - **Time**: about 2 minutes on two cores, of which 60 s are compiling at the first run.
# - **Needs**: the extra `analysis`; the first cell installs uuv_marl where it is missing.
#
# ## The same seeds for both
#
# `random_field` has a new trajectory and new obstacles for each seed. Both policies run on the same twenty fields, with
# the same starts. Look at the row of each policy.

# %% language="bash"
# uuv-marl benchmark --scenario random_field --set swarm.num_vehicles=6 --seeds 20 --output results/fields \
#     --policy bio_inspired_plus --policy scout

# %% [markdown]
# The task times differ by some seconds. This table does not show how certain the difference is.
#
# ## Read the results
#
# `load` reads `results.json`, or the folder that holds it. First check that both policies arrive without a collision;
# otherwise a time means little. Look at the counts.

# %%
import uuv_marl.benchmark

runs = uuv_marl.benchmark.load("results/fields")
runs.groupby("policy").agg(runs=("seed", "count"), arrived=("task_time_s", "count"), collisions=("collisions", "sum"))

# %% [markdown]
# Both policies arrive on all fields, without a collision. `task_time_s` is NaN if a swarm did not arrive, and `count`
# leaves out NaN. If yours does not always arrive, compare times only over the seeds on which both arrived, and state
# how many seeds these are. [Metrics](../benchmark.md#metrics) defines every column.
#
# The column `trace` names the file with a run's time series. A metric is a summary of a trace. Look at the smallest
# spacing, taken from both files.

# %%
trace = uuv_marl.benchmark.load_trace(runs["trace"][0])
print(len(trace["time_s"]), "samples from", trace["time_s"][0], "to", trace["time_s"][-1], "s")
print("from the trace:", trace["min_spacing_m"].min(), "  from results.json:", runs["min_spacing_m"][0])

# %% [markdown]
# The two numbers are equal, except for the rounding to float32.
#
# ## Pairs
#
# The fields differ far more than the policies do: one field takes about twice as long as another. The table has a row
# for each seed. Look at how the columns rise and fall together.

# %%
times = runs.pivot(index="seed", columns="policy", values="task_time_s").dropna()
times["difference"] = times["scout"] - times["bio_inspired_plus"]
times.head(8).round(1)

# %% [markdown]
# The times range over minutes, the differences over seconds. Both policies ran on the same field, so the difference
# comes from the policies alone.
#
# `estimate` gives the values of the benchmark's tables: the mean of the middle half, and its bootstrap interval over
# seeds. Look at the last interval.

# %%
from uuv_marl.benchmark.estimates import estimate

for name in times:
    print(f"{name:18} {estimate(times[name]):.1f} s")

# %% [markdown]
# The brackets are 95 % intervals. The intervals of the two times are wide and overlap, so they do not show which policy
# is faster. The interval of the paired difference lies below zero: `scout` is faster by some seconds.
#
# - **The mean of the middle half** (interquartile mean) leaves out the best and the worst quarter. An outlier changes
#   it less than a mean, and it uses more of the data than a median.
# - **The interval** shows how the number would vary with other seeds of the same scenario, not in other scenarios.
#
# ## The worst seed for safety
#
# A mean is the wrong measure of safety, because wide passes in nineteen runs can hide a collision in one. Look at the
# smallest distance in all runs of each policy.

# %%
safety = runs.groupby("policy")[["min_obstacle_distance_m", "min_spacing_m"]].min()
safety.round(1)

# %% [markdown]
# On at least one field `bio_inspired_plus` came within 2 m of an obstacle; a collision begins at 1 m. No mean shows
# that. `scout` stays at least 5 m away from obstacles, but lets vehicles come nearer to each other; between vehicles a
# collision begins at 2 m.
#
# The worst of twenty runs says nothing about one run in a thousand. If n runs have no collision, the probability of a
# collision is below about 3 / n with 95 % confidence: here 3 / 20, about 15 %. For this reason [the held-out
# table](../results.md#held-out-seeds) has 1,000 fields.
#
# ## Seeds for reports
#
# A policy that was tuned or chosen on some seeds looks better on them than it is. So each purpose has its own range:
#
# | seeds | for |
# | --- | --- |
# | 0 to 9,999 | benchmarks: what you report |
# | 10,000 to 99,999 | tuning of gains |
# | 100,000 to 999,999 | training, and validation that chooses a checkpoint |
#
# `uuv-marl benchmark`, `tune` and `train` keep to these ranges. If you change a gain because of a benchmark's table,
# the seeds of that table have become tuning seeds: report others. The result of a training also depends on the
# training's own seed: compare several trainings of each algorithm, not the best of each.

# %% tags=["check"]
assert abs(trace["min_spacing_m"].min() - runs["min_spacing_m"][0]) < 1e-4
assert len(times) == 20
assert estimate(times["difference"]).high < 0.0
assert estimate(times["scout"]).low < estimate(times["bio_inspired_plus"]).value < estimate(times["scout"]).high
assert estimate(times["scout"]).high - estimate(times["scout"]).low > 20.0
assert times["scout"].max() > 1.8 * times["scout"].min()
assert times["difference"].abs().max() < 60.0
assert 1.0 < safety["min_obstacle_distance_m"]["bio_inspired_plus"] < 2.0
assert safety["min_obstacle_distance_m"]["scout"] > 5.0
assert (safety["min_spacing_m"] > 2.0).all()
assert runs["collisions"].sum() == 0
assert safety["min_spacing_m"]["scout"] < safety["min_spacing_m"]["bio_inspired_plus"]
