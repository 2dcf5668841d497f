"""The global state determines the reward of the coming step, but for what is random."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.swarms import batched
from uuv_marl.baselines import make_policy
from uuv_marl.scenario.task import task_class

SCENARIOS = {
    "follow": "starter", "reach": "starter", "hard_water": "hard_water_easy", "two_swarms": "two_swarms_easy",
    "few_informed": "few_informed_easy", "silent_targets": "silent_targets_easy",
}  # fmt: skip
CASES = [(task, reward) for task in SCENARIOS for reward in task_class(task).rewards]
UNKNOWN = {"turn_at", "turn_by", "turns", "covered_s"}
"""Of ``silent_targets``: draws that the episode has not come to, random for whoever knows only the present, and the
thousands of cells of the reward ``search``, which would make most of the state."""


def batch_at(task, reward, steps):
    """A world a few decisions after its start, with some vehicles at their goals and others close to them."""
    batch = batched(SCENARIOS[task], {"task.name": task}, seed=steps, n=4, reward=reward)
    policy, state = make_policy("random", batch.swarm.scenario), batch.swarm.state
    policy.reset(0)
    if task != "silent_targets":
        rank = np.arange(4.0)[:, None]
        state.eta[0, :, :2] = batch.swarm.own_reference[0, :, :2] + rank * [25.0, 0.0] + [40.0, 0.0]
        batch.swarm.observe()
    for _ in range(steps):
        batch.step(policy.act(batch.swarm.percept))
    return batch


@settings(max_examples=8, deadline=None)
@given(steps=st.integers(1, 6), seed=st.integers(0, 2**32 - 1))
@pytest.mark.parametrize(("task", "reward"), CASES)
def test_a_memory_that_changes_the_coming_reward_changes_the_state(task, reward, steps, seed):
    """Perturb each array of the task's memory, dwell and arrival: the reward is the same, or the state differs."""
    batch, rng = batch_at(task, reward, steps), np.random.default_rng(seed)
    before, state = batch.swarm.snapshot(), batch.state()
    action = rng.uniform(-1.0, 1.0, (1, 4, 2)).astype(np.float32)
    paid = batch.step(action).reward
    for name, array in before.items():
        own = name.removeprefix("task.")
        if (own == name and name not in ("dwell", "arrival_s")) or own in UNKNOWN:
            continue
        changed = array.copy()
        if own == "first_at_goal_s":  # paid before, or never
            changed[:] = np.where(array > 0.0, 0.0, 0.5)
        elif name == "arrival_s":
            changed[:] = np.where(np.isnan(array), 0.1, np.nan)
        else:
            changed = np.where(np.isfinite(array), array + rng.integers(1, 5, array.shape), 1.0).astype(array.dtype)
        batch.swarm.restore({**before, name: changed})
        batch.over[:] = False
        same_state = (batch.state() == state).all()
        again = batch.step(action).reward
        assert not same_state or (again == paid).all(), name


@pytest.mark.parametrize("task", SCENARIOS)
def test_the_channel_episode_shows_what_was_paid_and_what_time_is_left(task):
    brief = {"time_limit.extra_s": 3.0, "time_limit.factor": 0.001}
    batch = batched(SCENARIOS[task], {"task.name": task, "sonar.channels": ["episode"], **brief}, n=4)
    left = []
    while not batch.over[0]:
        percept = batch.swarm.percept
        np.testing.assert_array_equal(percept["arrived"][0, :, 0], batch.task.arrived_before()[0])
        left.append(percept["time_left"][0, 0, 0])
        batch.step(np.zeros((1, 4, 2)))
    assert left[0] == 1.0
    assert left == sorted(left, reverse=True)
    assert batch.swarm.percept["time_left"].max() == 0.0


def test_an_identity_is_the_vehicles_own_and_constant():
    batch = batched("starter", {"sonar.channels": ["identity"]}, 2)
    for _ in range(3):
        assert batch.swarm.percept["identity"][:, :, 0] == pytest.approx(np.tile([0.1, 0.3, 0.5, 0.7, 0.9], (2, 1)))
        batch.step(np.ones((2, 5, 2)))
