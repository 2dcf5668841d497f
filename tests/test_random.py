"""Counter-based random numbers: known answers, distributions, and independence of other generators."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest, pearsonr

from uuv_marl import load_scenario
from uuv_marl.sim import random
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.swarm import Swarm

KEY = np.uint64(0x299F31D0A4093822)
WORD = st.integers(0, 2**32 - 1)


@compiled
def fill(key, purpose, vehicle, uniform, normal):
    for t in range(uniform.shape[0]):
        uniform[t], normal[t] = random.uniform(key, purpose, t, vehicle, 0), random.normal(key, purpose, t, vehicle, 0)


def series(key=KEY, purpose=1, vehicle=0, num=50_000):
    uniform, normal = np.empty(num), np.empty(num)
    fill(np.uint64(key), purpose, vehicle, uniform, normal)
    return uniform, normal


@pytest.mark.parametrize(("key", "counter", "expected"), [
    (0, [0, 0, 0, 0], "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    (2**64 - 1, [2**32 - 1] * 4, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (KEY, [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344], "d16cfe09 94fdcceb 5001e420 24126ea1"),
])  # fmt: skip
def test_known_answers_of_random123(key, counter, expected):
    words = random.philox(np.uint64(key), *(np.uint64(word) for word in counter))
    assert " ".join(f"{int(word):08x}" for word in words) == expected


def test_distributions_and_independence():
    uniform, normal = series()
    assert uniform.min() >= 0.0
    assert uniform.max() < 1.0
    assert kstest(uniform, "uniform").pvalue > 1e-3
    assert kstest(normal, "norm").pvalue > 1e-3
    for other in (series(KEY + np.uint64(1)), series(purpose=2), series(vehicle=1)):
        assert abs(pearsonr(uniform, other[0]).statistic) < 0.02
        assert abs(pearsonr(normal, other[1]).statistic) < 0.02
    assert abs(pearsonr(uniform[1:], uniform[:-1]).statistic) < 0.02


@given(st.integers(0, 2**64 - 1), st.tuples(WORD, WORD, WORD, WORD))
def test_a_number_is_a_function_of_its_counter(key, place):
    first = random.uniforms(np.uint64(key), *place)
    assert random.uniforms(np.uint64(key), *place) == first
    assert random.uniform(np.uint64(key), *place) == first[0]
    for k in range(4):
        moved = [value ^ (i == k) for i, value in enumerate(place)]
        assert random.uniforms(np.uint64(key), *moved) != first


@given(st.floats(min_value=5e-324, max_value=1.7e308))
def test_logarithm(x):
    assert random.log(x) == pytest.approx(math.log(x), rel=5e-16, abs=1e-18)


def test_keys_belong_to_episodes_and_change_no_sample():
    scenario = load_scenario("random_field", num_vehicles=3)
    batch, alone = Swarm(scenario, 3), Swarm(scenario)
    batch.reset(7)
    assert len(set(batch.keys.tolist())) == 3
    for w in range(3):
        alone.reset(7 + w)
        assert alone.keys[0] == batch.keys[w]
    first = batch.keys.copy()
    batch.reset(None, [1])
    assert batch.keys[1] != first[1]
    assert batch.keys[0] == first[0]
    alone.reset(8)
    alone.reset()
    assert alone.keys[0] == batch.keys[1], "an unseeded reset goes on with the world's own stream"
    assert random.episode_key(np.random.default_rng(7)) == first[0]
