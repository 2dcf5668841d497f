"""The rewards are sound: they rank policies rightly, and neither dying, nor dawdling, nor circling pays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.baselines import make
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.scenario.task import task_class

PUPPETS = ("follow", "reach")
"""Tasks that any scenario can have."""
GUIDED = [("starter", "dense", 100), ("starter", "sparse", 30), ("single_obstacle", "dense", 2)]
REACH = {"task": "reach"}


def mean_returns(name, scenario, reward, worlds):
    batch = BatchedEnv(scenario, worlds, reward)
    policy = make(name, scenario, worlds)
    batch.reset(0)
    policy.reset(0)
    total = np.zeros(worlds)
    while not batch.over.all():
        policy.active[:] = ~batch.over
        total += batch.step(policy.act(batch.swarm.percept)).world_reward
    return total


@pytest.mark.parametrize("task", PUPPETS)
@pytest.mark.parametrize(("scenario", "reward", "seeds"), GUIDED)
def test_the_guide_of_a_task_beats_the_floors(task, scenario, reward, seeds):
    if reward not in task_class(task).rewards:
        pytest.skip(f"{task} has no such reward")
    loaded = load_scenario(scenario, overrides={"task": task})
    best = mean_returns(task_class(task).guide, loaded, reward, seeds).mean()
    for floor in ("random", "idle"):
        assert best > mean_returns(floor, loaded, reward, seeds).mean(), floor


class Puppets:
    """A swarm that is put where the test wants it, at the end of l(t); the reward looks at nothing else."""

    def __init__(self, reward="dense", n=4, **overrides):
        scenario = load_scenario("single_obstacle", num_vehicles=n, overrides={"arrival.dwell_s": 0.3, **overrides})
        self.batch, self.n = BatchedEnv(scenario, reward=reward), n
        self.batch.reset(0)
        self.swarm, course = self.batch.swarm, self.batch.swarm.course
        self.end = course.waypoints[0, 0, course.last[0, 0]]
        self.paid = np.zeros(n)

    def put(self, offset, tick=2000):
        """Everybody 10 m apart around the end of l(t), moved by ``offset`` [m]; nothing is paid."""
        apart = 10.0 * (np.arange(self.n) - (self.n - 1) / 2)
        self.swarm.state.eta[0, :, :2] = self.end + np.asarray(offset) + np.stack([apart, np.zeros(self.n)], axis=1)
        self.swarm.state.before[0] = self.swarm.state.eta[0, :, :2]
        self.swarm.state.nu[0] = 0.0
        self.swarm.state.tick[0] = tick

    def step(self):
        result = self.batch.step(np.zeros((1, self.n, 2), np.float32))
        self.paid += result.reward[0]
        return result


@settings(max_examples=20, deadline=None)
@given(way=st.lists(st.tuples(st.floats(-900, 900), st.floats(-900, 900)), min_size=1, max_size=6))
@pytest.mark.parametrize("task", PUPPETS)
def test_who_moves_and_comes_back_gains_nothing(task, way):
    """Progress is a potential's change: around a closed way it sums to zero, and all else costs."""
    swarm = Puppets(task=task)
    swarm.put((300.0, 0.0))
    swarm.step()
    swarm.paid[:] = 0.0
    for place in [*way, (300.0, 0.0)]:
        if task == "reach" and np.hypot(*place) < 100.0:
            continue  # an arrival pays, once
        swarm.put(place)
        swarm.step()
    assert (swarm.paid <= 1e-9).all()


def arrival(at, reward, bump_at=None, steps=60):
    """What is paid on a way that comes to the end at one step, and with ``bump_at`` meets a neighbour before."""
    swarm = Puppets(reward)
    for k in range(steps):
        swarm.put((0.0, 0.0) if at is not None and k >= at else (300.0, 0.0), 2000 + k)
        if k == bump_at:
            state = swarm.swarm.state
            state.eta[0, 0] = (*(state.eta[0, 1, :2] + (2.1, 0.0)), np.pi)
            state.nu[0, 0, 0] = 3.0
        if swarm.step().world_terminated[0]:
            break
    return swarm.paid


@pytest.mark.parametrize("reward", ["dense", "sparse"])
def test_an_earlier_arrival_of_the_same_way_never_lowers_the_return(reward):
    totals = [arrival(k, reward).mean() for k in (5, 20, 40, None)]
    assert totals == sorted(totals, reverse=True)
    assert totals[2] > totals[3]


@pytest.mark.parametrize("reward", ["dense", "sparse"])
def test_a_contact_lowers_the_return_of_both(reward):
    whole, bumped = arrival(40, reward), arrival(40, reward, bump_at=20)
    assert (bumped[:2] <= whole[:2] - 9.0).all()
    assert bumped.mean() < whole.mean()


@pytest.mark.parametrize("task", PUPPETS)
@pytest.mark.parametrize("reward", ["dense", "sparse", "team"])
def test_dying_never_pays_the_one_who_dies(reward, task):
    """Idle vehicles are left behind for minutes: dying at once must cost more than that."""
    if reward not in (*task_class(task).rewards, "team"):
        pytest.skip(f"{task} has no such reward")
    changes = {"time_limit.factor": 0.5, "task": task}
    base = load_scenario("single_obstacle", num_vehicles=6, overrides=changes)
    totals, lost = [], []
    for losses in ([], [1.0]):
        batch = BatchedEnv(load_scenario(base, overrides={"disturbance.loss_times_s": losses}), reward=reward)
        batch.reset(3)
        lost += batch.swarm.course.losses[0].tolist()
        total = np.zeros(6)
        while not batch.over[0]:
            total += batch.step(np.zeros((1, 6, 2), np.float32)).reward[0]
        totals.append(total)
    whole, dead = totals
    assert dead[lost] < whole[lost]
    assert dead.mean() < whole.mean()


@pytest.mark.parametrize("task", PUPPETS)
def test_the_mean_does_not_depend_on_the_number_of_vehicles(task):
    """Vehicles that all see the same have the same reward, however many they are."""
    means = []
    for n in (3, 30):
        swarm = Puppets(n=n, task=task, **{"constraints.s_u_m": 1000.0})
        swarm.put((300.0, 0.0))
        swarm.step()
        swarm.paid[:] = 0.0
        swarm.swarm.state.eta[0, :, :2] = swarm.end + np.array([200.0, 0.0])
        swarm.swarm.state.before[0] = swarm.swarm.state.eta[0, :, :2]
        swarm.swarm.facts.was_away[0] = swarm.swarm.facts.away[0] = 300.0
        swarm.step()
        means.append(swarm.paid.mean())
    assert means[0] == pytest.approx(means[1], rel=1e-6)


@pytest.mark.parametrize("task", PUPPETS)
def test_terms_are_those_documented_and_sum_to_the_reward_whose_mean_the_team_has(task):
    env, team = (
        uuv_marl.parallel_env("starter", task=task, **own) for own in ({"info_terms": True}, {"reward": "team"})
    )
    env.reset(seed=0)
    team.reset(seed=0)
    for _ in range(20):
        action = dict.fromkeys(env.agents, np.ones(2, np.float32))
        _, rewards, *_, infos = env.step(action)
        assert list(team.step(action)[1].values()) == pytest.approx(len(rewards) * [np.mean(list(rewards.values()))])
        for agent, info in infos.items():
            assert list(info["reward_terms"]) == list(task_class(task).terms)
            assert sum(info["reward_terms"].values()) == pytest.approx(rewards[agent], abs=1e-12)


def test_sparse_is_dense_without_progress():
    """Where nobody is lost and nobody arrives, the other terms are the same, bit for bit."""
    runs = [BatchedEnv(load_scenario("starter"), 2, reward) for reward in ("dense", "sparse")]
    for batch in runs:
        batch.reset(0)
    for _ in range(20):
        dense, sparse = (batch.step(np.full((2, 5, 2), 0.3)).terms for batch in runs)
        assert list(sparse) == [name for name in dense if name != "progress"]
        assert all((dense[name] == sparse[name]).all() for name in sparse)
