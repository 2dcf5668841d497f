"""The rewards are sound: they rank policies rightly, and neither dying, nor dawdling, nor circling pays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import uuv_marl
from tests.swarms import batched
from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy
from uuv_marl.scenario.task import task_class

PUPPETS = ("follow", "reach")
"""Tasks that any scenario can have."""
PLACES = {
    "follow": ("single_obstacle", {"arrival.dwell_s": 0.3}), "reach": ("single_obstacle", {"task": "reach"}),
    "hard_water": ("hard_water_easy", {}), "two_swarms": ("two_swarms_easy", {}),
    "few_informed": ("few_informed_easy", {}), "silent_targets": ("silent_targets_easy", {}),
}  # fmt: skip
"""A scenario of each task."""
AT_REST = [task for task in PLACES if task != "silent_targets"]
"""Tasks that have a place to be at."""
PAID = [(task, reward) for task in PLACES for reward in task_class(task).rewards]
ONCE = {"arrival", "stay", "held", "search"}
"""Terms that reward a place or an area covered; ``progress`` may be negative, and all others are costs."""
GUIDED = [
    ("follow", "starter", 5, "dense", 40), ("follow", "starter", 5, "sparse", 30),
    ("follow", "single_obstacle", 54, "dense", 2), ("reach", "starter", 5, "dense", 40),
    ("reach", "single_obstacle", 54, "dense", 2), ("hard_water", "hard_water", 10, "dense", 40),
    ("hard_water", "hard_water", 10, "geodesic", 40), ("two_swarms", "two_swarms_easy", 10, "dense", 40),
    ("few_informed", "few_informed_easy", 10, "dense", 40), ("few_informed", "few_informed_easy", 10, "leader", 30),
    ("few_informed", "few_informed", 20, "dense", 8), ("two_swarms", "two_swarms", 40, "dense", 4),
    ("silent_targets", "silent_targets_easy", 8, "dense", 40),
]  # fmt: skip
"""Task, scenario, vehicles, reward, and how many seeds, from 0 on."""


def mean_return(name, scenario, reward, worlds):
    batch, policy = batched(scenario, worlds=worlds, reward=reward), make_policy(name, scenario, worlds)
    policy.reset(0)
    total = np.zeros(worlds)
    while not batch.over.all():
        policy.active[:] = ~batch.over
        result = batch.step(policy.act(batch.swarm.percept))
        total += result.world_reward
        np.testing.assert_allclose(sum(result.terms.values()), result.reward, atol=1e-9)
    return total.mean()


@pytest.mark.parametrize(("task", "scenario", "vehicles", "reward", "seeds"), GUIDED)
def test_the_guide_of_a_task_beats_the_floors(task, scenario, vehicles, reward, seeds):
    loaded = load_scenario(scenario, num_vehicles=vehicles, overrides={"task.name": task})
    best = mean_return(task_class(task).reference_policy, loaded, reward, seeds)
    for floor in ("random", "idle"):
        assert best > mean_return(floor, loaded, reward, seeds), floor


class Puppets:
    """A swarm that is put where the test wants it, at the end of l(t); the reward looks at nothing else."""

    def __init__(self, task="follow", reward="dense", n=4, **overrides):
        scenario, own = PLACES[task]
        batch = batched(scenario, own | overrides, n=n, reward=reward)
        self.batch, self.n, self.swarm, world_map = batch, n, batch.swarm, batch.swarm.world_map
        group = world_map.group[0]
        self.end = world_map.waypoints[0, group, world_map.last[0, group]]
        rank = np.array([(group[:i] == group[i]).sum() for i in range(n)])
        apart = (6.0 if group.any() else 10.0) * (rank - (np.bincount(group)[group] - 1) / 2)
        self.block = np.stack([apart, np.zeros(n)], axis=1)
        self.rests = int(np.ceil(10.0 * self.swarm.duration_s[0])) if task in ("follow", "few_informed") else 100
        self.paid = np.zeros(n)

    def put(self, offset, step=0):
        """Everybody near to his group's end of l(t), but for ``offset`` [m], when l(t) is there; nothing is paid."""
        self.swarm.state.eta[0, :, :2] = self.end + self.block + np.asarray(offset)
        self.swarm.state.before[0] = self.swarm.state.eta[0, :, :2]
        self.swarm.state.nu[0] = 0.0
        self.swarm.state.tick[0] = self.rests + step

    def step(self):
        result = self.batch.step(np.zeros((1, self.n, 2), np.float32))
        self.paid += result.reward[0]
        return result


@settings(max_examples=20, deadline=None)
@given(way=st.lists(st.tuples(st.floats(-900, 900), st.floats(-900, 900)), min_size=1, max_size=6))
@pytest.mark.parametrize("task", AT_REST)
def test_who_moves_and_comes_back_gains_nothing(task, way):
    """Progress is a potential's change: around a closed way it sums to zero, and all else costs."""
    swarm = Puppets(task)
    swarm.put((300.0, 0.0))
    swarm.step()
    swarm.paid[:] = 0.0
    for k, place in enumerate([*way, (300.0, 0.0)]):
        if task != "follow" and np.hypot(*place) < 100.0:
            continue  # who is there is paid for it
        swarm.put(place, k + 1)
        swarm.step()
    assert (swarm.paid <= 1e-9).all()


def left(batch):
    """What progress counts [m]."""
    away = batch.task.remaining_m()[0] if hasattr(batch.task, "remaining_m") else batch.swarm.facts.away
    return np.minimum(away, batch.swarm.scenario.reward.progress_far_m)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(100_000, 200_000))
@pytest.mark.parametrize(("task", "reward"), [pair for pair in PAID if pair[1] not in ("sparse", "leader")])
def test_progress_sums_to_what_the_way_has_shortened_by_and_but_for_being_there_all_else_costs(task, reward, seed):
    scenario, own = PLACES[task]
    batch = batched(scenario, own, seed=seed, n=6, reward=reward)
    first, total = left(batch), 0.0
    push = np.random.default_rng(seed).uniform(-1.0, 1.0, (1, 6, 2)) * (0.7, 0.1)
    for _ in range(30):
        terms = batch.step(push).terms
        total = total + terms["progress"]
        assert all((paid <= 0.0).all() for name, paid in terms.items() if name not in ONCE | {"progress"})
        assert all((paid >= 0.0).all() for name, paid in terms.items() if name in ONCE)
    shorter = (first - left(batch)) / batch.swarm.scenario.reward.progress_m
    np.testing.assert_allclose(total, shorter, atol=1e-9)


def arrival(at, task, reward, bump_at=None, steps=60):
    """What is paid on a way that comes to the end at one step, and with ``bump_at`` meets a neighbour before."""
    swarm = Puppets(task, reward)
    for k in range(steps):
        swarm.put((0.0, 0.0) if at is not None and k >= at else (300.0, 0.0), k)
        if k == bump_at:
            state = swarm.swarm.state
            state.eta[0, 0] = (*(state.eta[0, 1, :2] + (2.1, 0.0)), np.pi)
            state.nu[0, 0, 0] = 3.0
        if swarm.step().world_terminated[0]:
            break
    return swarm.paid


@pytest.mark.parametrize(("task", "reward"), [pair for pair in PAID if pair[0] in AT_REST])
def test_an_earlier_arrival_of_the_same_way_never_lowers_the_return(task, reward):
    totals = [arrival(k, task, reward).mean() for k in (5, 20, 40, None)]
    assert totals == sorted(totals, reverse=True)
    assert totals[2] > totals[3]


@pytest.mark.parametrize(("task", "reward"), PAID)
def test_a_contact_lowers_the_return_of_both(task, reward):
    whole, bumped = arrival(40, task, reward), arrival(40, task, reward, bump_at=20)
    share = 0.25 if reward == "leader" else 1.0  # of the informed; the others pay it whole, too
    assert (bumped[:2] <= whole[:2] - 9.0 * share).all()
    assert bumped.mean() < whole.mean() - 1.0


@pytest.mark.parametrize("task", [*PUPPETS, "few_informed"])
@pytest.mark.parametrize("reward", ["dense", "sparse", "team", "leader"])
def test_dying_never_pays_the_one_who_dies(reward, task):
    """Idle vehicles are left behind for minutes: dying at once must cost more than that."""
    if reward not in (*task_class(task).rewards, "team"):
        pytest.skip(f"{task} has no such reward")
    scenario, own = PLACES[task]
    changes = {**own, "time_limit.factor": 0.5} | ({"task.informed": 6} if task == "few_informed" else {})
    totals, lost = [], []
    for losses in ([], [1.0]):
        batch = batched(scenario, changes | {"losses.times_s": losses}, seed=3, n=6, reward=reward)
        lost += batch.swarm.world_map.losses[0].tolist()
        total = np.zeros(6)
        while not batch.over[0]:
            total += batch.step(np.zeros((1, 6, 2), np.float32)).reward[0]
        totals.append(total)
    whole, dead = totals
    assert dead[lost] < whole[lost]
    assert dead.mean() < whole.mean()


@pytest.mark.parametrize("task", ["follow", "reach", "few_informed"])
def test_the_mean_does_not_depend_on_the_number_of_vehicles(task):
    """Vehicles that all see the same have the same reward, however many they are."""
    means = []
    for n in (3, 30):
        swarm = Puppets(task, n=n, **{"constraints.s_u_m": 1000.0})
        swarm.put((300.0, 0.0))
        swarm.step()
        swarm.paid[:] = 0.0
        swarm.swarm.state.eta[0, :, :2] = swarm.end + np.array([200.0, 0.0])
        swarm.swarm.state.before[0] = swarm.swarm.state.eta[0, :, :2]
        swarm.swarm.facts.away_before[0] = swarm.swarm.facts.away[0] = 300.0
        swarm.step()
        means.append(swarm.paid.mean())
    assert means[0] == pytest.approx(means[1], rel=1e-6)


@pytest.mark.parametrize("task", PLACES)
def test_terms_are_those_documented_and_sum_to_the_reward_whose_mean_the_team_has(task):
    scenario, changes = PLACES[task]
    env, team = (
        uuv_marl.parallel_env(scenario, overrides=changes, **own) for own in ({"info_terms": True}, {"reward": "team"})
    )
    env.reset(seed=0)
    team.reset(seed=0)
    for _ in range(20):
        action = dict.fromkeys(env.agents, np.ones(2, np.float32))
        _, rewards, *_, infos = env.step(action)
        assert list(team.step(action)[1].values()) == pytest.approx(len(rewards) * [np.mean(list(rewards.values()))])
        for agent, info in infos.items():
            assert list(info["reward_terms"]) == list(task_class(task).rewards["dense"])
            assert sum(info["reward_terms"].values()) == pytest.approx(rewards[agent], abs=1e-12)


def test_sparse_is_dense_without_progress():
    """Where nobody is lost and nobody arrives, the other terms are the same, bit for bit."""
    runs = [batched("starter", worlds=2, reward=reward) for reward in ("dense", "sparse")]
    for _ in range(20):
        dense, sparse = (batch.step(np.full((2, 5, 2), 0.3)).terms for batch in runs)
        assert list(sparse) == [name for name in dense if name != "progress"]
        assert all((dense[name] == sparse[name]).all() for name in sparse)
