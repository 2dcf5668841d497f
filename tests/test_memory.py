"""What vehicles remember of their surroundings, beside the truth: places, obstacles, neighbours' velocities."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.swarms import fly, piloted
from uuv_marl.baselines.memory.discs import CONFIRMED
from uuv_marl.baselines.memory.neighbours import age_of
from uuv_marl.baselines.memory.response import follow, remains
from uuv_marl.baselines.memory.surroundings import uncertainty

DISCS = ((260.0, 190.0, 15.0), (330.0, 270.0, 25.0), (430.0, 330.0, 10.0))
COURSE = {
    "trajectory.waypoints_m": [[150.0, 150.0], [450.0, 250.0], [350.0, 450.0]], "swarm.num_vehicles": 12,
    "obstacles": [{"centre_m": [x, y], "radius_m": radius} for x, y, radius in DISCS],
}  # fmt: skip
"""Two legs, obstacles beside them, and rest."""
SURFACE = {"sonar.echo_reports": "surface"}
NOISE = {"noise.bearing_deg": 2.0, "noise.range_share": 0.02}
LATE = {
    "latency.processing_s": 0.3, "latency.compensated": True, "latency.active_period_s": 0.5,
    "latency.passive_period_s": 0.5,
}  # fmt: skip
CURRENT = {"current.speed_mps": 0.5}


def run(overrides, seconds=140.0, policy="scout", seed=10_500):
    """Remembered beside true, every second: the errors of own places [m] and headings [rad], of confirmed discs'
    centres and surfaces within 40 m [m] and of the velocities of neighbours heard within 30 m [m/s]; the share of the
    confirmed discs that are no obstacle, and of the obstacles within 20 m that are not remembered.
    """
    swarm, acts = piloted(policy, "single_obstacle", COURSE | overrides, seed=seed)
    percept, period = swarm.percept, swarm.scenario.timing.decision_period_s
    errors = {name: [] for name in ("place", "turn", "centre", "surface", "velocity")}
    found, missed, phantoms, discs, turn, origin = 0, 0, 0, 0, None, None
    for k in range(round(seconds / period)):
        action, eta, m = acts.act(percept), swarm.state.eta[0].copy(), acts.memory
        if turn is None:  # from maps to the world
            turn = eta[:, 2] - np.arctan2(m.pose[0, :, 3], m.pose[0, :, 2])
            origin = eta[:, :2] - rotated(m.pose[0, :, :2], turn)
        if k % round(1.0 / period) == 0 and k * period > 10.0:
            errors["place"].append(np.linalg.norm(origin + rotated(m.pose[0, :, :2], turn) - eta[:, :2], axis=1))
            heading = np.arctan2(m.pose[0, :, 3], m.pose[0, :, 2]) + turn - eta[:, 2]
            errors["turn"].append(np.abs((heading + np.pi) % (2 * np.pi) - np.pi))
            there = swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0]]
            for i, pose in enumerate(m.pose[0]):
                now = eta[i, 2] - np.arctan2(pose[3], pose[2])  # what counts is where things are from here

                def seen(points, here=eta[i, :2], pose=pose, now=now):
                    return here + rotated(points - pose[:2], now)

                sure = m.disc[0, i, m.score[0, i] >= CONFIRMED]
                sure = np.column_stack([seen(sure[:, :2]), sure[:, 2]])
                away = np.linalg.norm(sure[:, None, :2] - there[None, :, :2], axis=2)
                true = away < there[None, :, 2]
                discs, phantoms = discs + len(sure), phantoms + (~true.any(axis=1)).sum()
                reach = np.linalg.norm(eta[i, :2] - there[:, :2], axis=1) - there[:, 2]
                found, missed = found + (reach < 20).sum(), missed + ((reach < 20) & ~true.any(axis=0)).sum()
                for d, o in zip(*np.nonzero(true & (reach < 40.0)), strict=True):
                    near = np.linalg.norm(eta[i, :2] - sure[d, :2]) - sure[d, 2]
                    errors["centre"].append(away[d, o])
                    errors["surface"].append(abs(near - reach[o]))
                errors["velocity"] += velocities(i, swarm, m, seen(m.place[0, i]), now)
        percept = swarm.step(action)
    measured = {name: np.concatenate([np.atleast_1d(value) for value in values]) for name, values in errors.items()}
    return SimpleNamespace(**measured, phantoms=phantoms / max(discs, 1), forgotten=missed / max(found, 1))


def rotated(points, angle):
    """Points (..., 2) turned clockwise by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * points[..., 0] - s * points[..., 1], s * points[..., 0] + c * points[..., 1]], axis=-1)


def velocities(i, swarm, m, places, turn):
    """Errors of the velocities that a vehicle remembers of those that it heard within half a second."""
    errors, eta = [], swarm.state.eta[0]
    for k in np.flatnonzero((m.known[0, i] > 3) & (m.since[0, i] < 0.55)):
        away = np.linalg.norm(places[k] - eta[:, :2], axis=1)
        away[i] = np.inf
        j = int(np.argmin(away))
        if np.linalg.norm(eta[j, :2] - eta[i, :2]) < 30.0:
            errors.append(np.linalg.norm(rotated(m.velocity[0, i, k], turn) - rotated(swarm.velocity[0, j], eta[j, 2])))
    return errors


@pytest.mark.parametrize("period", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("policy", ["scout", "bio_inspired,safety_filter=true"])
def test_a_vehicle_knows_where_it_is_through_turns_and_rest(policy, period):
    seen = run({"timing.decision_period_s": period}, policy=policy)
    assert seen.place.max() < 1e-2
    assert seen.turn.max() < 1e-3


@given(a=st.floats(0.0, 0.99), share=st.floats(0.2, 1.0), drift=st.floats(-0.2, 0.2), seed=st.integers(0, 99))
def test_what_remains_is_found_from_any_actions(a, share, drift, seed):
    """f = s c + a (f - s c) + b, for random actions c: a itself where s is 1, more where less than all comes."""
    kept, (rng, acted) = room(), (np.random.default_rng(seed), 0.0)
    for asked in rng.uniform(-1.0, 1.0, 400):
        acted = share * asked + a * (acted - share * asked)
        follow(0, 0, 1, asked, acted + drift - asked, 0.01, kept)
    found = remains(0, 0, 1, kept)
    if share == 1.0:
        assert found == pytest.approx(a, abs=1e-3)
    assert found >= a - 1e-3
    assert remains(0, 0, 0, kept) == 0.0, "the other component"


def room():
    """What one vehicle remembers of nothing."""
    return piloted("scout", "tracking", n=1)[1].memory


@pytest.mark.parametrize("echoes", ["centre", "surface"])
def test_obstacles_are_known_within_centimetres_without_noise(echoes):
    seen = run({"sonar.echo_reports": echoes})
    assert np.quantile(seen.surface, 0.99) < 0.05
    assert seen.phantoms < 0.002
    assert seen.forgotten == 0.0


def test_neighbours_velocities_follow_from_their_places():
    seen = run({})
    assert np.median(seen.velocity) < 0.03
    assert (seen.velocity < 0.3).mean() > 0.95


@pytest.mark.parametrize(("disturbance", "median", "worst", "phantoms", "forgotten"), [
    (NOISE, 0.3, 3.0, 0.05, 0.02),
    (LATE, 0.05, 0.5, 0.01, 0.02),
    (CURRENT, 0.05, 0.5, 0.01, 0.02),
    (NOISE | LATE | CURRENT, 0.5, 3.0, 0.05, 0.05),
    ({"noise.silence_probability": 0.1, "noise.silence_readings": 10}, 0.05, 3.0, 0.02, 0.25),
    ({"noise.false_echo_probability": 0.05}, 0.05, 2.0, 0.4, 0.05),
], ids=["noise", "late", "current", "all", "silence", "false_echoes"])  # fmt: skip
def test_obstacles_are_known_in_a_disturbed_sea(disturbance, median, worst, phantoms, forgotten):
    """Margins of about three over what was seen; false echoes are what it bears least."""
    seen = run(SURFACE | disturbance)
    assert np.median(seen.surface) < median
    assert np.quantile(seen.surface, 0.99) < worst
    assert seen.phantoms < phantoms
    assert seen.forgotten < forgotten


def test_an_obstacle_that_is_gone_is_forgotten():
    swarm, policy = piloted("scout", "single_obstacle", n=1)
    while not (policy.memory.score[0, 0] >= 20.0).any():
        fly(swarm, policy, 1)
    swarm.world_map.num_obstacles[0] = 0
    swarm.observe()
    fly(swarm, policy, 35)
    assert not (policy.memory.score[0, 0] >= CONFIRMED).any()


@pytest.mark.parametrize("speed", [0.02, 4.0])
def test_a_reference_that_turns_little_by_little_does_not_turn_the_map(speed):
    """An arc of a hundred corners of half a degree; slow or quick."""
    angles = np.radians(np.arange(100) * 0.5)
    points = np.cumsum(np.column_stack([np.cos(angles), np.sin(angles)]) * (0.02 if speed < 1.0 else 2.0), axis=0)
    overrides = {"trajectory.waypoints_m": points.tolist(), "trajectory.speed_mps": speed, "obstacles": []}
    swarm, policy = piloted("proportional_tracking,safety_filter=true", "tracking", overrides, seed=1, n=1)
    percept = swarm.percept
    for k in range(400):
        action = policy.act(percept)
        if k == 0:
            turn = swarm.state.eta[0, 0, 2] - np.arctan2(*policy.memory.pose[0, 0, [3, 2]])
            origin = swarm.state.eta[0, 0, :2] - rotated(policy.memory.pose[0, 0, :2], turn)
        place = origin + rotated(policy.memory.pose[0, 0, :2], turn)
        assert np.hypot(*(place - swarm.state.eta[0, 0, :2])) < 0.05
        percept = swarm.step(action)


def test_a_fix_that_is_cut_is_none():
    swarm, policy = piloted("proportional_tracking,safety_filter=true", "tracking", n=1)
    swarm.state.eta[0, 0, :2] = (-9000.0, 5000.0)
    policy.act(swarm.observe())
    before, then = policy.memory.pose[0, 0, :2].copy(), swarm.state.eta[0, 0, :2].copy()
    policy.act(fly(swarm, policy, 200))
    went = np.hypot(*(swarm.state.eta[0, 0, :2] - then))
    assert np.hypot(*(policy.memory.pose[0, 0, :2] - before)) == pytest.approx(went, rel=1e-3)


@pytest.mark.parametrize("memory_s", [1.0, 2.0, 3.0])
def test_a_neighbour_that_falls_silent_is_kept_for_as_long_as_the_law_says(memory_s):
    """Two vehicles at rest, beside each other; then one is gone."""
    swarm, policy = piloted("scout", "tracking", n=2, memory_s=memory_s)
    swarm.state.eta[0, 1, :2] = swarm.state.eta[0, 0, :2] + 20.0
    policy.act(swarm.observe())
    assert policy.memory.known[0, 0].any()
    swarm.state.eta[0, 1, :2] = 1e4
    silent_s = 0.0
    while policy.memory.known[0, 0].any() and silent_s < 10.0:
        policy.act(swarm.step(np.zeros((1, 2, 2), np.float32)))
        silent_s += swarm.scenario.timing.decision_period_s
    assert memory_s < silent_s < memory_s + 0.15
    assert age_of(0, 0, policy.memory) == 0.0, "and says nothing of the sonar by then"


@pytest.mark.parametrize(("overrides", "least", "most"), [
    ({}, 0.0, 0.1),
    ({"actuators.thrust_lag_s": 0.2, "actuators.yaw_lag_s": 0.2}, 0.95, 1.0),
    ({"noise.bearing_deg": 2.0}, 0.8, 1.0),
    ({"timing.decision_period_s": 0.5}, 0.25, 1.0),
], ids=["calm", "lag", "noise", "slow"])  # fmt: skip
def test_vehicles_doubt_where_something_is_not_as_expected(overrides, least, most):
    (swarm, policy), doubts = piloted("scout", "random_field", overrides, seed=10_007, n=20), []
    decisions = round(40.0 / swarm.scenario.timing.decision_period_s)
    for k in range(decisions):
        fly(swarm, policy, 1)
        if k > decisions / 4:
            doubts.append([uncertainty(0, i, policy.memory) for i in range(20)])
    assert least <= np.mean(doubts) <= most
