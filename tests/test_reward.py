"""The reward is sound: it ranks policies rightly, and neither dying nor dawdling pays."""

import numpy as np
import pytest

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.baselines import make
from uuv_marl.envs.batched_env import BatchedEnv
from uuv_marl.envs.reward import reward_terms


def mean_return(name, scenario):
    batch = BatchedEnv(scenario, 3)
    policy = make(name, scenario, 3)
    batch.reset(0)
    policy.reset(0)
    total, active = np.zeros(3), np.ones(3, bool)
    while active.any():
        result = batch.step(policy.act(batch.swarm.percept))
        total += np.where(active, result.reward.mean(axis=1), 0.0)
        active &= ~batch.swarm.ended
    return total


def test_the_controller_beats_the_floors_everywhere(scenario_name):
    scenario = load_scenario(scenario_name)
    best = mean_return("bio_inspired", scenario)
    for floor in ("random", "idle"):
        assert (best > mean_return(floor, scenario)).all(), floor


def test_step_terms_are_never_positive_and_arrival_pays_once(place):
    scenario = load_scenario("single_obstacle", num_vehicles=4)
    batch = BatchedEnv(scenario, 8)
    batch.reset(0)
    rng = np.random.default_rng(0)
    for _ in range(100):
        batch.step(rng.uniform(-1, 1, (8, 4, 2)).astype(np.float32))
        for name, term in reward_terms(batch.swarm).items():
            assert (term <= 0).all(), name


def returns(scenario, arrival_tick=None, die_at=None, bump_at=None, ticks=60):
    """Return of a scripted swarm that rests at its end; it arrives, loses vehicle 0 or bumps it when told."""
    batch = BatchedEnv(scenario)
    batch.reset(0)
    swarm, total = batch.swarm, np.zeros(swarm_size := scenario.swarm.num_vehicles)
    for k in range(ticks):
        near = arrival_tick is not None and k >= arrival_tick
        swarm.state.tick[0] = 2000 + k
        swarm.state.eta[0, :, :2] = 600.0 + 10.0 * np.arange(swarm_size)[:, None] - (0 if near else 300.0)
        swarm.state.eta[0, :, :2] -= swarm.state.eta[0, :, :2].mean(axis=0) - (600.0 if near else 300.0)
        swarm.state.nu[0] = 0.0
        if k == bump_at:  # vehicle 0 runs into vehicle 1
            swarm.state.eta[0, 0] = (*(swarm.state.eta[0, 1, :2] + (2.1, 0.0)), np.pi)
            swarm.state.nu[0, 0, 0] = 3.0
        if k == die_at:
            swarm.state.alive[0, 0] = False
        task_alive = swarm.state.alive[0].copy()
        result = batch.step(np.zeros((1, swarm_size, 2), np.float32))
        total += result.reward[0]
        if die_at == k:
            swarm.facts.lost[0, 0] = True
            total[0] += sum(term[0, 0] for term in reward_terms(swarm).values())
        assert task_alive.sum() >= swarm_size - 1
        if result.terminated[0, -1]:
            break
    return total


SCRIPTED = load_scenario("single_obstacle", num_vehicles=4, overrides={"arrival.dwell_s": 0.3})


def test_an_earlier_arrival_never_lowers_the_return():
    totals = [returns(SCRIPTED, arrival_tick=k).mean() for k in (5, 20, 40)]
    assert totals[0] >= totals[1] >= totals[2]
    assert totals[2] > returns(SCRIPTED).mean()


def test_a_death_always_lowers_the_return_of_the_dead_and_of_the_team():
    whole = returns(SCRIPTED, arrival_tick=40)
    dead = returns(SCRIPTED, arrival_tick=40, die_at=20)
    assert dead[0] < whole[0]
    assert dead.mean() < whole.mean()
    never = returns(SCRIPTED)
    assert returns(SCRIPTED, die_at=20)[0] < never[0]
    assert returns(SCRIPTED, die_at=20).mean() < never.mean()


def test_a_collision_always_lowers_the_return():
    whole, bumped = returns(SCRIPTED, arrival_tick=40), returns(SCRIPTED, arrival_tick=40, bump_at=20)
    assert bumped[0] <= whole[0] - SCRIPTED.reward.collision
    assert bumped.mean() < whole.mean()


def test_a_lost_vehicle_is_charged_more_than_staying_could_cost():
    """Idle vehicles are left behind by l(t) for minutes: dying at once must cost more than that."""
    lossy = load_scenario("single_obstacle", num_vehicles=6, overrides={"disturbance.loss_times_s": [1.0]})
    calm = load_scenario(lossy, overrides={"disturbance.loss_times_s": []})
    idle = np.zeros((1, 6, 2), np.float32)
    total = {}
    for scenario in (lossy, calm):
        batch = BatchedEnv(scenario)
        batch.reset(0)
        total[scenario] = np.zeros(6)
        while not batch.swarm.ended[0]:
            total[scenario] += batch.step(idle).reward[0]
        victim = batch.swarm.course.losses[0]
        if len(victim):
            dead = int(victim[0])
    assert total[lossy][dead] < total[calm][dead]
    assert total[lossy].mean() < total[calm].mean()


@pytest.mark.parametrize("reward", ["individual", "team"])
def test_dying_never_pays_the_one_who_dies(reward):
    base = load_scenario("single_obstacle", num_vehicles=12, overrides={"time_limit.factor": 0.5})
    totals, lost = [], []
    for losses in ([], [30.0]):
        batch = BatchedEnv(load_scenario(base, overrides={"disturbance.loss_times_s": losses}), reward=reward)
        batch.reset(3)
        lost += batch.swarm.course.losses[0].tolist()
        total = np.zeros(12)
        while not batch.swarm.ended[0]:
            result = batch.step(np.zeros((1, 12, 2), np.float32))
            total += result.reward[0] * (result.terminated[0] | batch.swarm.state.alive[0])
        totals.append(total)
    whole, dead = totals
    assert dead[lost] < whole[lost]
    if reward == "team":
        assert (dead <= whole).all()


def test_the_mean_does_not_depend_on_the_number_of_vehicles():
    """Vehicles that all see the same have the same reward, however many they are."""
    means = []
    for n in (3, 30):
        env = uuv_marl.parallel_env("tracking", num_vehicles=n, overrides={"constraints.s_u_m": 1000.0})
        env.reset(seed=0)
        swarm = env.swarm
        swarm.state.eta[0, :, :2] = swarm.facts.reference[0, :2] - 150.0
        swarm.state.eta[0, :, 0] += np.arange(n) * 3.0 / n
        swarm.state.before[0] = swarm.state.eta[0, :, :2]
        swarm.observe()
        terms = reward_terms(swarm)
        swarm.facts.spacing[:] = 4.0
        terms = reward_terms(swarm)
        means.append(sum(term.mean() for term in terms.values()))
    assert means[0] == pytest.approx(means[1], rel=0.02)
    assert means[0] < 0
