"""The paper's numbers over 20 seeds, one parameter set for all scenarios; the comparators finish."""

import numpy as np
import pytest

from uuv_marl import evaluate


def over_seeds(scenario, policy="bio_inspired"):
    runs = evaluate(policy, scenario, range(20))
    return {name: [run[name] for run in runs] for name in runs[0]}


def test_tracking_section_5_1():
    m = over_seeds("tracking")
    assert 9.5 <= np.mean(m["min_spacing_m"]) <= 10.6  # paper: 10.03 m
    assert 10.8 <= np.mean(m["mean_min_spacing_m"]) <= 12.9  # paper: 12.29 m
    assert sum(m["collisions"]) == 0
    assert None not in m["task_time_s"]


def test_single_obstacle_section_5_2_1():
    m = over_seeds("single_obstacle")
    assert 198 <= np.mean(m["task_time_s"]) <= 212  # paper: 205 s
    assert 9 <= np.mean(m["min_obstacle_distance_m"]) <= 15  # paper: 10.48 and 12.63 m
    assert sum(m["collisions"]) == 0
    assert sum(m["clamps"]) == 0


def test_multi_obstacle_section_5_2_2_is_a_prediction():
    m = over_seeds("multi_obstacle")
    assert 490 <= np.mean(m["task_time_s"]) <= 540  # paper: 527 s
    assert np.mean(m["min_obstacle_distance_m"]) > 6  # paper: 6.34 m
    assert sum(m["collisions"]) == 0


@pytest.mark.parametrize("policy", ["sff", "sdc", "bio_inspired_plus"])
def test_the_comparators_finish(policy):
    m = over_seeds("single_obstacle", policy)
    assert sum(time is not None for time in m["task_time_s"]) >= 19
