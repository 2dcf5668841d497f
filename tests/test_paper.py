"""The paper's numbers over 20 seeds, one parameter set for all scenarios; the comparators finish."""

import functools

import numpy as np
import pytest

from uuv_marl import evaluate


@functools.cache
def over_seeds(scenario, policy="bio_inspired"):
    runs = evaluate(policy, scenario, range(20))
    return {name: [run[name] for run in runs] for name in runs[0]}


@pytest.mark.parametrize(("scenario", "metric", "low", "high"), [
    ("tracking", "min_spacing_m", 9.5, 10.6),  # section 5.1: 10.03 m
    ("tracking", "mean_min_spacing_m", 10.8, 12.9),  # 12.29 m
    ("single_obstacle", "task_time_s", 198, 212),  # section 5.2.1: 205 s
    ("single_obstacle", "min_obstacle_distance_m", 9, 15),  # 10.48 and 12.63 m
    ("multi_obstacle", "task_time_s", 490, 540),  # section 5.2.2, a prediction: 527 s
    ("multi_obstacle", "min_obstacle_distance_m", 6, np.inf),  # 6.34 m
])  # fmt: skip
def test_numbers_of_the_paper(scenario, metric, low, high):
    assert low <= np.mean(over_seeds(scenario)[metric]) <= high
    assert sum(over_seeds(scenario)["collisions"]) == 0
    assert None not in over_seeds(scenario)["task_time_s"]


def test_the_clamps_do_not_bind():
    assert sum(over_seeds("single_obstacle")["clamps"]) == 0


@pytest.mark.parametrize("policy", ["sff", "sdc", "bio_inspired_plus"])
def test_the_comparators_finish(policy):
    assert sum(time is not None for time in over_seeds("single_obstacle", policy)["task_time_s"]) >= 19
