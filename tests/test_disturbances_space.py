"""A million agent-steps over all axes and levels of the robustness suite: observations stay within their space."""

import numpy as np
import pytest

import uuv_marl
from uuv_marl.baselines import make_policy
from uuv_marl.benchmark.robustness.axes import AXES, overrides

CELLS = [(axis, level) for axis, told in AXES.items() for level in told.levels]
WORLDS, VEHICLES = 16, 5
DECISIONS = -(-1_000_000 // (len(CELLS) * WORLDS * VEHICLES))
EVERY_CHANNEL = ["compass", "link", "current", "age", "ranged", "modem"]


@pytest.mark.parametrize("axis", AXES)
def test_observations_stay_finite_and_within_their_space(axis):
    for level in AXES[axis].levels:
        changes = {**overrides(axis, level, "random_field"), "sonar.channels": EVERY_CHANNEL}
        env = uuv_marl.vector_env(WORLDS, "random_field", num_vehicles=VEHICLES, overrides=changes)
        low, high = env.observation_space.low, env.observation_space.high
        observation, _ = env.reset(seed=level)
        policy, rng = make_policy("bio_inspired", env.scenario, WORLDS), np.random.default_rng(level)
        for k in range(DECISIONS):
            action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
            if k % 40 < 20:
                action = policy.act(env.swarm.percept)
            observation, reward, *_ = env.step(action)
            assert np.isfinite(observation).all()
            assert (low <= observation).all()
            assert (observation <= high).all()
            assert np.isfinite(reward).all()
        env.close()
